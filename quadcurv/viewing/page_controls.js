// What is seen, and how: the field on its scale, the camera, the controls and the page's address.
const start = {
  field: data.field, towards: data.towards, up: data.up, size: data.size,
  edges: count < 20000, overlays: false, histogram: false, shading: data.shading,
};
const switches = ["edges", "overlays", "histogram", "shading"];
const ranges = new Map();                   // ends of scales that were asked for, by field
let field, limits, colours, size = null, picked = -1, asked = 0;
let chosen = new Set(data.schemes);

function text(x, digits = 5) {              // a number as a reader wants it
  const [mantissa, power] = x.toExponential(digits - 1).split("e").map(Number);
  const short = power < -4 || power >= digits ? `${mantissa}e${power}` : String(Number(x.toPrecision(digits)));
  return short.replaceAll("-", "\u2212");
}

const arrayOf = view => arrays[field.values[view]];
const valueText = v => isUndefined(v) ? "undefined" : field.kinds.length ? field.kinds[Math.round(v)] :
  (Math.abs(v) > 0.999 * data.most ? "beyond " : "") + text((field.logarithmic ? Math.abs(v) : v) * field.unit);

function place(v) {                         // on the scale: exact zeros lie one below it
  if (isUndefined(v) || !field.logarithmic) return v;
  return v === 0 ? limits[0] - 1 : Math.max(Math.log10(Math.abs(v)) + Math.log10(field.unit), limits[0]);
}

function ticks(values) {                    // places on the scale and their labels
  if (field.kinds.length) return field.kinds.map((kind, i) => [i, kind]);
  const [low, high] = limits, step = Math.ceil((high - low) / 8), places = [low];
  if (field.logarithmic) {
    for (let p = Math.ceil(low); p < Math.ceil(high); p += step)
      if (low + 0.4 < p && p < high - 0.4 * step) places.push(p);
    places.push(high);
  } else for (let k = 1; k < 5; k++) places.push(low + k / 4 * (high - low));
  const label = p => field.logarithmic ? decade(p) : text(p * field.unit, 3);
  const labels = places.map(label), beyond = test => values.some(array => array.some(v => !isUndefined(v) && test(v)));
  const size = v => field.logarithmic ? Math.log10(Math.abs(v)) + Math.log10(field.unit) : v;
  if (beyond(v => !(field.logarithmic && v === 0) && size(v) < low - 1e-6 * (high - low))) labels[0] = "\u2264 " + labels[0];
  if (beyond(v => size(v) > high + 1e-6 * (high - low))) labels.push("\u2265 " + labels.pop());
  return places.map((p, i) => [p, labels[i]]);
}

function decade(p) {
  const [mantissa, power] = (10 ** (p - Math.floor(p))).toExponential(1).split("e").map(Number);
  return `${mantissa}e${power + Math.floor(p)}`;
}

function setViews() {                       // one a scheme, or one under the field's own name
  const all = Object.keys(field.values), some = all.filter(view => chosen.has(view) || !data.schemes.includes(view));
  const wanted = some.length ? some : all;
  if (wanted.join("\n") === [...views.children].map(v => v.dataset.name).join("\n")) return;
  for (const view of views.children) gl.deleteBuffer(view.colours);
  views.replaceChildren(...wanted.map(name => {
    const view = document.createElement("div"), bars = document.createElement("div");
    view.dataset.name = name;
    view.colours = gl.createBuffer();
    bars.className = "bars";
    view.append(document.createElement("span"), bars);
    return view;
  }));
  arrange();
}

function arrange() {                        // views as large as the window lets them be
  const n = views.children.length, frame = views.getBoundingClientRect();
  const side = r => Math.min(frame.height / r, frame.width / Math.ceil(n / r));
  const rows = Array.from({ length: n }, (_, i) => i + 1).reduce((a, b) => side(b) > side(a) ? b : a);
  views.style.grid = `repeat(${rows}, 1fr) / repeat(${Math.ceil(n / rows)}, 1fr)`;
  const longest = Math.max(...[...views.children].map(v => v.dataset.name.length));
  const letters = frame.width / Math.ceil(n / rows) / (0.66 * Math.max(longest, 1));
  views.style.fontSize = Math.min(Math.max(letters, 9), 15) + "px";
  spreadTicks();
}

function show(name) {
  field = data.fields.find(f => f.name === name);
  limits = ranges.get(name) || field.limits;
  colours = decode(field.colours, Uint8Array);
  element("field").value = name;
  setViews();
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, colours.length / 4, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colours);
  gl.uniform2fv(at("limits"), limits);
  gl.uniform1i(at("showsZero"), field.logarithmic);
  for (const view of views.children) {
    const places = arrayOf(view.dataset.name).map(place);
    gl.bindBuffer(gl.ARRAY_BUFFER, view.colours);
    gl.bufferData(gl.ARRAY_BUFFER, data.on_cells ? Float32Array.from(source, (_, i) => places[i >> 2]) : places, gl.STATIC_DRAW);
  }
  const ofScale = end => (field.logarithmic ? 10 ** end : end * field.unit).toPrecision(4);
  for (const [id, end] of [["low", limits[0]], ["high", limits[1]]]) {
    element(id).value = String(Number(ofScale(end)));
    element(id).disabled = field.kinds.length > 0;
  }
  showLegend();
  showHistograms();
  report();
  drawSoon();
  remember();
}

function colourAt(part) {                   // of the scale
  const k = 4 * Math.min(Math.floor(part * colours.length / 4), colours.length / 4 - 1);
  return `rgb(${colours[k]},${colours[k + 1]},${colours[k + 2]})`;
}

function showLegend() {
  const values = Object.values(field.values).map(k => arrays[k]);
  element("name").textContent = field.title;
  const stops = field.kinds.length
    ? field.kinds.flatMap((_, i, all) => [0, 1].map(k => `${colourAt((i + 0.5) / all.length)} ${100 * (i + k) / all.length}%`))
    : Array.from({ length: 33 }, (_, i) => colourAt(i / 32));
  element("gradient").style.background = `linear-gradient(90deg,${stops})`;
  element("ticks").replaceChildren(...ticks(values).map(([place, label]) => {
    const tick = document.createElement("span");
    tick.textContent = label;
    tick.style.left = 100 * (place - limits[0]) / (limits[1] - limits[0]) + "%";
    return tick;
  }));
  document.querySelectorAll(".patch").forEach(p => p.parentNode.remove());
  const patches = element("overlays").checked ? overlays.map(o => [o.name, o.colour]) : [];
  if (values.some(a => a.some(isUndefined))) patches.unshift(["undefined", data.undefined_colour]);
  if (field.logarithmic && values.some(a => a.includes(0))) patches.unshift(["exactly 0", data.zero_colour]);
  for (const [label, colour] of patches) {
    const [outer, space, patch, below] = Array.from({ length: 4 }, () => document.createElement("div"));
    space.className = "space";
    space.textContent = "\u00a0";
    patch.className = "patch";
    patch.style.background = colour;
    below.className = "below";
    below.textContent = label;
    outer.append(space, patch, below);
    element("legend").append(outer);
  }
  spreadTicks();
}

function spreadTicks() {                    // where labels would meet every other one is left out
  const labels = [...element("ticks").children];
  labels.forEach(label => label.style.visibility = "");
  const boxes = labels.map(label => label.getBoundingClientRect());
  const step = [1, 2, 4, 8].find(k => boxes.every((box, i) => i < k || i % k || box.left > boxes[i - k].right + 4));
  labels.forEach((label, i) => { if (i % (step || 8)) label.style.visibility = "hidden"; });
}

function showHistograms() {
  const shown = element("histogram").checked, all = [...views.children];
  const parts = shown ? all.map(v => histogram(v.dataset.name)) : [];
  const highest = Math.max(...parts.flat());
  all.forEach((view, i) => view.lastChild.replaceChildren(...(parts[i] || []).map((part, k) => {
    const bar = document.createElement("div");
    bar.style.height = 100 * part / highest + "%";
    bar.style.background = colourAt((k + 0.5) / data.bars);
    return bar;
  })));
}

function histogram(view) {                  // area by equal parts of the scale, without zeros and undefined values
  const [low, high] = limits, area = Array(data.bars).fill(0);
  arrayOf(view).forEach((v, i) => {
    if (isUndefined(v) || (field.logarithmic && v === 0)) return;
    const part = Math.floor((place(v) - low) / (high - low) * data.bars);
    area[Math.min(Math.max(part, 0), data.bars - 1)] += areas[i];
  });
  return area;
}

function report() {                         // values at the picked vertex or cell, beside the titles
  for (const view of views.children) {
    const { name } = view.dataset;
    view.firstChild.textContent = picked < 0 ? name : `${name}: ${valueText(arrayOf(name)[picked])}`;
    view.firstChild.style.whiteSpace = picked < 0 ? "" : "normal";
  }
  const at = p => [0, 1, 2].map(k => text(data.middle[k] + data.extent * points[3 * p + k])).join(", ");
  element("picked").textContent = picked < 0 ? "" :
    `${data.on_cells ? "cell" : "vertex"} ${numbers[picked]}, valence ${valence[picked]}` +
    (data.on_cells ? "" : `, at (${at(picked)})`);
}

function pick(view, x, y) {
  picked = hit(view, x, y);
  paintRing();
  report();
  draw();
}

function drawSoon() {                       // once a frame, however often the pointer moves
  cancelAnimationFrame(asked);
  asked = requestAnimationFrame(draw);
}

// The page's address, which can be sent: #field=error&camera=1,0,0.5&range=1e-4,1e-2&size=800,600&show=edges
const numbersOf = (words, n) => {
  const found = (words || "").split(",").map(Number);
  return found.length === n && found.every(Number.isFinite) ? found : null;
};

function remember() {
  const short = list => list.map(x => Number(x.toPrecision(4))).join(",");
  const found = { field: field.name, camera: short(axes[2]), up: short(axes[1]), zoom: short([zoom]) };
  if (shift.some(x => x)) found.move = short(shift);
  if (ranges.has(field.name)) found.range = [element("low").value, element("high").value].join(",");
  if (size) found.size = size.join(",");
  if (chosen.size < data.schemes.length) found.schemes = [...chosen].join(",");
  found.show = switches.filter(id => element(id).checked).join(",");
  const address = "#" + Object.entries(found).map(([k, v]) => `${k}=${encodeURIComponent(v).replaceAll("%2C", ",")}`).join("&");
  try {
    history.replaceState(null, "", address);
  } catch { }                               // a frame in a notebook has no address of its own
}

function recall() {                         // what the address says, else what the page was made with
  const said = new URLSearchParams(location.hash.slice(1));
  const names = (said.get("schemes") || "").split(",").filter(name => data.schemes.includes(name));
  chosen = new Set(names.length ? names : data.schemes);
  for (const box of element("schemes").querySelectorAll("input")) box.checked = chosen.has(box.value);
  for (const id of switches) element(id).checked = said.has("show") ? said.get("show").split(",").includes(id) : start[id];
  reset();
  const camera = numbersOf(said.get("camera"), 3), up = numbersOf(said.get("up"), 3) || data.up;
  if (camera && Math.hypot(...cross(up, camera)) > 1e-6) look(camera, up);
  zoom = numbersOf(said.get("zoom"), 1)?.[0] || 1;
  shift = numbersOf(said.get("move"), 2) || [0, 0];
  resize(numbersOf(said.get("size"), 2) || start.size);
  field = data.fields.find(f => f.name === said.get("field")) || data.fields.find(f => f.name === start.field);
  const range = numbersOf(said.get("range"), 2);
  if (range) setRange(...range);
  show(field.name);
}

function setRange(low, high) {              // ends of the scale as the quantity itself; others are refused
  if (!(low < high) || (field.logarithmic && low <= 0)) return false;
  ranges.set(field.name, [low, high].map(x => field.logarithmic ? Math.log10(x) : x / field.unit));
  return true;
}

function resize(wanted) {                   // in pixels, null as the window
  size = wanted && Math.min(...wanted) >= 100 ? wanted.map(Math.round) : null;
  ["width", "height"].forEach((side, k) => document.body.style[side] = size ? `${size[k]}px` : "");
  document.documentElement.style.overflow = size ? "auto" : "";
  const { width, height } = document.body.getBoundingClientRect();
  element("width").value = Math.round(width);
  element("height").value = Math.round(height);
}

function reset() {
  look(start.towards, start.up);
  zoom = 1;
  shift = [0, 0];
}

for (const f of data.fields) element("field").append(new Option(f.label, f.name));
if (data.schemes.length > 1) for (const name of data.schemes) {
  const label = document.createElement("label"), box = document.createElement("input");
  box.type = "checkbox";
  box.value = name;
  box.addEventListener("change", () => {
    chosen[box.checked ? "add" : "delete"](name);
    if (!chosen.size) box.checked = chosen.add(name);
    show(field.name);
  });
  label.append(box, " " + name);
  element("schemes").append(label);
}
if (data.title !== null) {
  document.title = document.querySelector("h1").textContent = data.title;
  document.querySelector("h1").hidden = false;
}

// One pointer turns, with Shift or another button it moves; two zoom and move; a click or a tap picks.
const pointers = new Map();
let moved = 0;
const middle = () => [0, 1].map(k => [...pointers.values()].reduce((sum, p) => sum + p[k], 0) / pointers.size);
const spread = () => { const [a, b] = pointers.values(); return Math.hypot(a[0] - b[0], a[1] - b[1]); };

function moveBy(d) {
  const box = views.firstChild.getBoundingClientRect();
  shift = [shift[0] + 2 * d[0] / box.width, shift[1] - 2 * d[1] / box.height];
}

function turnBy(d) {                        // the eye about the other screen axis, against the pointer
  d.forEach((step, k) => {
    const angle = (k ? 0.008 : -0.008) * step, c = Math.cos(angle), s = Math.sin(angle), side = axes[k];
    axes[k] = side.map((x, i) => c * x - s * axes[2][i]);
    axes[2] = axes[2].map((x, i) => c * x + s * side[i]);
  });
}

views.addEventListener("pointerdown", e => {
  if (!pointers.size) moved = 0;
  pointers.set(e.pointerId, [e.clientX, e.clientY]);
  views.setPointerCapture(e.pointerId);
});
views.addEventListener("pointermove", e => {
  if (!pointers.has(e.pointerId)) return;
  const before = middle(), apart = pointers.size === 2 && spread();
  pointers.set(e.pointerId, [e.clientX, e.clientY]);
  const d = middle().map((x, k) => x - before[k]);
  moved += Math.hypot(...d);
  if (apart) zoom *= spread() / apart;
  if (pointers.size > 1 || e.shiftKey || e.buttons !== 1) moveBy(d);
  else turnBy(d);
  if (pointers.size > 1) moved = Infinity;  // no tap
  drawSoon();
});
for (const kind of ["pointerup", "pointercancel"]) views.addEventListener(kind, e => {
  pointers.delete(e.pointerId);
  if (pointers.size) return;
  const view = [...views.children].find(v => {
    const b = v.getBoundingClientRect();
    return b.left <= e.clientX && e.clientX < b.right && b.top <= e.clientY && e.clientY < b.bottom;
  });
  if (kind === "pointerup" && moved < (e.pointerType === "touch" ? 10 : 4) && view) pick(view, e.clientX, e.clientY);
  remember();
});
views.addEventListener("contextmenu", e => e.preventDefault());
views.addEventListener("wheel", e => {
  e.preventDefault();
  zoom *= Math.exp(-Math.sign(e.deltaY) * 0.1);
  drawSoon();
  remember();
}, { passive: false });
const again = () => { drawSoon(); remember(); };
element("field").addEventListener("change", e => show(e.target.value));
for (const id of ["edges", "shading"]) element(id).addEventListener("change", again);
for (const id of ["overlays", "histogram"]) element(id).addEventListener("change", () => show(field.name));
element("reset").addEventListener("click", () => { reset(); again(); });
for (const id of ["low", "high"]) element(id).addEventListener("change", () => {
  setRange(Number(element("low").value), Number(element("high").value));
  show(field.name);
});
element("automatic").addEventListener("click", () => { ranges.delete(field.name); show(field.name); });
for (const button of document.querySelectorAll("[data-towards]")) button.addEventListener("click", () => {
  const towards = numbersOf(button.dataset.towards, 3);
  look(towards, Math.abs(dot(towards, data.up)) > 0.9 ? [data.up[2], data.up[0], data.up[1]] : data.up);
  shift = [0, 0];
  again();
});
for (const id of ["width", "height"]) element(id).addEventListener("change", () => {
  resize(numbersOf([element("width").value, element("height").value].join(), 2));
  arrange();
  again();
});
element("fill").addEventListener("click", () => { resize(null); arrange(); again(); });
new ResizeObserver(() => { arrange(); drawSoon(); }).observe(document.querySelector("main"));
window.addEventListener("hashchange", recall);
window.addEventListener("keydown", e => {
  if (["SELECT", "INPUT"].includes(e.target.tagName) && e.target.type !== "checkbox") return;
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  const step = { ArrowRight: 1, ArrowLeft: data.fields.length - 1 }[e.key];
  if (step) show(data.fields[(data.fields.indexOf(field) + step) % data.fields.length].name);
  const id = { m: "edges", o: "overlays", h: "histogram", s: "shading", r: "reset" }[e.key];
  if (id) element(id).click();
});
recall();
