// SPDX-License-Identifier: MIT
// The errors of a tracer against the reference: their picture, and their figures. No socket.

// Entries of the map "inferno" (van der Walt, Smith. 2015), evenly spaced, as the viewer's error map has them.
const PLACES = [[0, 0, 4], [31, 12, 72], [85, 15, 109], [136, 34, 106], [186, 54, 85], [227, 89, 51], [249, 140, 10], [249, 201, 50],
  [252, 255, 164]];
const TOP = 0.25; // this share of white is the brightest colour
const BEYOND = 0.01;

function colour(error) {
  const at = Math.min(1, Math.sqrt(error / 255 / TOP)) * (PLACES.length - 1);
  const low = Math.min(Math.floor(at), PLACES.length - 2);
  return PLACES[low].map((value, i) => Math.round(value + (PLACES[low + 1][i] - value) * (at - low)));
}

export function drawErrors(canvas, header, bytes) {
  const colours = Array.from({ length: 256 }, (_, error) => [...colour(error), 255]);
  const image = new ImageData(header.width, header.height);
  for (let i = 0; i < bytes.length; i += 1) image.data.set(colours[bytes[i]], i * 4);
  canvas.width = header.width;
  canvas.height = header.height;
  canvas.getContext("2d").putImageData(image, 0, 0);
}

const percent = (share) => (share === 0 ? "0 %" : `${share < 1e-4 ? (share * 100).toExponential(0) : (share * 100).toPrecision(2)} %`);
const count = (number) => (number >= 1e6 ? `${(number / 1e6).toPrecision(3)} M` : number >= 1e4 ? `${Math.round(number / 1e3)} k` : String(number));
const small = (number) => (number === 0 ? "0" : number < 0.01 ? number.toExponential(0) : Number(number.toPrecision(2)).toString());

function row(name, wave, isAll) {
  const line = document.createElement("tr");
  if (isAll) line.className = "all";
  const first = document.createElement("th");
  first.scope = "row";
  first.textContent = name;
  const normals = wave.normal_p99 === undefined ? "" : `${small(wave.normal_p99)}°`;
  const cells = [count(wave.rays), percent(1 - wave.agree), wave.kind === "shadow" ? "" : count(wave.far), normals].map((text) => {
    const cell = document.createElement("td");
    cell.textContent = text;
    return cell;
  });
  line.replaceChildren(first, ...cells);
  return line;
}

export function showFigures(table, line, errors, bytes) {
  table.caption.textContent = `${errors.tracer} against ${errors.reference}, ${errors.samples} samples a pixel; far: beyond `
    + `${Number(errors.far_share.toPrecision(2))} of the scene's diagonal; normals: 99 % differ by less`;
  table.tBodies[0].replaceChildren(row("all", errors.all, true), ...errors.waves.map((wave) => row(`${wave.wave} ${wave.kind}`, wave, false)));
  let sum = 0, largest = 0, beyond = 0;
  for (const error of bytes) {
    sum += error;
    largest = Math.max(largest, error);
    beyond += error / 255 > BEYOND ? 1 : 0;
  }
  line.textContent = `Picture: mean ${small(sum / 255 / bytes.length)}, maximum ${small(largest / 255)} of white; `
    + `${percent(beyond / bytes.length)} of the pixels beyond ${BEYOND}`;
}
