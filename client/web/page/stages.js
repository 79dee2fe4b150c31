// SPDX-License-Identifier: MIT
// A table of a frame's stages, with bars for when and how long each ran.

const COLOURS = { primary: "#4f8fd0", trace: "#d08a3c", shade: "#62a85b", resolve: "#9a72c4", encode: "#c4556b", build: "#b8a13c" };
const SVG = "http://www.w3.org/2000/svg";

function bar(name, start, duration, end) {
  const rectangle = document.createElementNS(SVG, "rect");
  const share = (value) => `${Math.min(100, (value / end) * 100).toFixed(2)}%`;
  for (const [key, value] of [["x", share(start)], ["width", share(Math.max(duration, end / 200))], ["height", "100%"],
    ["fill", COLOURS[name] || "#8a8f98"]]) rectangle.setAttribute(key, value);
  return rectangle;
}

export function showStages(body, stages) {
  const rows = new Map();
  for (const [name, clock, start, duration] of stages) {
    const key = clock === "gpu" ? name : `${name}, ${clock}`;
    rows.set(key, [...(rows.get(key) || []), [name, start, duration]]);
  }
  const end = Math.max(1e-3, ...stages.map((stage) => stage[2] + stage[3]));
  body.replaceChildren(...[...rows].map(([key, spans]) => {
    const line = document.createElement("tr"), name = document.createElement("th");
    name.scope = "row";
    name.textContent = key;
    const chart = document.createElement("td"), picture = document.createElementNS(SVG, "svg"), total = document.createElement("td");
    picture.setAttribute("aria-hidden", "true");
    picture.replaceChildren(...spans.map(([stage, start, duration]) => bar(stage, start, duration, end)));
    chart.append(picture);
    total.textContent = spans.reduce((sum, span) => sum + span[2], 0).toFixed(1);
    line.replaceChildren(name, chart, total);
    return line;
  }));
}
