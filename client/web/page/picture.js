// SPDX-License-Identifier: MIT
// Frames on a canvas: JPEG by the browser's images, H.264 by WebCodecs.

const CODEC = "avc1.640033"; // high profile, level 5.1; the stream carries its own parameters
const FAILURES_MAX = 3;

export async function canH264() {
  if (!("VideoDecoder" in window)) return false;
  try {
    return (await VideoDecoder.isConfigSupported({ codec: CODEC, optimizeForLatency: true })).supported === true;
  } catch {
    return false;
  }
}

export class Picture {
  // shown(header): the frame is visible. lost(gone): a key frame is needed; gone: H.264 does not work at all.
  constructor(canvas, shown, lost) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.shown = shown;
    this.lost = lost;
    this.last = Promise.resolve(); // keeps frames in order
    this.waiting = new Map(); // headers of frames in the decoder, by number
    this.failures = 0;
  }

  take(header, bytes) {
    if (header.encoding === "h264") this.decode(header, bytes);
    else this.last = this.last.then(() => this.drawJpeg(header, bytes)).catch(() => this.shown(header));
  }

  draw(image, header) {
    this.context.drawImage(image, 0, 0, this.canvas.width, this.canvas.height);
    image.close();
    this.shown(header);
  }

  async drawJpeg(header, bytes) {
    this.draw(await createImageBitmap(new Blob([bytes], { type: "image/jpeg" })), header);
  }

  decode(header, bytes) {
    if (header.key || !this.decoder) this.begin();
    if (!header.key && !this.hasKey) return this.fail(header);
    this.hasKey = true;
    this.waiting.set(header.frame, header);
    this.decoder.decode(new EncodedVideoChunk({ type: header.key ? "key" : "delta", timestamp: header.frame, data: bytes }));
  }

  begin() {
    if (this.decoder && this.decoder.state !== "closed") {
      if (this.hasKey) return;
      this.decoder.close();
    }
    this.hasKey = false;
    this.decoder = new VideoDecoder({
      output: (image) => {
        const header = this.waiting.get(image.timestamp);
        this.waiting.delete(image.timestamp);
        this.failures = 0;
        if (header) this.draw(image, header);
        else image.close();
      },
      error: () => {
        this.decoder = null;
        this.hasKey = false;
        for (const header of this.waiting.values()) this.fail(header);
        this.waiting.clear();
      },
    });
    this.decoder.configure({ codec: CODEC, optimizeForLatency: true });
  }

  fail(header) {
    this.failures += 1;
    this.lost(this.failures > FAILURES_MAX);
    this.shown(header); // the gateway waits for this
  }

  // A new connection has a new stream.
  reset() {
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    this.decoder = null;
    this.hasKey = false;
    this.waiting.clear();
  }
}
