// SPDX-License-Identifier: MIT
// A camera that turns about a point: {eye, at, up, fov}. Independent of page and socket.

const add = (a, b, share = 1) => a.map((value, i) => value + b[i] * share);
const subtract = (a, b) => add(a, b, -1);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => a.map((value) => value / (length(a) || 1));
const STEEPEST = 1.55; // radians above the horizon, just below the pole
const NEAREST = 1e-4, FARTHEST = 1e8; // distance in metres from the point that it turns about

// Derives a camera from a frame, whose matrix has the columns right, up, back and eye. The point lies at the depth
// of the scene's middle.
export function cameraOfFrame(frame, scene) {
  const m = frame.camera;
  const eye = [m[3], m[7], m[11]], above = [m[1], m[5], m[9]], into = [-m[2], -m[6], -m[10]];
  const middle = add(scene.lower, scene.upper).map((value) => value / 2);
  const diagonal = length(subtract(scene.upper, scene.lower)) || 1;
  const distance = Math.max(dot(subtract(middle, eye), into), diagonal * 0.05);
  return { eye, at: add(eye, into, distance), up: above[1] > 0.1 && Math.abs(into[1]) < 0.999 ? [0, 1, 0] : above, fov: frame.fov };
}

function axes(camera) {
  const into = unit(subtract(camera.at, camera.eye));
  const right = unit(cross(into, camera.up));
  return { into, right, above: cross(right, into) };
}

// Turns by angles in radians: to the right, and up.
export function orbit(camera, right, above) {
  const up = unit(camera.up), from = subtract(camera.eye, camera.at), distance = length(from);
  const height = Math.asin(Math.max(-1, Math.min(1, dot(from, up) / distance)));
  const level = unit(subtract(from, up.map((value) => value * dot(from, up))));
  const side = cross(up, level);
  const turned = add(level.map((value) => value * Math.cos(right)), side, Math.sin(right));
  const raised = Math.max(-STEEPEST, Math.min(STEEPEST, height + above));
  const offset = add(turned.map((value) => value * Math.cos(raised)), up, Math.sin(raised));
  return { ...camera, eye: add(camera.at, offset, distance) };
}

// Moves by shares of the picture's height.
export function pan(camera, right, above) {
  const axis = axes(camera);
  const height = 2 * Math.tan(camera.fov / 2) * length(subtract(camera.at, camera.eye));
  const by = add(axis.right.map((value) => value * right * height), axis.above, above * height);
  return { ...camera, eye: add(camera.eye, by), at: add(camera.at, by) };
}

// Changes the distance; a factor below 1 moves nearer.
export function zoom(camera, factor) {
  const from = subtract(camera.eye, camera.at);
  const distance = Math.max(NEAREST, Math.min(FARTHEST, length(from) * factor));
  return { ...camera, eye: add(camera.at, unit(from), distance) };
}

// Prints and reads a camera as a part of a link; null: invalid.
const list = (values) => values.map((value) => Number(value.toPrecision(7))).join(",");
export function printCamera(camera) {
  return [list(camera.eye), list(camera.at), list(camera.up), list([camera.fov])].join(";");
}

export function readCamera(text) {
  const parts = (text || "").split(";").map((part) => part.split(",").map(Number));
  if (parts.length !== 4 || parts.map((part) => part.length).join() !== "3,3,3,1" || !parts.flat().every(Number.isFinite)) return null;
  return { eye: parts[0], at: parts[1], up: parts[2], fov: parts[3][0] };
}
