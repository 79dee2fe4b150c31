// SPDX-License-Identifier: MIT
// The page: connection, camera controls, menus.
import { cameraOfFrame, orbit, pan, printCamera, readCamera, zoom } from "./camera.js";
import { Editing } from "./edit.js";
import { drawErrors, showFigures } from "./errors.js";
import { Picture, canH264 } from "./picture.js";
import { showStages } from "./stages.js";

const WIDTH_MAX = 3840, HEIGHT_MAX = 2160, SIDE_MIN = 16; // the gateway's limits
const REST_MS = 150; // delay after the last input until the picture is refined
const PAUSE_MS = 250, PAUSE_MAX_MS = 8000; // delay between attempts to connect
const REFUSED = 1008; // close status of the gateway for a request that it refuses
const TURN = Math.PI; // radians for a drag over the picture's height
const NARROW = 0.0015; // factor for a wheel's notch of 100: 14 %
// Samples that the view gets before its tracer is compared, which takes the daemon a while
const COMPARED_SAMPLES = 4;
const FIRST = "the first picture is being rendered";
const WIDE = 1000; // pixels of a window that has space for the controls beside the scene

const $ = (id) => document.getElementById(id);
const canvas = $("picture");
let socket = null, retry = 0, failures = 0, wantsH264 = false;
let scene = null, isNew = true; // the last description, from an earlier connection
let camera = null; // null: the view has the scene's camera, or `node`'s
let node = null; // null: not known yet
let lastFrame = null;
let isDirty = false, movedAt = 0, resting = 0, id = 0;
let isPlaying = false, isClipGone = false, time = 0, tickAt = 0;
let comparison = 0, isCompared = false; // number of the newest comparison; whether it was requested
const inputs = new Map(); // time of the input of a camera, by the camera's number
const link = new URLSearchParams(location.hash.slice(1));

// ---- messages to the gateway ----

function send(message) {
  const isOpen = socket !== null && socket.readyState === WebSocket.OPEN;
  if (isOpen) socket.send(JSON.stringify(message));
  return isOpen;
}

function sendShow() {
  const scale = window.devicePixelRatio || 1;
  const fit = Math.min(1, WIDTH_MAX / (canvas.clientWidth * scale), HEIGHT_MAX / (canvas.clientHeight * scale));
  const side = (css) => Math.max(SIDE_MIN, Math.floor(css * scale * fit));
  const width = side(canvas.clientWidth), height = side(canvas.clientHeight);
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  forgetErrors();
  // A menu is empty before the scene is known; the gateway has defaults for missing names.
  const chosen = (name) => $(name).value || link.get(name) || undefined;
  send({ show: { width, height, h264: wantsH264, tracer: chosen("tracer"), integrator: chosen("integrator"),
    clip: Number(chosen("clip") || 0) } });
}

function sendCamera(moving) {
  const from = camera || (lastFrame && cameraOfFrame(lastFrame, scene));
  if (!from) return;
  forgetErrors();
  id += 1;
  const { eye, at, up, fov } = from;
  const isSent = send({ camera: { id, eye, at, up, fov, time, moving, node: camera ? 0 : node || 0 } });
  if (isSent && movedAt) inputs.set(id, movedAt);
}

// ---- messages from the gateway ----

function drawStages() {
  $("timeline").hidden = !$("stages").checked;
  if ($("stages").checked && lastFrame) showStages(document.querySelector("#timeline tbody"), lastFrame.stages);
}

// Screen readers read the text aloud, so it must not change with each frame.
function say(text, isLost = false) {
  if ($("status").textContent !== text) $("status").textContent = text;
  $("status").classList.toggle("lost", isLost);
}

function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, String(value) === String(chosen))));
}

// Updates the page at the beginning of a connection and after changes of the scene; choices stay if they still
// exist.
function takeScene(message) {
  const clip = $("clip").value || link.get("clip") || "0";
  scene = message;
  document.title = `${message.name} - farlight`;
  $("name").textContent = message.name;
  $("right").hidden = !message.edit;
  canvas.setAttribute("aria-label", `Picture of ${message.name}`);
  if (isNew) {
    editing.begin(message.edit);
    say(isClipGone ? "the clip was removed: choose another one, if any" : lastFrame ? "" : FIRST);
  }
  isNew = isClipGone = false;
  editing.list();
  const cameras = message.cameras.map((one) => [one.node, one.name || `camera ${one.node}`]);
  if (message.node === 0) cameras.unshift([0, "start"]); // no camera of the scene
  if (!cameras.some(([value]) => value === node)) node = message.node;
  fill($("camera"), [...cameras, ["", "free"]], camera ? "" : node);
  fill($("clip"), [[0, "none"], ...message.clips.map((one) => [one.clip, one.name || `clip ${one.clip}`])], clip);
  $("clips").hidden = message.clips.length === 0;
  fill($("tracer"), message.tracers.map((name) => [name, name]), $("tracer").value || message.tracer);
  fill($("integrator"), message.integrators.map((name) => [name, name]), $("integrator").value || message.integrator);
}

const editing = new Editing(send);

// ---- errors of the tracer ----

function forgetErrors() {
  comparison += 1;
  isCompared = false;
  $("errors").hidden = $("errors-table").hidden = true;
  $("errors-picture").textContent = "";
  delete canvas.dataset.compared;
  const isReference = $("tracer").value === "reference";
  sayOfErrors(isReference ? "This is the reference itself: choose another tracer" : "Waits until the view is at rest");
}

function sayOfErrors(text) {
  if ($("errors-state").textContent !== text) $("errors-state").textContent = text;
}

function askForErrors() {
  $("errors-figures").hidden = !$("compare").checked;
  if (!$("compare").checked || isCompared || isPlaying || isDirty || $("tracer").value === "reference") return;
  if (!lastFrame || lastFrame.moving || lastFrame.samples < COMPARED_SAMPLES) return;
  isCompared = true;
  sayOfErrors("Tracing the reference ..");
  send({ compare: comparison });
}

function takeErrors(errors, bytes) {
  send({ shown: 1 });
  if (errors.compare !== comparison || !$("compare").checked) return;
  drawErrors($("errors"), errors, bytes);
  showFigures($("errors-table"), $("errors-picture"), errors, bytes);
  $("errors").hidden = $("errors-table").hidden = false;
  canvas.dataset.compared = errors.tracer;
  sayOfErrors(`${((1 - errors.all.agree) * 100).toPrecision(2)} % of the rays differ`);
}

const picture = new Picture(canvas, (header) => {
  send({ shown: 1 });
  if (lastFrame && lastFrame.revision !== header.revision) forgetErrors();
  lastFrame = header;
  editing.seen(header.revision);
  drawStages();
  let input = 0; // the newest input that the frame shows
  for (const seen of [...inputs.keys()].filter((key) => key <= header.id)) {
    input = inputs.get(seen);
    inputs.delete(seen);
  }
  if (input) canvas.dataset.latency = (performance.now() - input).toFixed(1);
  const { frame, samples, encoding, moving, tracer, integrator, revision, id: look } = header;
  Object.assign(canvas.dataset, { frame, samples, encoding, moving, tracer, integrator, revision, look });
  const latency = canvas.dataset.latency ? `, input to picture ${Number(canvas.dataset.latency).toFixed(0)} ms` : "";
  $("figures").textContent = `${header.width} x ${header.height}, ${tracer}, ${integrator}, ${samples} sample${samples === 1 ? "" : "s"}, `
    + `${encoding}${latency}`;
  if ($("status").classList.contains("lost") || $("status").textContent === FIRST) say("");
  askForErrors();
}, (isGone) => {
  if (isGone) {
    wantsH264 = false;
    sendShow();
  } else {
    send({ key: true });
  }
});

function take(event) {
  if (typeof event.data === "string") {
    const message = JSON.parse(event.data);
    if (message.scene) takeScene(message.scene);
    if (message.objects || message.object || message.edited || (message.refused && message.refused.edit)) editing.take(message);
    if (message.refused && message.refused.compare === comparison) sayOfErrors(message.refused.text);
    if (message.error) {
      say(message.error.text, true);
      forgetLink();
      if (message.error.clip) forgetClip();
    }
    return;
  }
  failures = 0;
  const headBytes = new DataView(event.data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(event.data, 4, headBytes)));
  const bytes = new Uint8Array(event.data, 4 + headBytes);
  if (header.errors) takeErrors(header.errors, bytes);
  else picture.take(header, bytes);
}

// ---- connecting, and connecting again ----

// The link's names may not exist in the scene, and they apply to the first view only.
function forgetLink() {
  for (const name of ["tracer", "integrator", "clip"]) link.delete(name);
}

// Removes the clip, so that the next connection requests none, and says so.
function forgetClip() {
  $("clip").value = "0";
  isClipGone = true;
  if (isPlaying) $("play").click();
}

function forgetConnection() {
  isNew = true;
  picture.reset();
  inputs.clear();
  forgetErrors();
}

function connect() {
  clearTimeout(retry);
  socket = new WebSocket(new URL("view", location.href.split("#")[0].replace(/^http/, "ws")), "farlight");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    sendShow();
    if (camera) sendCamera(false);
  };
  socket.onmessage = take;
  socket.onclose = (event) => {
    const pause = Math.min(PAUSE_MAX_MS, PAUSE_MS * 2 ** failures) * (0.75 + Math.random() / 2);
    failures += 1;
    if (event.code === REFUSED) forgetLink();
    forgetConnection();
    say(`the connection is lost${event.reason ? ` (${event.reason})` : ""}; trying again`, true);
    retry = setTimeout(connect, pause);
  };
}

// ---- input ----

function free() {
  if (!camera && lastFrame && scene) camera = cameraOfFrame(lastFrame, scene);
  $("camera").value = "";
  return camera !== null;
}

function move(change) {
  if (!free()) return;
  camera = change(camera);
  movedAt = performance.now();
  isDirty = true;
}

const pointers = new Map();

function spread() {
  const [a, b] = [...pointers.values()];
  return { distance: Math.hypot(a.x - b.x, a.y - b.y), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
}

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button !== 0 || event.shiftKey });
});
canvas.addEventListener("pointermove", (event) => {
  const pointer = pointers.get(event.pointerId);
  if (!pointer || pointers.size > 2) return;
  const before = pointers.size === 2 ? spread() : null;
  const right = (event.clientX - pointer.x) / canvas.clientHeight, down = (event.clientY - pointer.y) / canvas.clientHeight;
  Object.assign(pointer, { x: event.clientX, y: event.clientY });
  if (before) {
    const after = spread();
    const height = canvas.clientHeight, factor = before.distance / Math.max(1, after.distance);
    move((one) => zoom(pan(one, (before.x - after.x) / height, (after.y - before.y) / height), factor));
  } else if (pointer.pans) {
    move((one) => pan(one, -right, down));
  } else {
    move((one) => orbit(one, -right * TURN, down * TURN));
  }
});
for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  move((one) => zoom(one, Math.exp(event.deltaY * NARROW)));
}, { passive: false });
canvas.addEventListener("keydown", (event) => {
  const steps = { ArrowLeft: [-0.05, 0], ArrowRight: [0.05, 0], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05] };
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (steps[event.key]) move((one) => (event.shiftKey ? pan : orbit)(one, ...steps[event.key]));
  else if (event.key === "Home") goTo(String(scene ? scene.node : 0));
  else if (event.key === "+" || event.key === "-") move((one) => zoom(one, event.key === "+" ? 0.9 : 1 / 0.9));
  else return;
  event.preventDefault();
});

$("menu").addEventListener("submit", (event) => event.preventDefault());
function goTo(value) {
  $("camera").value = value;
  if (value === "") return;
  camera = null;
  node = Number(value);
  if (node !== 0) {
    sendCamera(false);
    return;
  }
  // A new view without a camera shows the whole scene.
  socket.onclose = null;
  socket.close();
  forgetConnection();
  connect();
}
$("camera").addEventListener("change", () => goTo($("camera").value));
for (const name of ["tracer", "integrator", "clip"]) $(name).addEventListener("change", sendShow);
$("play").addEventListener("click", () => {
  isPlaying = !isPlaying;
  if (isPlaying && $("clip").value === "0") {
    $("clip").selectedIndex = 1;
    sendShow();
  }
  $("play").textContent = isPlaying ? "Pause" : "Play";
  movedAt = 0;
  isDirty = true;
});
$("stages").addEventListener("change", drawStages);
$("compare").addEventListener("change", () => {
  forgetErrors();
  askForErrors();
});
function openPanel(isOpen) {
  $("panel").hidden = !isOpen;
  $("open").setAttribute("aria-expanded", String(isOpen));
}
$("open").addEventListener("click", () => openPanel($("panel").hidden));
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || $("panel").hidden) return;
  openPanel(false);
  $("open").focus();
});
openPanel(window.innerWidth >= WIDE);
$("share").addEventListener("click", async () => {
  const from = camera || (lastFrame && cameraOfFrame(lastFrame, scene));
  if (!from) return;
  const parts = new URLSearchParams({ view: printCamera(from), time: time.toFixed(3) });
  for (const name of ["tracer", "integrator", "clip"]) parts.set(name, $(name).value);
  history.replaceState(null, "", `#${parts}`);
  try {
    await navigator.clipboard.writeText(location.href);
    say(`the link is copied; who has it can ${scene.edit ? "look and edit" : "look"}`);
  } catch {
    say(`the link is in the address line; who has it can ${scene.edit ? "look and edit" : "look"}`);
  }
});
new ResizeObserver(sendShow).observe(canvas);

// ---- animation ----

function tick(now) {
  if (isPlaying) {
    time += Math.min(0.25, (now - tickAt) / 1000);
    isDirty = true;
  }
  tickAt = now;
  if (isDirty) {
    isDirty = false;
    sendCamera(true);
    clearTimeout(resting);
    resting = setTimeout(settle, REST_MS); // a hidden page is not animated, but settles all the same
  }
  requestAnimationFrame(tick);
}

function settle() {
  movedAt = 0;
  sendCamera(false);
}

camera = readCamera(link.get("view"));
time = Number(link.get("time")) || 0;
wantsH264 = await canH264();
connect();
requestAnimationFrame(tick);
