"use strict";
{
  const figure = document.getElementById("arm"), svg = figure.querySelector("svg"), said = figure.querySelector("output");
  const data = JSON.parse(figure.dataset.arm), [width, height] = data.size, [before, after] = figure.querySelectorAll("button");
  let [azimuth, elevation] = data.view, moment = 0, chosen = data.chosen ?? 0;
  const title = svg.querySelector("title");
  const place = ([x, y, z]) => {
    x -= data.centre[0]; y -= data.centre[1]; z -= data.centre[2];
    const sa = Math.sin(azimuth), ca = Math.cos(azimuth), se = Math.sin(elevation), ce = Math.cos(elevation);
    return [width / 2 + data.scale * (x * ca + y * sa), height / 2 - data.scale * (z * ce + (y * ca - x * sa) * se)];
  };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  // A point of the zero pose after a joint's travel (Rodrigues).
  const moved = ([axis, on, slides], by, point) => {
    if (slides) return point.map((v, i) => v + by * axis[i]);
    const arm = point.map((v, i) => v - on[i]), side = cross(axis, arm), along = dot(axis, arm), s = Math.sin(by), c = Math.cos(by);
    return arm.map((v, i) => on[i] + v * c + side[i] * s + axis[i] * along * (1 - c));
  };
  const chain = (q) => {
    const links = [[0, 0, 0], ...data.joints.map((joint) => joint[1]), data.tool];
    return links.map((point, k) => {
      for (let j = Math.min(k - 1, q.length) - 1; j >= 0; j--) point = moved(data.joints[j], q[j], point);
      return point;
    });
  };
  const number = (value, digits) => value.toFixed(digits).replace(".", data.decimal);
  const short = (p) => p[0].toFixed(1) + " " + p[1].toFixed(1);
  const element = (name, kind, attributes) => {
    const made = document.createElementNS(svg.namespaceURI, kind);
    made.setAttribute("class", name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    return made;
  };
  const draw = () => {
    const point = data.points[chosen], lines = [], dots = [], parts = [];
    const arm = chain(point[6]).map(place);
    parts.push(element("arm", "path", { d: "M" + arm.map(short).join("L") }));
    parts.push(element("joints", "path", { d: arm.slice(0, -1).map((p) => "M" + short(p) + "h0").join(""), "stroke-width": 11 }));
    for (const row of data.points) {
      const at = row[1], off = row[2 + moment], level = row[4 + moment], seen = short(place(at));
      lines[level] = (lines[level] ?? "") + "M" + seen + "L" + short(place(at.map((v, i) => v - data.magnified * off[i])));
      dots[level] = (dots[level] ?? "") + "M" + seen + "h0";
    }
    lines.forEach((d, level) => parts.push(element("vector e" + level, "path", { d })));
    dots.forEach((d, level) => parts.push(element("dots e" + level, "path", { d, "stroke-width": 4 })));
    const [cx, cy] = place(point[1]);
    parts.push(element("chosen", "circle", { cx, cy, r: 6 }));
    svg.replaceChildren(title, ...parts);
    const size = (v) => number(Math.hypot(...v), 3) + " mm";
    const pose = point[6].map((v, j) => "J" + (j + 1) + " " + (data.joints[j]?.[2] ? number(v, 1) + " mm" : number(v * 180 / Math.PI, 1) + "\u00b0"));
    said.textContent = point[0] + ": " + size(point[2]) + " \u2192 " + size(point[3]) + "; " + pose.join(", ");
    before.setAttribute("aria-pressed", moment === 0);
    after.setAttribute("aria-pressed", moment === 1);
  };
  const choose = (event) => {
    const frame = svg.getBoundingClientRect(), factor = width / frame.width;
    const x = (event.clientX - frame.left) * factor, y = (event.clientY - frame.top) * factor;
    let nearest = Infinity;
    data.points.forEach((row, k) => {
      const [u, v] = place(row[1]), distance = Math.hypot(u - x, v - y);
      if (distance < nearest) { nearest = distance; chosen = k; }
    });
    draw();
  };
  let held = null;
  svg.addEventListener("pointerdown", (event) => { held = { x: event.clientX, y: event.clientY, way: 0 }; });
  addEventListener("pointermove", (event) => {
    if (!held) return;
    const dx = event.clientX - held.x, dy = event.clientY - held.y;
    held = { x: event.clientX, y: event.clientY, way: held.way + Math.abs(dx) + Math.abs(dy) };
    azimuth -= dx / 150;
    elevation = Math.max(-1.5, Math.min(1.5, elevation + dy / 150));
    draw();
  });
  addEventListener("pointerup", (event) => {
    if (held && held.way < 4) choose(event);
    held = null;
  });
  addEventListener("pointercancel", () => { held = null; });
  svg.setAttribute("tabindex", "0");
  svg.addEventListener("keydown", (event) => {
    const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!turn) return;
    event.preventDefault();
    azimuth += turn[0]; elevation = Math.max(-1.5, Math.min(1.5, elevation + turn[1]));
    draw();
  });
  before.addEventListener("click", () => { moment = 0; draw(); });
  after.addEventListener("click", () => { moment = 1; draw(); });
  figure.querySelector(".turn").hidden = false;
  figure.classList.add("turns");
  draw();
}
