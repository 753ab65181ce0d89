// Draws the table, the arm, the clouds and the ghosts of a goal with WebGL 2. Lengths in metres; z is up; the world frame
// has its origin at the arm's mounting point, x away from the arm, y to its left.
import {
  AT_REST, IDENTITY, between, cross, fromPose, fromRows, lookAt, multiply, normalized, perspective, plus, shadowOn,
  transformed,
} from "./matrices.js";

const LIGHT = normalized([-0.35, 0.45, 1]);
const POINT = 0.0042, GHOST_POINT = 0.0034;
const TABLE_THICKNESS = 0.03;
const WOOD = [0.83, 0.76, 0.66];
const ANGLE = 0.72; // of view, radians
const NEAR = 0.02, FAR = 20;
const VIEWS = { robot: [Math.PI - 0.3, 0.9], opposite: [0.3, 0.8], above: [Math.PI, 1.53] };
const LONGEST_STEP = 250; // ms, of the way from one pose to the next

const MESH_VERTEX = `#version 300 es
uniform mat4 u_project, u_model;
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
out vec3 v_normal, v_world;
void main() {
  vec4 world = u_model * vec4(a_position, 1.0);
  v_world = world.xyz;
  v_normal = mat3(u_model) * a_normal;
  gl_Position = u_project * world;
}`;
const MESH_FRAGMENT = `#version 300 es
precision mediump float;
uniform vec4 u_color;
uniform vec3 u_light;
uniform float u_lit, u_grid;
in vec3 v_normal, v_world;
out vec4 color;
void main() {
  vec3 normal = normalize(v_normal);
  float light = mix(1.0, 0.58 + 0.34 * max(dot(normal, u_light), 0.0) + 0.12 * normal.z, u_lit);
  vec2 lines = abs(fract(v_world.xy * 10.0 + 0.5) - 0.5) / fwidth(v_world.xy * 10.0);
  float line = u_grid * (1.0 - clamp(min(lines.x, lines.y), 0.0, 1.0)) * step(0.5, normal.z);
  color = vec4(u_color.rgb * light * (1.0 - 0.12 * line), u_color.a);
}`;
const POINT_VERTEX = `#version 300 es
uniform mat4 u_project, u_model;
uniform float u_size, u_own;
uniform vec3 u_color;
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_color;
out vec3 v_color;
void main() {
  gl_Position = u_project * u_model * vec4(a_position, 1.0);
  gl_PointSize = clamp(u_size / gl_Position.w, 1.5, 60.0);
  v_color = mix(u_color, a_color, u_own);
}`;
const POINT_FRAGMENT = `#version 300 es
precision mediump float;
uniform float u_alpha, u_lit;
in vec3 v_color;
out vec4 color;
void main() {
  vec2 place = 2.0 * gl_PointCoord - 1.0;
  float inside = dot(place, place);
  if (inside > 1.0) discard;
  vec3 normal = vec3(place.x, -place.y, sqrt(1.0 - inside));
  float light = mix(1.0, 0.66 + 0.4 * max(dot(normal, normalize(vec3(-0.3, 0.6, 0.7))), 0.0), u_lit);
  color = vec4(v_color * light, u_alpha);
}`;

export class Scene3D {
  // `labels` gets one element for each object's name. Throws where there is no WebGL 2.
  constructor(canvas, labels) {
    this.canvas = canvas;
    this.labels = labels;
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: false, stencil: true });
    if (!this.gl) throw new Error("no WebGL 2");
    this.frames = 0;
    this._start();
    this.number = -1;
    this.objects = new Map();
    this.links = new Map();
    this.solids = [];
    this.ghosts = [];
    this.showsGhosts = this.showsArm = true;
    this.target = [0.36, 0, 0.1];
    this.view("robot");
    new ResizeObserver(() => this.redraw()).observe(canvas);
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this._restore());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    this._listen();
  }

  _start() {
    const gl = this.gl;
    this.meshes = program(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.points = program(gl, POINT_VERTEX, POINT_FRAGMENT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  // What the browser threw away, for example while a phone slept, is made again from the last messages.
  _restore() {
    this._start();
    this.tableMesh = undefined;
    if (this.lastArm) this.setArm(this.lastArm);
    if (this.lastScene) {
      const { objects: before } = this;
      this.setScene(this.lastScene);
      for (const [name, object] of this.objects) object.moving = before.get(name)?.moving ?? object.moving;
    }
    this.redraw();
  }

  // --- what is shown -----------------------------------------------------------------------

  // An event of kind "scene": the table and the clouds.
  setScene(message) {
    this.lastScene = message;
    this.number = message.scene;
    this.table = message.table;
    for (const object of this.objects.values()) this._free(object.cloud);
    if (this.tableMesh) this._free(this.tableMesh);
    const [x0, x1, y0, y1] = message.table;
    this.tableMesh = this._upload(solidBox([x1 - x0, y1 - y0, TABLE_THICKNESS]), 6);
    this.tableModel = fromPose([(x0 + x1) / 2, (y0 + y1) / 2, -TABLE_THICKNESS / 2, 0, 0, 0, 1]);
    this.objects = new Map();
    this.ghosts = [];
    this.labels.replaceChildren();
    for (const one of message.objects) {
      const points = floats(one.points);
      const colors = one.colors ? bytes(one.colors) : null;
      const label = document.createElement("span");
      label.textContent = one.name;
      label.classList.toggle("quiet", !one.takes_part);
      this.labels.append(label);
      this.objects.set(one.name, {
        cloud: this._uploadCloud(points, colors), color: one.color.map((value) => value / 255), own: colors !== null,
        top: topOf(points), label, moving: moving(AT_REST), takesPart: one.takes_part,
      });
    }
    this.redraw();
  }

  // An event of kind "arm": its solids.
  setArm(message) {
    this.lastArm = message;
    for (const solid of this.solids) this._free(solid.mesh);
    this.solids = message.shapes.map((shape) => ({
      link: String(shape.link),
      mesh: this._upload(shape.round ? solidCylinder(shape.sides[0] / 2, shape.sides[2]) : solidBox(shape.sides), 6),
      place: fromPose([...shape.position, ...shape.quaternion]),
      color: shape.color.map((value) => value / 255),
    }));
    this.redraw();
  }

  // An event of kind "poses": moves the objects and the links there, smoothly.
  setPoses(message) {
    if (message.scene !== this.number) return;
    const now = performance.now();
    for (const [name, pose] of Object.entries(message.objects)) {
      const object = this.objects.get(name);
      if (object) moveTo(object.moving, pose, now);
    }
    for (const [link, pose] of Object.entries(message.links)) {
      if (this.links.has(link)) moveTo(this.links.get(link), pose, now);
      else this.links.set(link, moving(pose));
    }
    this.redraw();
  }

  // Shows objects elsewhere as ghosts: their names, and their motions as rows from the `place`-th arrangement on.
  setGhosts(names, motions, place) {
    this.ghosts = names.map((name, index) => ({ name, model: fromRows(motions, 12 * (place * names.length + index)) }));
    this.redraw();
  }

  clearGhosts() {
    this.ghosts = [];
    this.redraw();
  }

  view(name) {
    [this.azimuth, this.elevation] = VIEWS[name];
    // Between the middle of the table and the arm.
    if (this.table) this.target = [0.4 * (this.table[0] + this.table[1]), 0.5 * (this.table[2] + this.table[3]), 0.1];
    this.distance = 1.42;
    this.redraw();
  }

  redraw() {
    if (!this.waiting) this.waiting = requestAnimationFrame((now) => this._draw(now));
  }

  // --- drawing -----------------------------------------------------------------------------

  _draw(now) {
    this.waiting = 0;
    const { gl, canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height || gl.isContextLost()) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...(dark ? [0.105, 0.1, 0.095, 1] : [0.93, 0.925, 0.91, 1]));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    // A table that is wide and a window that is narrow need more distance.
    const far = this.distance * Math.max(1, 1.2 / (width / height));
    this.eye = plus(this.target, this._direction(), far);
    const up = this.elevation > 1.52 ? [-Math.cos(this.azimuth), -Math.sin(this.azimuth), 0] : [0, 0, 1];
    this.project = multiply(perspective(ANGLE, width / height, NEAR, FAR), lookAt(this.eye, this.target, up));
    this.pointScale = height / Math.tan(ANGLE / 2);
    const still = this._step(now);
    this._drawTable();
    this._drawSolids(IDENTITY, 1);
    this._drawClouds();
    this._drawShadows();
    if (this.showsGhosts) this._drawGhosts();
    this._placeLabels();
    this.frames += 1;
    if (!still) this.redraw();
  }

  // Advances everything that moves; returns whether all of it has arrived.
  _step(now) {
    let still = true;
    for (const one of [...this.links.values(), ...[...this.objects.values()].map((object) => object.moving)]) {
      const part = Math.min(1, (now - one.since) / one.lasts);
      one.now = between(one.from, one.to, part);
      still = still && part >= 1;
    }
    return still;
  }

  _drawTable() {
    if (!this.tableMesh) return;
    const gl = this.gl;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 1, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    this._drawMesh(this.tableMesh, this.tableModel, [...WOOD, 1], 1, 1);
    gl.disable(gl.STENCIL_TEST);
  }

  _drawSolids(before, lit) {
    for (const solid of this.solids) {
      const link = this.links.get(solid.link);
      if (!link || !this.showsArm) continue;
      const model = multiply(before, multiply(fromPose(link.now), solid.place));
      this._drawMesh(solid.mesh, model, lit ? [...solid.color, 1] : [0.1, 0.08, 0.05, 0.2], lit, 0);
    }
  }

  _drawClouds() {
    for (const object of this.objects.values()) {
      this._drawPoints(object, fromPose(object.moving.now), POINT, 1, 1);
    }
  }

  // Shadows on the table: each of its pixels is darkened once, where the stencil has the table and nothing is before it.
  _drawShadows() {
    const gl = this.gl;
    const flat = shadowOn(0.0008, LIGHT);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 1, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    gl.disable(gl.CULL_FACE);
    this._drawSolids(flat, 0);
    for (const object of this.objects.values()) {
      const model = multiply(flat, fromPose(object.moving.now));
      this._drawPoints({ ...object, own: false, color: [0.1, 0.08, 0.05] }, model, 0.006, 0.2, 0);
    }
    gl.enable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.STENCIL_TEST);
  }

  _drawGhosts() {
    const gl = this.gl;
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    for (const ghost of this.ghosts) {
      const object = this.objects.get(ghost.name);
      if (object) this._drawPoints(object, ghost.model, GHOST_POINT, 0.3, 0);
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  _drawMesh(mesh, model, color, lit, grid) {
    const { gl, meshes } = this;
    gl.useProgram(meshes.program);
    gl.uniformMatrix4fv(meshes.at("u_project"), false, this.project);
    gl.uniformMatrix4fv(meshes.at("u_model"), false, model);
    gl.uniform4fv(meshes.at("u_color"), color);
    gl.uniform3fv(meshes.at("u_light"), LIGHT);
    gl.uniform1f(meshes.at("u_lit"), lit);
    gl.uniform1f(meshes.at("u_grid"), grid);
    gl.bindVertexArray(mesh.array);
    gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  }

  _drawPoints(object, model, size, alpha, lit) {
    const { gl, points } = this;
    gl.useProgram(points.program);
    gl.uniformMatrix4fv(points.at("u_project"), false, this.project);
    gl.uniformMatrix4fv(points.at("u_model"), false, model);
    gl.uniform1f(points.at("u_size"), size * this.pointScale);
    gl.uniform1f(points.at("u_own"), object.own ? 1 : 0);
    gl.uniform3fv(points.at("u_color"), object.color);
    gl.uniform1f(points.at("u_alpha"), alpha);
    gl.uniform1f(points.at("u_lit"), lit);
    gl.bindVertexArray(object.cloud.array);
    gl.drawArrays(gl.POINTS, 0, object.cloud.count);
  }

  _placeLabels() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    for (const object of this.objects.values()) {
      const world = transformed(fromPose(object.moving.now), object.top);
      const [x, y, , w] = transformed(this.project, [world[0], world[1], world[2] + 0.02]);
      const shown = w > 0 && world[2] > -0.3;
      object.label.hidden = !shown;
      if (shown) {
        const left = (0.5 + (0.5 * x) / w) * width, top = (0.5 - (0.5 * y) / w) * height;
        object.label.style.transform = `translate(calc(${left.toFixed(1)}px - 50%), calc(${top.toFixed(1)}px - 100%))`;
      }
    }
  }

  // --- buffers -----------------------------------------------------------------------------

  _upload(values, stride) {
    const gl = this.gl, array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    for (const place of [0, 1]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 4 * stride, 12 * place);
    }
    return { array, buffers: [buffer], count: values.length / stride };
  }

  _uploadCloud(points, colors) {
    const gl = this.gl, array = gl.createVertexArray(), buffers = [gl.createBuffer()];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    if (colors) {
      buffers.push(gl.createBuffer());
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[1]);
      gl.bufferData(gl.ARRAY_BUFFER, colors, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(1);
      gl.vertexAttribPointer(1, 3, gl.UNSIGNED_BYTE, true, 0, 0);
    }
    return { array, buffers, count: points.length / 3 };
  }

  _free(mesh) {
    this.gl.deleteVertexArray(mesh.array);
    for (const buffer of mesh.buffers) this.gl.deleteBuffer(buffer);
  }

  // --- the eye -----------------------------------------------------------------------------

  _direction() {
    const flat = Math.cos(this.elevation);
    return [flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth), Math.sin(this.elevation)];
  }

  _turn(x, y) {
    this.azimuth -= x;
    this.elevation = Math.min(1.53, Math.max(-0.1, this.elevation + y));
    this.redraw();
  }

  _move(x, y) {
    const back = this._direction();
    const right = normalized(cross([0, 0, 1], back));
    const above = cross(back, right);
    const scale = (this.distance * Math.tan(ANGLE / 2) * 2) / this.canvas.clientHeight;
    this.target = plus(plus(this.target, right, -x * scale), above, y * scale).map((value) => Math.min(2, Math.max(-2, value)));
    this.redraw();
  }

  _approach(factor) {
    this.distance = Math.min(6, Math.max(0.25, this.distance * factor));
    this.redraw();
  }

  _listen() {
    const canvas = this.canvas, pressed = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pressed.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pressed.delete(event.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointermove", (event) => {
      const before = pressed.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY];
      const [x, y] = [now[0] - before[0], now[1] - before[1]];
      if (pressed.size === 2) {
        const other = [...pressed].find(([pointer]) => pointer !== event.pointerId)[1];
        const apart = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
        this._approach(apart(before) / apart(now));
        this._move(x / 2, y / 2);
      } else if (event.buttons & 2 || event.shiftKey) this._move(x, y);
      else this._turn(x / 180, y / 180);
      pressed.set(event.pointerId, now);
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this._approach(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) / 600));
    }, { passive: false });
    const keys = {
      ArrowLeft: () => this._turn(0.1, 0), ArrowRight: () => this._turn(-0.1, 0), ArrowUp: () => this._turn(0, 0.1),
      ArrowDown: () => this._turn(0, -0.1), "+": () => this._approach(0.9), "-": () => this._approach(1.1),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  }
}

function moving(pose) {
  return { from: pose, to: pose, now: pose, since: 0, told: 0, lasts: 1 };
}

function moveTo(one, pose, now) {
  Object.assign(one, { from: one.now, to: pose, since: now, lasts: Math.min(LONGEST_STEP, Math.max(1, now - one.told)), told: now });
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made) || "shader");
  const places = new Map();
  const at = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
    return places.get(name);
  };
  return { program: made, at };
}

export function bytes(text) {
  return Uint8Array.from(atob(text), (char) => char.charCodeAt(0));
}

export function floats(text) {
  return new Float32Array(bytes(text).buffer);
}

// The middle of a cloud, at the height of its top.
function topOf(points) {
  let x = 0, y = 0, z = -Infinity;
  for (let place = 0; place < points.length; place += 3) {
    x += points[place];
    y += points[place + 1];
    z = Math.max(z, points[place + 2]);
  }
  return [(3 * x) / points.length, (3 * y) / points.length, z];
}

function solidBox([width, depth, height]) {
  const values = [];
  for (const [axis, sign] of [[0, 1], [0, -1], [1, 1], [1, -1], [2, 1], [2, -1]]) {
    const normal = [0, 0, 0];
    normal[axis] = sign;
    const one = [0, 0, 0], other = [0, 0, 0];
    one[(axis + 1) % 3] = 1;
    other[(axis + 2) % 3] = sign;
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]];
    for (const [a, b] of corners) {
      const corner = plus(plus(normal, one, a), other, b);
      values.push((corner[0] * width) / 2, (corner[1] * depth) / 2, (corner[2] * height) / 2, ...normal);
    }
  }
  return values;
}

function solidCylinder(radius, length) {
  const values = [], count = 28;
  const rim = (step) => [Math.cos((2 * Math.PI * step) / count), Math.sin((2 * Math.PI * step) / count)];
  for (let step = 0; step < count; step++) {
    const [a, b] = [rim(step), rim(step + 1)];
    const at = ([x, y], z) => [radius * x, radius * y, (z * length) / 2];
    for (const [side, z] of [[a, -1], [b, -1], [b, 1], [a, -1], [b, 1], [a, 1]]) values.push(...at(side, z), side[0], side[1], 0);
    for (const z of [1, -1]) {
      const [first, second] = z > 0 ? [a, b] : [b, a];
      values.push(0, 0, (z * length) / 2, 0, 0, z, ...at(first, z), 0, 0, z, ...at(second, z), 0, 0, z);
    }
  }
  return values;
}
