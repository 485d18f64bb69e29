// The surface in WebGL: the same geometry in every view, each with its own values.
const data = JSON.parse(document.getElementById("data").textContent);
const element = id => document.getElementById(id), views = element("views");
const decode = (text, type) => new type(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
const counts = ({ type, data }) => decode(data, window[type]);
const points = decode(data.points, Float32Array), faces = decode(data.faces, Int32Array);
const valence = counts(data.valence), numbers = counts(data.numbers), areas = decode(data.areas, Float32Array);
const arrays = data.arrays.map(a => decode(a, Float32Array));
const isUndefined = v => v < data.undefined * 1e-10;
const sides = f => faces[4 * f + 3] < 0 ? 3 : 4;

// What is drawn: the mesh's own vertices, or four of its own for each cell where values belong to cells.
const count = faces.length / 4, source = [];
const corner = data.on_cells ? (f, k) => 4 * f + k : (f, k) => faces[4 * f + k];
if (data.on_cells) for (const v of faces) source.push(Math.max(v, 0));
else for (let v = 0; v < points.length / 3; v++) source.push(v);
const position = new Float32Array(3 * source.length);
source.forEach((v, i) => position.set(points.subarray(3 * v, 3 * v + 3), 3 * i));
const triangles = [], lines = [], seen = new Set();
for (let f = 0; f < count; f++) for (let k = 0; k < sides(f); k++) {
  const next = (k + 1) % sides(f);
  if (k > 1) triangles.push(corner(f, 0), corner(f, k - 1), corner(f, k));
  const [a, b] = [faces[4 * f + k], faces[4 * f + next]];
  const edge = Math.min(a, b) * points.length + Math.max(a, b);
  if (!seen.has(edge)) lines.push(corner(f, k), corner(f, next));
  seen.add(edge);
}

const canvas = document.querySelector("canvas");
const gl = canvas.getContext("webgl2", { alpha: false, antialias: true });
if (!gl) views.textContent = "This page needs a browser with WebGL 2.";

const shader = (kind, text) => {
  const s = gl.createShader(kind);
  gl.shaderSource(s, "#version 300 es\nprecision highp float;\n" + text);
  gl.compileShader(s);
  if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(s));
  return s;
};
const program = gl.createProgram();
gl.attachShader(program, shader(gl.VERTEX_SHADER, `
  uniform mat4 camera;
  uniform mat3 turn;                                    // to right, up and the viewer
  uniform float lift;                                   // towards the viewer
  uniform float dotSize;                                // size of points
  uniform vec2 nudge;                                   // across the screen
  in vec3 position;
  in float value;
  out float v;
  out vec3 place;
  void main() {
    place = turn * position;
    gl_Position = camera * vec4(position, 1.0) + vec4(nudge, -lift, 0.0);
    gl_PointSize = dotSize;
    v = value;
  }`));
gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
  uniform sampler2D colours;
  uniform vec2 limits;
  uniform vec4 undefinedColour, zeroColour, plain;      // plain, unless transparent, replaces the field
  uniform bool showsZero, round, shaded;
  in float v;
  in vec3 place;
  out vec4 colour;
  void main() {
    if (round && length(gl_PointCoord - 0.5) > 0.5) discard;
    if (plain.a > 0.0) colour = plain;
    else if (v < ${(data.undefined * 1e-10).toExponential()}) colour = undefinedColour;
    else if (showsZero && v < limits.x - 1e-4) colour = zeroColour;
    else colour = texture(colours, vec2((v - limits.x) / (limits.y - limits.x), 0.5));
    if (shaded && plain.a == 0.0)                       // by the facet's own normal, as a lamp at the viewer would
      colour.rgb *= 0.35 + 0.65 * abs(normalize(cross(dFdx(place), dFdy(place))).z);
  }`));
gl.linkProgram(program);
gl.useProgram(program);
const at = name => gl.getUniformLocation(program, name);
const buffer = (target, array) => {
  const b = gl.createBuffer();
  gl.bindBuffer(target, b);
  gl.bufferData(target, array, gl.STATIC_DRAW);
  return b;
};
buffer(gl.ARRAY_BUFFER, position);
gl.enableVertexAttribArray(gl.getAttribLocation(program, "position"));
gl.vertexAttribPointer(gl.getAttribLocation(program, "position"), 3, gl.FLOAT, false, 0, 0);
const triangleBuffer = buffer(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(triangles));
const lineBuffer = buffer(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(lines));
const ringBuffer = gl.createBuffer();
const drawn = new Uint32Array(points.length / 3);
source.forEach((v, i) => drawn[v] = i);
const overlays = data.overlays.map(o => {
  const index = decode(o.vertices, Uint32Array).map(v => drawn[v]);
  return { ...o, count: index.length, buffer: buffer(gl.ELEMENT_ARRAY_BUFFER, index) };
});
const valueSlot = gl.getAttribLocation(program, "value");
gl.enableVertexAttribArray(valueSlot);
gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
for (const p of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, p, gl.CLAMP_TO_EDGE);
gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
const rgba = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16) / 255).concat(1);
gl.uniform4fv(at("undefinedColour"), rgba(data.undefined_colour));
gl.uniform4fv(at("zeroColour"), rgba(data.zero_colour));
gl.enable(gl.DEPTH_TEST);
gl.depthFunc(gl.LEQUAL);                    // marks on an edge hide it
gl.enable(gl.SCISSOR_TEST);
gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);

// One camera for all views: rows of `axes` point right, up and towards the viewer.
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => a.map(x => x / Math.hypot(...a));
const ends = [0, 1, 2].map(k => {
  let low = Infinity, high = -Infinity;
  for (let i = k; i < position.length; i += 3) {
    low = Math.min(low, position[i]);
    high = Math.max(high, position[i]);
  }
  return [low, high];
});
const centre = ends.map(([low, high]) => (low + high) / 2);
let radius = 0;                             // of the ball that holds all, however it is turned
for (let i = 0; i < position.length; i += 3)
  radius = Math.max(radius, Math.hypot(position[i] - centre[0], position[i + 1] - centre[1], position[i + 2] - centre[2]));
radius = radius || 1;
let axes, zoom, shift;

function look(towards, up) {
  const right = unit(cross(up, towards)), eye = unit(towards);
  axes = [right, cross(eye, right), eye];
}

function camera(box) {                      // column-major, parallel projection
  const aspect = box.width / box.height;
  const top = Math.min((1.5 * parseFloat(views.style.fontSize || 15) + 6) / box.height, 0.4);  // for the title
  const bottom = element("histogram").checked ? 0.12 : 0.03;
  const unitY = radius / zoom * Math.max(1 / (1 - top - bottom), 1 / 0.94 / aspect);
  const scale = [1 / (unitY * aspect), 1 / unitY, -1 / (4 * radius)];
  const m = new Float32Array(16);
  axes.forEach((a, k) => {
    for (let i = 0; i < 3; i++) m[4 * i + k] = scale[k] * a[i];
    m[12 + k] = -scale[k] * dot(a, centre) + (k < 2 ? shift[k] : 0);
  });
  m[13] -= top - bottom;
  m[15] = 1;
  return m;
}

function draw() {                           // all views at once
  const ratio = window.devicePixelRatio || 1, frame = canvas.getBoundingClientRect();
  canvas.width = frame.width * ratio;
  canvas.height = frame.height * ratio;
  gl.scissor(0, 0, canvas.width, canvas.height);
  gl.clearColor(1, 1, 1, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.uniformMatrix3fv(at("turn"), false, [0, 1, 2].flatMap(i => axes.map(a => a[i])));
  gl.uniform1i(at("shaded"), element("shading").checked);
  for (const view of views.children) {
    const box = view.getBoundingClientRect();
    const where = [box.left - frame.left, frame.bottom - box.bottom, box.width, box.height].map(x => x * ratio);
    gl.viewport(...where);
    gl.scissor(...where);
    gl.uniform1f(at("dotSize"), Math.min(9, box.width / 35) * ratio);
    gl.uniformMatrix4fv(at("camera"), false, camera(box));
    gl.bindBuffer(gl.ARRAY_BUFFER, view.colours);
    gl.vertexAttribPointer(valueSlot, 1, gl.FLOAT, false, 0, 0);
    gl.uniform4f(at("plain"), 0, 0, 0, 0);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangleBuffer);
    gl.drawElements(gl.TRIANGLES, triangles.length, gl.UNSIGNED_INT, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.uniform1f(at("lift"), 0.01);
    gl.enable(gl.BLEND);
    if (element("edges").checked) {
      gl.uniform4f(at("plain"), 0, 0, 0, 0.25);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, lineBuffer);
      gl.drawElements(gl.LINES, lines.length, gl.UNSIGNED_INT, 0);
    }
    if (element("overlays").checked) for (const o of overlays) {
      gl.uniform4fv(at("plain"), rgba(o.colour));
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, o.buffer);
      gl.uniform1i(at("round"), !o.lines);
      for (const [x, y] of o.lines ? [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]] : [[0, 0]]) {  // thickens
        gl.uniform2f(at("nudge"), 2 * x / box.width, 2 * y / box.height);
        gl.drawElements(o.lines ? gl.LINES : gl.POINTS, o.count, gl.UNSIGNED_INT, 0);
      }
      gl.uniform2f(at("nudge"), 0, 0);
    }
    if (picked >= 0) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, ringBuffer);
      gl.uniform1i(at("round"), false);
      gl.uniform4f(at("plain"), 0.8, 0.2, 0.6, 0.6);
      gl.drawElements(gl.TRIANGLES, ringBuffer.triangles, gl.UNSIGNED_INT, 0);
      gl.uniform4f(at("plain"), 0, 0, 0, 1);
      gl.uniform1i(at("round"), true);
      if (!data.on_cells) gl.drawArrays(gl.POINTS, picked, 1);
    }
    gl.disable(gl.BLEND);
    gl.uniform1f(at("lift"), 0);
    gl.uniform1i(at("round"), false);
  }
}

function hit(view, x, y) {                  // the nearest corner of the foremost face at a place of the window, or -1
  const box = view.getBoundingClientRect(), m = camera(box), screen = new Float32Array(position.length);
  for (let i = 0; i < position.length; i += 3) for (let k = 0; k < 3; k++)
    screen[i + k] = m[k] * position[i] + m[4 + k] * position[i + 1] + m[8 + k] * position[i + 2] + m[12 + k];
  const px = 2 * (x - box.left) / box.width - 1, py = 1 - 2 * (y - box.top) / box.height;
  let depth = Infinity, found = -1;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const area = (i, j) => (screen[i] - px) * (screen[j + 1] - py) - (screen[j] - px) * (screen[i + 1] - py);
    const w = [area(b, c), area(c, a), area(a, b)], sum = w[0] + w[1] + w[2];
    if (sum === 0 || w.some(v => v / sum < 0)) continue;
    const z = (w[0] * screen[a + 2] + w[1] * screen[b + 2] + w[2] * screen[c + 2]) / sum;
    if (z < depth) {
      depth = z;
      const far = i => Math.hypot(screen[i] - px, screen[i + 1] - py);
      found = [a, b, c].reduce((i, j) => far(i) < far(j) ? i : j) / 3;
    }
  }
  return found < 0 || !data.on_cells ? found : found >> 2;
}

function paintRing() {                      // the faces around the picked vertex, or the picked cell
  const ring = [];
  for (let f = 0; picked >= 0 && f < count; f++) {
    const around = data.on_cells ? f === picked : [0, 1, 2, 3].some(k => faces[4 * f + k] === picked);
    for (let k = 2; around && k < sides(f); k++) ring.push(corner(f, 0), corner(f, k - 1), corner(f, k));
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, ringBuffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(ring), gl.DYNAMIC_DRAW);
  ringBuffer.triangles = ring.length;
}
