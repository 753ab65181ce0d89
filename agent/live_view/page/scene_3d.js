// Draws the table, the arm, the clouds and the ghosts of a goal with WebGL 2. Lengths in metres; z is up; the world frame
// has its origin at the arm's mounting point, x away from the arm, y to its left.
import { ANGLE, Eye, listen } from "./eye.js";
import { AT_REST, IDENTITY, between, fromPose, fromRows, multiply, normalized, shadowOn, transformed } from "./matrices.js";
import { MESHES, POINTS, program } from "./shaders.js";
import { bytes, floats, middleOf, solidBox, solidCylinder, topOf } from "./solids.js";

const LIGHT = normalized([-0.35, 0.45, 1]);
const POINT = 0.0042, GHOST_POINT = 0.0034;
const TABLE_THICKNESS = 0.03;
const WOOD = [0.83, 0.76, 0.66];
const SHADE = [0.1, 0.08, 0.05];
const LONGEST_STEP = 250; // ms, of the way from one pose to the next
const FAINT = 0.08; // how much of the arm is seen while it rests: it stands between the speaker and the table
const FADING = 450; // ms
const STILL_FOR = 1200; // ms without motion, until it fades

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
    this.eye = new Eye(() => this.redraw());
    this.armSeen = FAINT;
    this.armMoved = -Infinity;
    new ResizeObserver(() => this.redraw()).observe(canvas);
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this._restore());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    listen(canvas, this.eye, (event) => this.grab?.(event));
  }

  _start() {
    const gl = this.gl;
    this.meshes = program(gl, ...MESHES);
    this.points = program(gl, ...POINTS);
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
    for (const object of this.objects.values()) this._free(object.cloud);
    if (this.tableMesh) this._free(this.tableMesh);
    const [x0, x1, y0, y1] = message.table;
    if (String(message.table) !== String(this.eye.table)) {
      this.eye.table = message.table;
      this.eye.view("robot");
    }
    this.tableMesh = this._upload(solidBox([x1 - x0, y1 - y0, TABLE_THICKNESS]), 6);
    this.tableModel = fromPose([(x0 + x1) / 2, (y0 + y1) / 2, -TABLE_THICKNESS / 2, 0, 0, 0, 1]);
    this.objects = new Map();
    this.ghosts = [];
    this.labels.replaceChildren();
    for (const one of message.objects) {
      const points = floats(one.points);
      const colors = one.colors ? bytes(one.colors) : null;
      const middle = middleOf(points);
      const label = document.createElement("span");
      label.textContent = one.name;
      label.classList.toggle("quiet", !one.takes_part);
      this.labels.append(label);
      this.objects.set(one.name, {
        cloud: this._uploadCloud(points, colors), color: one.color.map((value) => value / 255), own: colors !== null,
        middle, top: [middle[0], middle[1], topOf(points)], label, moving: moving(AT_REST), takesPart: one.takes_part,
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
      const known = this.links.get(link);
      if (!known) this.links.set(link, moving(pose));
      else {
        if (differ(known.to, pose)) this.armMoved = now;
        moveTo(known, pose, now);
      }
    }
    this.redraw();
  }

  // Shows objects elsewhere as ghosts: their names, and their motions as rows from the `place`-th arrangement on.
  setGhosts(names, motions, place) {
    this.ghosts = names.map((name, index) => ({ name, model: fromRows(motions, 12 * (place * names.length + index)) }));
    this.redraw();
  }

  // Shows one object elsewhere as a ghost, beside the other ghosts.
  setGhost(name, model) {
    this.ghosts = [...this.ghosts.filter((ghost) => ghost.name !== name), { name, model }];
    this.redraw();
  }

  // Where a place in the world is on the canvas, px; `null` for one behind the eye.
  seenAt([x, y, z]) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [across, up, , w] = transformed(this.project, [x, y, z]);
    return w > 0 ? [(0.5 + (0.5 * across) / w) * width, (0.5 - (0.5 * up) / w) * height] : null;
  }

  clearGhosts() {
    this.ghosts = [];
    this.redraw();
  }

  // Shows nothing, until there is a scene again.
  clear() {
    this.setScene({ scene: -1, table: this.eye.table, objects: [] });
    this.links = new Map();
    this.lastScene = undefined;
  }

  // Shows or hides the ghosts ("showsGhosts") or the arm ("showsArm").
  show(what, shown) {
    this[what] = shown;
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
    this.project = this.eye.project(width, height);
    this.pointScale = height / Math.tan(ANGLE / 2);
    const still = this._step(now);
    this._drawTable();
    if (this.armSeen >= 1) this._drawSolids(IDENTITY, 1);
    this._drawClouds();
    this._drawShadows();
    if (this.showsGhosts) this._drawGhosts();
    if (this.armSeen < 1) this._drawFaintArm();
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
    return this._fade(now) && still;
  }

  // Shows the arm while it moves, and lets it fade when it rests; returns whether it has arrived there.
  _fade(now) {
    const wanted = now - this.armMoved < STILL_FOR ? 1 : FAINT;
    const step = ((now - (this.fadedAt ?? now)) / FADING) * (1 - FAINT);
    this.fadedAt = now;
    this.armSeen += Math.max(-step, Math.min(step, wanted - this.armSeen));
    if (this.armSeen !== wanted) return false;
    this.fadedAt = undefined;
    clearTimeout(this.resting);
    if (wanted === 1) this.resting = setTimeout(() => this.redraw(), STILL_FOR + 50);
    return true;
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

  _drawSolids(before, lit, seen = 1) {
    for (const solid of this.solids) {
      const link = this.links.get(solid.link);
      if (!link || !this.showsArm) continue;
      const model = multiply(before, multiply(fromPose(link.now), solid.place));
      this._drawMesh(solid.mesh, model, lit ? [...solid.color, seen] : [...SHADE, 0.2], lit, 0);
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
    if (this.armSeen >= 1) this._drawSolids(flat, 0);
    for (const object of this.objects.values()) {
      const model = multiply(flat, fromPose(object.moving.now));
      this._drawPoints({ ...object, own: false, color: SHADE }, model, 0.006, 0.2, 0);
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

  // First its depth, then its colour: where its solids lie behind each other, the foremost is seen alone.
  _drawFaintArm() {
    const gl = this.gl;
    gl.colorMask(false, false, false, false);
    this._drawSolids(IDENTITY, 1);
    gl.colorMask(true, true, true, true);
    gl.enable(gl.BLEND);
    gl.depthFunc(gl.LEQUAL);
    this._drawSolids(IDENTITY, 1, this.armSeen);
    gl.depthFunc(gl.LESS);
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
    for (const object of this.objects.values()) {
      const world = transformed(fromPose(object.moving.now), object.top);
      const place = this.seenAt([world[0], world[1], world[2] + 0.02]);
      const shown = place !== null && world[2] > -0.3;
      object.label.hidden = !shown;
      if (shown) {
        const [left, top] = place;
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
}

function moving(pose) {
  return { from: pose, to: pose, now: pose, since: 0, told: 0, lasts: 1 };
}

function moveTo(one, pose, now) {
  Object.assign(one, { from: one.now, to: pose, since: now, lasts: Math.min(LONGEST_STEP, Math.max(1, now - one.told)), told: now });
}

function differ(one, other) {
  return one.some((value, index) => Math.abs(value - other[index]) > 1e-3);
}
