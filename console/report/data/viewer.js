// Plays recorded trials in 3-D: WebGL 2, nothing loaded. One canvas, one trial at a time.
"use strict";

const VERTEX = `#version 300 es
in vec3 position; in vec3 normal;
uniform mat4 camera, model; uniform float flatten;
out vec3 at; out vec3 facing;
void main() {
  vec4 p = model * vec4(position, 1.0);
  // A shadow is the shape itself, laid along the light onto the floor.
  if (flatten > 0.0) p.xyz -= vec3(0.35, 0.2, 1.0) * (p.z - 0.003);
  at = p.xyz; facing = mat3(model) * normal;
  gl_Position = camera * p;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at; in vec3 facing;
uniform vec4 colour; uniform vec3 background; uniform vec3 eye; uniform int kind;
out vec4 result;
float grid(vec2 p) {
  vec2 width = fwidth(p), line = abs(fract(p - 0.5) - 0.5) / max(width, 1e-4);
  return (1.0 - min(min(line.x, line.y), 1.0)) / (1.0 + 8.0 * max(width.x, width.y));
}
void main() {
  if (kind == 2) { result = colour; return; }
  if (kind == 1) {
    float fade = smoothstep(22.0, 6.0, distance(at.xy, eye.xy));
    vec3 floor_ = mix(colour.rgb, colour.rgb * 0.82, grid(at.xy));
    result = vec4(mix(background, floor_, fade), 1.0); return;
  }
  vec3 n = normalize(facing), light = normalize(vec3(0.35, 0.2, 1.0));
  float lit = 0.50 + 0.42 * max(dot(n, light), 0.0) + 0.12 * max(dot(n, normalize(eye - at)), 0.0);
  result = vec4(colour.rgb * lit, colour.a);
}`;

// Shapes: triangles with normals, [x y z nx ny nz] a vertex.
function around(profile, sides) {  // a curve [radius, z, normal radius, normal z] turned about z
  const out = [];
  const point = ([r, z, a, b], i) => {
    const angle = 2 * Math.PI * i / sides, c = Math.cos(angle), s = Math.sin(angle);
    return [r * c, r * s, z, a * c, a * s, b];
  };
  for (let k = 0; k + 1 < profile.length; k++) for (let i = 0; i < sides; i++) {
    const [p, q] = [profile[k], profile[k + 1]];
    out.push(...point(p, i), ...point(p, i + 1), ...point(q, i + 1));
    out.push(...point(p, i), ...point(q, i + 1), ...point(q, i));
  }
  return out;
}
function rounded(radius, half) {
  const profile = [];
  for (let k = 0; k <= 8; k++) {
    const a = -Math.PI / 2 + Math.PI / 2 * k / 8;
    profile.push([radius * Math.cos(a), radius * Math.sin(a) - half, Math.cos(a), Math.sin(a)]);
  }
  return around([...profile, ...profile.map(([r, z, a, b]) => [r, -z, a, -b]).reverse()], 18);
}
function ellipsoid(x, y, z) {  // a normal is scaled by the inverse of what scales its point
  const out = rounded(1, 0), half = [x, y, z];
  for (let i = 0; i < out.length; i += 6) {
    for (let k = 0; k < 3; k++) { out[i + k] *= half[k]; out[i + 3 + k] /= half[k]; }
    const l = Math.hypot(out[i + 3], out[i + 4], out[i + 5]) || 1;
    for (let k = 3; k < 6; k++) out[i + k] /= l;
  }
  return out;
}
function triangles(vertices, faces) {
  const out = [];
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((i) => vertices.slice(3 * faces[f + i], 3 * faces[f + i] + 3));
    const u = b.map((x, i) => x - a[i]), v = c.map((x, i) => x - a[i]);
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const l = Math.hypot(...n) || 1;
    for (const p of [a, b, c]) out.push(...p, n[0] / l, n[1] / l, n[2] / l);
  }
  return out;
}
function box(x, y, z) {
  const v = [];
  for (let i = 0; i < 8; i++) v.push(i & 4 ? x : -x, i & 2 ? y : -y, i & 1 ? z : -z);
  return triangles(v, [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2,
    6, 0, 6, 4, 1, 5, 7, 1, 7, 3]);
}
function shapeTriangles(shape) {
  const [a, b, c] = shape.size;
  if (shape.kind === "sphere") return rounded(a, 0);
  if (shape.kind === "capsule") return rounded(a, b);
  if (shape.kind === "ellipsoid") return ellipsoid(a, b, c);
  if (shape.kind === "box") return box(a, b, c);
  if (shape.kind === "mesh") return triangles(shape.vertices, shape.faces);
  return around([[0, -b, 0, -1], [a, -b, 0, -1], [a, -b, 1, 0], [a, b, 1, 0], [a, b, 0, 1],
    [0, b, 0, 1]], 24);
}

// Matrices are columns, as WebGL has them; quaternions are w, x, y, z.
function pose([x, y, z, w, i, j, k]) {
  const n = 2 / (w * w + i * i + j * j + k * k);
  return [1 - n * (j * j + k * k), n * (i * j + k * w), n * (i * k - j * w), 0,
    n * (i * j - k * w), 1 - n * (i * i + k * k), n * (j * k + i * w), 0,
    n * (i * k + j * w), n * (j * k - i * w), 1 - n * (i * i + j * j), 0, x, y, z, 1];
}
function times(a, b) {
  const out = new Array(16).fill(0);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++)
    out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
function lens(aspect) {
  const f = 1 / Math.tan(0.36), near = 0.05, far = 120;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
    0, 0, 2 * far * near / (near - far), 0];
}
function look(eye, to) {
  const unit = (v) => { const l = Math.hypot(...v); return v.map((x) => x / l); };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const z = unit(eye.map((x, i) => x - to[i])), x = unit(cross([0, 0, 1], z)), y = cross(z, x);
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
    -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
}

class Take {
  constructor(data) {
    Object.assign(this, data);
    const bytes = Uint8Array.from(atob(data.poses), (c) => c.charCodeAt(0));
    this.poses = new DataView(bytes.buffer);
  }
  pose(frame, body) {
    const at = 14 * (Math.min(frame, this.frames - 1) * this.bodies + body);
    const number = (i) => this.poses.getInt16(at + 2 * i, true);
    return [number(0) / 1000, number(1) / 1000, number(2) / 1000, number(3), number(4), number(5), number(6)];
  }
}

class Viewer {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = this.gl = canvas.getContext("webgl2", { alpha: false, antialias: true, stencil: true });
    if (!gl) throw new Error("no WebGL 2");
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(this.program, shader);
    }
    gl.bindAttribLocation(this.program, 0, "position");
    gl.bindAttribLocation(this.program, 1, "normal");
    gl.linkProgram(this.program); gl.useProgram(this.program);
    this.at = {};
    for (const name of ["camera", "model", "flatten", "colour", "background", "eye", "kind"])
      this.at[name] = gl.getUniformLocation(this.program, name);
    this.floor = this.buffer([-60, -60, 0, 0, 0, 1, 60, -60, 0, 0, 0, 1, 60, 60, 0, 0, 0, 1,
      -60, -60, 0, 0, 0, 1, 60, 60, 0, 0, 0, 1, -60, 60, 0, 0, 0, 1]);
    this.ghost = true; this.azimuth = 2.3; this.elevation = 0.32; this.distance = 4.4; this.centre = null;
    this.steer();
  }
  buffer(vertices) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const store = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, store);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), gl.STATIC_DRAW);
    for (const [place, offset] of [[0, 0], [1, 12]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, offset);
    }
    return { array, store, count: vertices.length / 6 };
  }
  show(take) {
    for (const { mesh } of this.parts || []) {
      this.gl.deleteBuffer(mesh.store); this.gl.deleteVertexArray(mesh.array);
    }
    this.take = take; this.centre = null;
    this.parts = take.shapes.map((shape) => ({
      shape, local: pose([...shape.pos, ...shape.quat]), mesh: this.buffer(shapeTriangles(shape)),
    }));
  }
  steer() {
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); this.held = [e.clientX, e.clientY]; });
    canvas.addEventListener("pointerup", () => { this.held = null; });
    canvas.addEventListener("pointermove", (e) => {
      if (!this.held) return;
      this.azimuth -= 0.008 * (e.clientX - this.held[0]);
      this.elevation = Math.min(1.5, Math.max(0.02, this.elevation + 0.006 * (e.clientY - this.held[1])));
      this.held = [e.clientX, e.clientY]; this.changed = true;
    });
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault(); this.changed = true;
      this.distance = Math.min(25, Math.max(1.2, this.distance * Math.exp(0.001 * e.deltaY)));
    }, { passive: false });
  }
  draw(frame, dark) {
    const gl = this.gl, canvas = this.canvas, take = this.take, ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    const background = dark ? [0.10, 0.11, 0.13] : [0.95, 0.96, 0.97];
    gl.clearColor(...background, 1); gl.clearStencil(0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const root = take.pose(frame, take.root), wanted = [root[0], root[1], 0.75];
    this.centre = this.centre ? this.centre.map((x, i) => x + 0.12 * (wanted[i] - x)) : wanted;
    const [a, e, d] = [this.azimuth, this.elevation, this.distance];
    const eye = [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)].map((x, i) => this.centre[i] + d * x);
    eye[2] = Math.max(eye[2], 0.1);
    gl.uniformMatrix4fv(this.at.camera, false, times(lens(width / height), look(eye, this.centre)));
    gl.uniform3fv(this.at.background, background); gl.uniform3fv(this.at.eye, eye);
    const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    this.put(this.floor, identity, dark ? [0.17, 0.18, 0.20, 1] : [0.88, 0.89, 0.90, 1], 1, 0);
    const placed = this.parts.map(({ shape, local, mesh }) => {
      const body = take.pose(frame, shape.body);
      return body[0] < -31 ? null : { mesh, model: times(pose(body), local), shape };
    }).filter((part) => part);
    // Each pixel of the floor is darkened once, however many shadows fall on it.
    gl.enable(gl.STENCIL_TEST); gl.stencilFunc(gl.EQUAL, 0, 255); gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA); gl.depthMask(false);
    const solid = placed.filter((part) => !part.shape.ghost);
    for (const part of solid) this.put(part.mesh, part.model, [0, 0, 0, dark ? 0.4 : 0.22], 2, 1);
    gl.depthMask(true); gl.disable(gl.BLEND); gl.disable(gl.STENCIL_TEST);
    for (const part of solid) this.put(part.mesh, part.model, [...part.shape.rgb, 1], 0, 0);
    if (this.ghost) this.translucent(placed.filter((part) => part.shape.ghost));
  }
  // Nearest surfaces first, to depth alone: limbs that overlap are not seen through one another.
  translucent(parts) {
    const gl = this.gl;
    gl.colorMask(false, false, false, false);
    for (const part of parts) this.put(part.mesh, part.model, [0, 0, 0, 1], 2, 0);
    gl.colorMask(true, true, true, true);
    gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA); gl.depthFunc(gl.LEQUAL);
    for (const part of parts) this.put(part.mesh, part.model, [...part.shape.rgb, 0.45], 0, 0);
    gl.depthFunc(gl.LESS); gl.disable(gl.BLEND);
  }
  put(mesh, model, colour, kind, flatten) {
    const gl = this.gl;
    gl.uniformMatrix4fv(this.at.model, false, model); gl.uniform4fv(this.at.colour, colour);
    gl.uniform1i(this.at.kind, kind); gl.uniform1f(this.at.flatten, flatten);
    gl.bindVertexArray(mesh.array); gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  }
}

function play() {
  const root = document.getElementById("replay");
  if (!root) return;
  const find = (name) => root.querySelector(`[data-part="${name}"]`);
  const takes = JSON.parse(document.getElementById("takes").textContent).map((data) => new Take(data));
  let viewer;
  try { viewer = new Viewer(find("canvas")); } catch (error) {
    find("status").textContent = `The replay needs WebGL 2 (${error.message}); the filmstrips below show the same trials.`;
    return;
  }
  const slider = find("slider"), button = find("play"), status = find("status"), speed = find("speed");
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  let take = takes[0], clock = 0, playing = true, before = 0;
  const curve = () => {
    const most = Math.max(0.5, 1.05 * take.success_m, ...take.error), last = Math.max(1, take.frames - 1);
    const line = take.error.map((x, i) => `${(1000 * i / last).toFixed(1)},${(60 - 56 * x / most).toFixed(1)}`).join(" ");
    const height = (60 - 56 * take.success_m / most).toFixed(1);
    const thin = 'vector-effect="non-scaling-stroke"';  // the curve is stretched, its lines are not
    find("curve").innerHTML = `<line ${thin} class="aim" x1="0" x2="1000" y1="${height}" y2="${height}"/>` +
      `<polyline ${thin} class="line c0" points="${line}"/><line ${thin} class="now" data-part="now" y1="0" y2="60"/>`;
  };
  const choose = (index) => {
    take = takes[index]; clock = 0; viewer.show(take); curve();
    slider.max = take.frames - 1;
    root.querySelectorAll("[data-take]").forEach((b) => b.setAttribute("aria-pressed", String(+b.dataset.take === index)));
    find("about").textContent = take.about;
  };
  const frame = () => Math.min(take.frames - 1, Math.floor(clock * take.hz));
  const tick = (now) => {
    const passed = Math.min(0.1, (now - before) / 1000); before = now;
    if (playing) {
      clock += passed * +speed.value;
      if (clock * take.hz >= take.frames + take.hz) clock = 0;
      slider.value = frame();
    }
    const at = frame(), style = take.style && at < take.style.length ? `, style ${take.style[at].toFixed(2)}` : "";
    status.textContent = `${(at / take.hz).toFixed(2)} s, ${take.error[at].toFixed(2)} m from the ${take.goal || "target"}${style}` +
      (take.fell && at >= take.end ? ", fallen" : "");
    const x = 1000 * at / Math.max(1, take.frames - 1), mark = find("now");
    mark.setAttribute("x1", x); mark.setAttribute("x2", x);
    viewer.draw(at, dark.matches);
    requestAnimationFrame(tick);
  };
  root.querySelectorAll("[data-take]").forEach((b) => b.addEventListener("click", () => choose(+b.dataset.take)));
  const toggle = () => { playing = !playing; button.textContent = playing ? "pause" : "play"; };
  button.addEventListener("click", toggle);
  const ghost = find("ghost");
  if (ghost) ghost.addEventListener("change", () => { viewer.ghost = ghost.checked; });
  slider.addEventListener("input", () => { if (playing) toggle(); clock = slider.value / take.hz + 1e-6; });
  const moment = /(?:^|[#&])t=([\d.]+)/.exec(location.hash), which = /(?:^|[#&])take=(\d+)/.exec(location.hash);
  choose(which ? Math.min(takes.length - 1, +which[1]) : 0);
  if (moment) { clock = +moment[1]; toggle(); slider.value = frame(); }
  requestAnimationFrame(tick);
}
play();
