"""The script of the map's page: a plain canvas, which asks nothing of network nor graphics card."""

from __future__ import annotations

SCRIPT = r"""
"use strict";
const raw = JSON.parse(document.getElementById("trees").textContent);
function unpacked(text, Kind) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new Kind(bytes.buffer);
}
const xy = unpacked(raw.xy, Float32Array), count = raw.names.length;
const counts = unpacked(raw.counts, Uint16Array), rings = unpacked(raw.rings, Int16Array);
const figures = raw.figures.map(f => ({...f, values: unpacked(f.values, Float32Array)}));
const texts = raw.texts.map(t => ({...t, codes: unpacked(t.codes, Uint32Array)}));
const first = new Uint32Array(count + 1), reach = new Float32Array(count);
for (let i = 0; i < count; i++) {
  first[i + 1] = first[i] + counts[i];
  let far = 0;
  for (let k = 2 * first[i]; k < 2 * first[i + 1]; k++) far = Math.max(far, Math.abs(rings[k]));
  reach[i] = far * raw.step || 0.5;
}
const canvas = document.getElementById("map"), pen = canvas.getContext("2d");
const layer = document.getElementById("layer"), card = document.getElementById("card");
const find = document.getElementById("find"), at = document.getElementById("at");
const BINS = 24, LEAST = 3;
let cx = 0, cy = 0, scale = 1, chosen = -1, waiting = false, bins = [];

function channel(hex, k) { return parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16); }
const colours = [];
for (let i = 0; i < BINS; i++) {
  const s = i / (BINS - 1) * (raw.ramp.length - 1), low = Math.min(Math.floor(s), raw.ramp.length - 2);
  colours.push("rgb(" + [0, 1, 2].map(k => Math.round(
    channel(raw.ramp[low], k) * (1 - s + low) + channel(raw.ramp[low + 1], k) * (s - low))).join(",") + ")");
}
colours.push(raw.unknown);

function sort() {  // trees by colour, those that are unknown first, so that high ones lie over low ones
  const figure = figures[+layer.value];
  bins = Array.from({length: BINS + 1}, () => []);
  for (let i = 0; i < count; i++) {
    const value = figure.values[i];
    bins[value >= 0 ? Math.min(BINS - 1, Math.floor(value / figure.end * BINS)) : BINS].push(i);
  }
  document.getElementById("end").textContent = `${figure.end} ${figure.unit}`;
  document.getElementById("ramp").style.background = `linear-gradient(to right, ${raw.ramp.join(",")})`;
  document.getElementById("none").hidden = bins[BINS].length === 0;
}
function frame() {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const [width, height] = [box.width, box.height].map(side => Math.max(1, Math.round(side * ratio)));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  return {ratio, s: scale * ratio, w: width, h: height};
}
function fit() {
  const [west, south, east, north] = raw.window, box = canvas.getBoundingClientRect();
  cx = (west + east) / 2; cy = (south + north) / 2;
  scale = 0.94 * Math.min(box.width / Math.max(east - west, 5), box.height / Math.max(north - south, 5));
}
function outline(i, f) {
  const px = f.w / 2 + (xy[2 * i] - cx) * f.s, py = f.h / 2 - (xy[2 * i + 1] - cy) * f.s;
  const step = raw.step * f.s;
  const from = first[i], to = first[i + 1];
  if (to - from < 3) { pen.rect(px + 2 * f.ratio, py - 2 * f.ratio, -4 * f.ratio, 4 * f.ratio); return; }
  pen.moveTo(px + rings[2 * from] * step, py - rings[2 * from + 1] * step);
  for (let k = from + 1; k < to; k++) pen.lineTo(px + rings[2 * k] * step, py - rings[2 * k + 1] * step);
  pen.closePath();
}
function draw() {
  waiting = false;
  const f = frame(), halfW = f.w / 2 / f.s, halfH = f.h / 2 / f.s;
  pen.fillStyle = "#fbfaf7"; pen.fillRect(0, 0, f.w, f.h);
  pen.strokeStyle = "#d8d5cc"; pen.lineWidth = f.ratio;
  for (const [west, south, east, north] of raw.frames)
    pen.strokeRect(f.w / 2 + (west - cx) * f.s, f.h / 2 - (north - cy) * f.s,
                   (east - west) * f.s, (north - south) * f.s);
  const lines = scale > 2.5;
  pen.lineWidth = 0.6 * f.ratio; pen.strokeStyle = "rgba(25,25,25,0.55)";
  for (let b = -1; b < BINS; b++) {
    pen.fillStyle = colours[b < 0 ? BINS : b];
    pen.beginPath();
    for (const i of bins[b < 0 ? BINS : b]) {
      const dx = xy[2 * i] - cx, dy = xy[2 * i + 1] - cy, r = reach[i];
      if (Math.abs(dx) > halfW + r || Math.abs(dy) > halfH + r) continue;
      if (r * f.s < LEAST) {
        // drawn the way round that crowns are, else overlaps are holes
        const side = Math.max(1.6 * f.ratio, 1.7 * r * f.s);
        pen.rect(f.w / 2 + dx * f.s + side / 2, f.h / 2 - dy * f.s - side / 2, -side, side);
      } else outline(i, f);
    }
    pen.fill("nonzero");
    if (lines) pen.stroke();
  }
  if (chosen >= 0) {
    pen.beginPath(); outline(chosen, f);
    pen.strokeStyle = "#fff"; pen.lineWidth = 5 * f.ratio; pen.stroke();
    pen.strokeStyle = "#d6186e"; pen.lineWidth = 2.4 * f.ratio; pen.stroke();
    pen.beginPath();
    const [x, y] = [xy[2 * chosen] - cx, xy[2 * chosen + 1] - cy];
    pen.arc(f.w / 2 + x * f.s, f.h / 2 - y * f.s, 3 * f.ratio, 0, 7);
    pen.fillStyle = "#d6186e"; pen.fill();
  }
  bar(f);
}
function bar(f) {
  const most = f.w * 0.22 / f.s;
  let length = Math.pow(10, Math.floor(Math.log10(most)));
  for (const k of [5, 2]) if (length * k < most) { length *= k; break; }
  const x = 16 * f.ratio, y = f.h - 16 * f.ratio;
  const text = length >= 1000 ? `${+(length / 1000).toPrecision(3)} km` : `${+length.toPrecision(3)} m`;
  for (const [colour, thick] of [["#fff", 6], ["#333", 2.5]]) {
    pen.strokeStyle = colour; pen.lineWidth = thick * f.ratio;
    pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + length * f.s, y); pen.stroke();
  }
  pen.font = `${13 * f.ratio}px sans-serif`; pen.lineWidth = 3 * f.ratio; pen.lineJoin = "round";
  pen.strokeStyle = "#fff"; pen.strokeText(text, x, y - 7 * f.ratio);
  const north = "N \u25b2", beyond = x + length * f.s + 14 * f.ratio;
  pen.strokeText(north, beyond, y);
  pen.fillStyle = "#333"; pen.fillText(text, x, y - 7 * f.ratio); pen.fillText(north, beyond, y);
}
function ask() { if (!waiting) { waiting = true; requestAnimationFrame(draw); } }
function place(event) {
  const box = canvas.getBoundingClientRect();
  return [cx + (event.clientX - box.left - box.width / 2) / scale,
          cy - (event.clientY - box.top - box.height / 2) / scale];
}
function within(i, x, y) {
  let inside = false;
  const u = (x - xy[2 * i]) / raw.step, v = (y - xy[2 * i + 1]) / raw.step;
  for (let k = first[i], j = first[i + 1] - 1; k < first[i + 1]; j = k++) {
    const [ax, ay, bx, by] = [rings[2 * k], rings[2 * k + 1], rings[2 * j], rings[2 * j + 1]];
    if ((ay > v) !== (by > v) && u < (bx - ax) * (v - ay) / (by - ay) + ax) inside = !inside;
  }
  return inside;
}
function pick(x, y) {  // the tree on top, else the nearest within ten pixels
  let near = 10 / scale, best = -1;
  for (let b = BINS; b-- > -1;) {
    for (const i of [...bins[b < 0 ? BINS : b]].reverse()) {
      const dx = x - xy[2 * i], dy = y - xy[2 * i + 1];
      if (Math.abs(dx) <= reach[i] && Math.abs(dy) <= reach[i] && within(i, x, y)) return i;
      if (Math.hypot(dx, dy) < near) { near = Math.hypot(dx, dy); best = i; }
    }
  }
  return best;
}
function spot(x, y) { return `${(raw.middle[0] + x).toFixed(1)}, ${(raw.middle[1] + y).toFixed(1)}`; }
function tell(i) {
  chosen = i;
  card.hidden = i < 0;
  if (i >= 0) {
    document.getElementById("name").textContent = raw.names[i];
    const rows = figures.filter(f => f.values[i] === f.values[i])
      .map(f => [f.label, `${+f.values[i].toPrecision(4)} ${f.unit}`]);
    for (const t of texts) if (t.different[t.codes[i]]) rows.push([t.label, t.different[t.codes[i]]]);
    rows.push(["x, y", spot(xy[2 * i], xy[2 * i + 1])]);
    const body = document.getElementById("facts");
    body.replaceChildren(...rows.map(cells => {
      const row = document.createElement("tr");
      for (const cell of cells) row.appendChild(document.createElement("td")).textContent = cell;
      return row;
    }));
  }
  ask();
}
function zoom(by, event) {
  const before = event ? place(event) : [cx, cy];
  scale = Math.min(400, Math.max(1e-4, scale * by));
  if (event) { const after = place(event); cx += before[0] - after[0]; cy += before[1] - after[1]; }
  ask();
}
let moved = 0, resting = 0;
function hint(x, y) {  // the tree under a pointer that rests
  const i = pick(x, y), told = f => `${f.label} ${+f.values[i].toPrecision(3)} ${f.unit}`;
  const known = i < 0 ? [] : figures.slice(0, 3).filter(f => f.values[i] === f.values[i]).map(told);
  const kind = texts.length ? texts[0].different[texts[0].codes[i]] : "";
  if (kind) known.push(kind);
  canvas.title = i < 0 ? "" : [raw.names[i], ...known].join("\n");
}
canvas.addEventListener("pointerdown", e => { moved = 0; canvas.setPointerCapture(e.pointerId); });
canvas.addEventListener("pointermove", e => {
  const [x, y] = place(e);
  at.textContent = spot(x, y);
  clearTimeout(resting);
  if (!e.buttons) resting = setTimeout(() => hint(x, y), 120);
  if (!e.buttons) return;
  moved += Math.abs(e.movementX) + Math.abs(e.movementY);
  cx -= e.movementX / scale; cy += e.movementY / scale;
  ask();
});
canvas.addEventListener("click", e => { if (moved < 4) tell(pick(...place(e))); });
canvas.addEventListener("wheel", e => { zoom(Math.exp(-e.deltaY * 0.0015), e); e.preventDefault(); },
                        {passive: false});
canvas.addEventListener("dblclick", e => zoom(2, e));
canvas.addEventListener("keydown", e => {
  const step = 60 / scale;
  const moves = {ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step]};
  const move = moves[e.key];
  if (move) { cx += move[0]; cy += move[1]; e.preventDefault(); }
  if (e.key === "+" || e.key === "=") zoom(1.25);
  if (e.key === "-") zoom(0.8);
  if (e.key === "Home") fit();
  if (e.key === "Escape") tell(-1);
  ask();
});
find.addEventListener("keydown", e => {
  if (e.key !== "Enter") return;
  const wanted = find.value.trim(), i = raw.names.indexOf(wanted);
  const found = i >= 0 ? i : raw.names.findIndex(name => wanted && name.includes(wanted));
  find.setCustomValidity(found < 0 ? "No tree on this map has that name." : "");
  find.reportValidity();
  if (found < 0) return;
  cx = xy[2 * found]; cy = xy[2 * found + 1]; scale = Math.max(scale, 8);
  tell(found);
});
find.addEventListener("input", () => find.setCustomValidity(""));
document.getElementById("close").addEventListener("click", () => tell(-1));
layer.addEventListener("change", () => { sort(); ask(); });
window.addEventListener("resize", ask);
sort(); fit(); draw();
document.body.dataset.drawn = "yes";
"""
