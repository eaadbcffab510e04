"""The tree on the page: a plain canvas that can be turned, with the colours of the deviations.

Tapered segments are drawn from back to front by a small script that stands in the page itself; it asks
nothing of the network nor of the graphics card.
"""

from __future__ import annotations

RAMP = ("#2a788e", "#7fa98c", "#e8b33c", "#d9662b", "#b5172d")
"""From no deviation to the end of the scale; told apart with any colour vision."""

BEYOND, UNKNOWN = "#c413c4", "#b4b4b4"
"""Beyond the scale, and where nothing is known."""

SCRIPT = r"""
"use strict";
const raw = JSON.parse(document.getElementById("tree").textContent);
function floats(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}
const wood = floats(raw.wood), other = raw.reference ? floats(raw.reference) : new Float32Array(0);
const points = raw.points ? floats(raw.points) : new Float32Array(0);
const layers = raw.layers.map(l => ({name: l.name, most: l.most, value: floats(l.value)}));
const canvas = document.getElementById("view"), pen = canvas.getContext("2d");
const pick = document.getElementById("layer"), most = document.getElementById("most");
const showOther = document.getElementById("other"), showPoints = document.getElementById("points");
const tip = document.getElementById("tip");
let yaw = 0.6, pitch = 0.12, zoom = 1, panX = 0, panY = 0, waiting = false;

const steps = 48, ramp = [];
function channel(hex, k) { return parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16); }
for (let i = 0; i < steps; i++) {
  const at = i / (steps - 1) * (raw.ramp.length - 1), low = Math.min(Math.floor(at), raw.ramp.length - 2);
  ramp.push([0, 1, 2].map(k => Math.round(
    channel(raw.ramp[low], k) * (1 - at + low) + channel(raw.ramp[low + 1], k) * (at - low))));
}
function css(c, light) { return `rgb(${c.map(v => Math.min(255, Math.round(v * light))).join(",")})`; }
const rgb = hex => [0, 1, 2].map(k => channel(hex, k));
const kinds = [...ramp, rgb(raw.beyond), rgb(raw.unknown), rgb("#c9ccd1")];
const [BEYOND, UNKNOWN, OTHER] = [steps, steps + 1, steps + 2];
const body = kinds.map(c => css(c, 0.78)), gleam = kinds.map(c => css(c, 1.12));

function colourOf(value, end) {
  if (!(value >= 0)) return UNKNOWN;
  if (value > end) return BEYOND;
  return Math.round(value / end * (steps - 1));
}
function frame() {
  const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(box.width * ratio)) {
    canvas.width = Math.round(box.width * ratio); canvas.height = Math.round(box.height * ratio);
  }
  const scale = Math.min(canvas.width, canvas.height) * 0.92 / raw.size * zoom;
  return {scale, ratio, cx: canvas.width / 2 + panX * ratio, cy: canvas.height / 2 + panY * ratio,
          ca: Math.cos(yaw), sa: Math.sin(yaw), cp: Math.cos(pitch), sp: Math.sin(pitch)};
}
function project(f, x, y, z, out) {
  const u = x * f.ca - y * f.sa, v = x * f.sa + y * f.ca;
  out[0] = f.cx + f.scale * u; out[1] = f.cy - f.scale * (z * f.cp + v * f.sp);
  out[2] = v * f.cp - z * f.sp;   // away from the eye
}
function gather(list, from, f, colour) {
  const p = [0, 0, 0], q = [0, 0, 0];
  for (let i = 0, k = 0; k < from.length; i++, k += 8) {
    project(f, from[k], from[k + 1], from[k + 2], p); project(f, from[k + 3], from[k + 4], from[k + 5], q);
    const thin = 0.55 * f.ratio;
    list.push([p[2] + q[2], p[0], p[1], q[0], q[1], Math.max(thin, from[k + 6] * f.scale),
               Math.max(thin, from[k + 7] * f.scale), colour(i)]);
  }
}
function draw() {
  waiting = false;
  const f = frame(), layer = layers[+pick.value], end = +most.value || 1, list = [];
  pen.fillStyle = "#fbfaf7"; pen.fillRect(0, 0, canvas.width, canvas.height);
  if (showOther && showOther.checked) gather(list, other, f, () => OTHER);
  gather(list, wood, f, i => layer ? colourOf(layer.value[i], end) : UNKNOWN);
  list.sort((a, b) => b[0] - a[0]);
  pen.lineCap = "round";
  for (const s of list) {
    const thick = s[5] + s[6];
    if (thick > 5 * f.ratio) piece(s, 1, body[s[7]]);
    if (thick > 5 * f.ratio) piece(s, 0.62, kinds_css[s[7]]);
    if (thick > 12 * f.ratio) piece(s, 0.22, gleam[s[7]]);
    if (thick <= 5 * f.ratio) line(s, thick, kinds_css[s[7]]);
  }
  if (showPoints && showPoints.checked) dots(f, end);
  bar(f);
}
const kinds_css = kinds.map(c => css(c, 1));
function line(s, width, colour) {
  pen.strokeStyle = colour; pen.lineWidth = width; pen.beginPath();
  pen.moveTo(s[1], s[2]); pen.lineTo(s[3], s[4]); pen.stroke();
}
function piece(s, share, colour) {
  const dx = s[3] - s[1], dy = s[4] - s[2], d = Math.hypot(dx, dy) || 1, nx = -dy / d, ny = dx / d;
  const a = s[5] * share, b = s[6] * share;
  pen.fillStyle = colour; pen.beginPath();
  pen.moveTo(s[1] + nx * a, s[2] + ny * a); pen.lineTo(s[3] + nx * b, s[4] + ny * b);
  pen.arc(s[3], s[4], b, Math.atan2(ny, nx), Math.atan2(-ny, -nx), true);
  pen.lineTo(s[1] - nx * a, s[2] - ny * a);
  pen.arc(s[1], s[2], a, Math.atan2(-ny, -nx), Math.atan2(ny, nx), true);
  pen.fill();
}
function dots(f, end) {
  const p = [0, 0, 0], size = Math.max(1, 1.3 * f.ratio);
  for (let k = 0; k < points.length; k += 4) {
    project(f, points[k], points[k + 1], points[k + 2], p);
    pen.fillStyle = kinds_css[colourOf(points[k + 3], end)];
    pen.fillRect(p[0], p[1], size, size);
  }
}
function bar(f) {
  let length = Math.pow(10, Math.floor(Math.log10(canvas.width * 0.3 / f.scale)));
  for (const k of [5, 2]) if (length * k * f.scale < canvas.width * 0.3) { length *= k; break; }
  const y = canvas.height - 16 * f.ratio, x = 16 * f.ratio;
  pen.strokeStyle = pen.fillStyle = "#333"; pen.lineWidth = 2 * f.ratio; pen.lineCap = "butt";
  pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + length * f.scale, y); pen.stroke();
  pen.font = `${12 * f.ratio}px sans-serif`; pen.fillText(`${+length.toPrecision(2)} m`, x, y - 6 * f.ratio);
}
function ask() { if (!waiting) { waiting = true; requestAnimationFrame(draw); } }
function legend() {
  document.getElementById("end").textContent = `${+(+most.value).toPrecision(3)} mm`;
  document.getElementById("ramp").style.background = `linear-gradient(to right, ${raw.ramp.join(",")})`;
}
function choose() {
  const layer = layers[+pick.value];
  if (layer) { most.max = layer.most * 4; most.step = layer.most / 100; most.value = layer.most; }
  legend(); ask();
}
function nearest(event) {
  const f = frame(), box = canvas.getBoundingClientRect(), p = [0, 0, 0], q = [0, 0, 0];
  const x = (event.clientX - box.left) * f.ratio, y = (event.clientY - box.top) * f.ratio;
  let best = 10 * f.ratio, at = -1;
  for (let i = 0, k = 0; k < wood.length; i++, k += 8) {
    project(f, wood[k], wood[k + 1], wood[k + 2], p); project(f, wood[k + 3], wood[k + 4], wood[k + 5], q);
    const dx = q[0] - p[0], dy = q[1] - p[1], s = dx * dx + dy * dy || 1;
    const t = Math.min(1, Math.max(0, ((x - p[0]) * dx + (y - p[1]) * dy) / s));
    const off = Math.hypot(x - p[0] - t * dx, y - p[1] - t * dy);
    if (off < best) { best = off; at = i; }
  }
  const layer = layers[+pick.value];
  if (at < 0 || !layer) { tip.hidden = true; return; }
  const value = layer.value[at];
  tip.textContent = (value >= 0 ? `${+value.toPrecision(3)} mm` : "no points") +
    `, radius ${(500 * (wood[8 * at + 6] + wood[8 * at + 7])).toFixed(1)} mm`;
  tip.style.left = `${event.clientX - box.left + 12}px`; tip.style.top = `${event.clientY - box.top + 12}px`;
  tip.hidden = false;
}
canvas.addEventListener("pointerdown", e => canvas.setPointerCapture(e.pointerId));
canvas.addEventListener("pointermove", e => {
  if (!e.buttons) { nearest(e); return; }
  tip.hidden = true;
  if (e.shiftKey || e.buttons > 1) { panX += e.movementX; panY += e.movementY; }
  else { yaw -= e.movementX * 0.008; pitch = Math.min(1.57, Math.max(-1.57, pitch + e.movementY * 0.008)); }
  ask();
});
canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
canvas.addEventListener("contextmenu", e => e.preventDefault());
canvas.addEventListener("wheel", e => {
  zoom *= Math.exp(-e.deltaY * 0.0012); e.preventDefault(); ask();
}, {passive: false});
canvas.addEventListener("dblclick", () => { yaw = 0.6; pitch = 0.12; zoom = 1; panX = panY = 0; ask(); });
canvas.addEventListener("keydown", e => {
  const turn = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[e.key];
  if (turn) { yaw += turn[0]; pitch += turn[1]; e.preventDefault(); }
  if (e.key === "+") zoom *= 1.2;
  if (e.key === "-") zoom /= 1.2;
  ask();
});
pick.addEventListener("change", choose);
most.addEventListener("input", () => { legend(); ask(); });
for (const box of [showOther, showPoints]) if (box) box.addEventListener("change", ask);
window.addEventListener("resize", ask);
choose(); draw();
document.body.dataset.drawn = "yes";
"""
