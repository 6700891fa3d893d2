// What lies over the picture: the outline of the cell that was chosen, and the legend.

const SVG = "http://www.w3.org/2000/svg";
const drawn = (name, attributes, parent) => {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
};

/** Lines along the edges of a cell, and a ring where it is too small to be seen. */
const outline = (over, cells, camera, cell, t) => {
  over.replaceChildren();
  over.setAttribute("viewBox", `0 0 ${camera.width} ${camera.height}`);
  if (cell < 0) return;
  const corners = cells.placesOf(cell, t).map((place) => camera.project(place));
  const path = cells.groupOf(cell).edges.map(([a, b]) => `M${corners[a].map(fixed)}L${corners[b].map(fixed)}`).join("");
  for (const kind of ["halo", "line"]) drawn("path", { d: path, class: kind }, over);
  const middle = [0, 1].map((k) => corners.reduce((sum, corner) => sum + corner[k], 0) / corners.length);
  const reach = Math.max(...corners.map(([x, y]) => Math.hypot(x - middle[0], y - middle[1])));
  if (reach < 14) for (const kind of ["halo", "line"]) drawn("circle", { cx: fixed(middle[0]), cy: fixed(middle[1]), r: 18, class: kind }, over);
};

const fixed = (value) => Math.max(-1e5, Math.min(1e5, value)).toFixed(2);

/** A scale of colours with its ends, and what else colours mean. */
const legend = (element, stops, ends, title, others) => {
  element.replaceChildren();
  const name = document.createElement("span");
  name.textContent = title;
  const scale = drawn("svg", { viewBox: "0 0 120 10", class: "scale", role: "presentation" }, element);
  const gradient = drawn("linearGradient", { id: "ramp" }, drawn("defs", {}, scale));
  stops.forEach((colour, k) => drawn("stop", { offset: k / (stops.length - 1), "stop-color": colour }, gradient));
  drawn("rect", { width: 120, height: 10, rx: 2, fill: "url(#ramp)" }, scale);
  const [low, high] = ends.map((text) => {
    const end = document.createElement("span");
    end.textContent = text;
    return end;
  });
  element.replaceChildren(name, low, scale, high);
  for (const [colour, text] of others) {
    const box = drawn("svg", { viewBox: "0 0 10 10", class: "swatch" }, element);
    drawn("rect", { width: 10, height: 10, rx: 2, fill: colour }, box);
    const said = document.createElement("span");
    said.textContent = text;
    element.append(said);
  }
  element.hidden = false;
};
