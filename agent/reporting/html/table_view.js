// Views of the table in 3D, to turn with the mouse, a finger or the arrow keys: without WebGL, the pictures stay alone.
const VERTEX = `
attribute vec3 position; attribute vec3 normal; attribute vec3 paint;
uniform mat4 view; uniform mat4 model; uniform vec3 color; uniform float lit; uniform float size;
varying vec3 shade; varying vec2 place;
void main() {
  vec3 turned = mat3(model) * normal;
  float light = 0.72 + 0.3 * max(dot(turned, normalize(vec3(-0.35, 0.3, 0.9))), 0.0) + 0.12 * turned.z;
  shade = mix(vec3(1.0), vec3(light), lit) * color * paint;
  vec4 world = model * vec4(position, 1.0);
  place = world.xy;
  gl_Position = view * world;
  gl_PointSize = size / gl_Position.w;
}`;
const FRAGMENT = `
precision mediump float; varying vec3 shade; varying vec2 place; uniform float opacity; uniform vec4 bounds;
void main() {
  if (place.x < bounds.x || place.x > bounds.y || place.y < bounds.z || place.y > bounds.w) discard;
  gl_FragColor = vec4(shade * opacity, opacity);
}`;
const EVERYWHERE = [-1e3, 1e3, -1e3, 1e3], FLOOR = -0.42;
const SPEED = 6; // of a film that plays: so many seconds of the arm's time in one
const NOTHING = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
// What is on the table, flat along the light's direction, just above the table's top.
const SHADOW = [1, 0, 0.39, 0, 0, 1, -0.33, 0, 0, 0, 0, 0.0006];

const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
const lengths = (text) => Float32Array.from(new Int16Array(bytes(text)), (value) => value / 10000);
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / (Math.hypot(...a) || 1));
// The product of two motions, each the upper three rows of a matrix.
const after = (a, b) => a.map((_, at) => {
  const row = at - at % 4, column = at % 4;
  return a[row] * b[column] + a[row + 1] * b[4 + column] + a[row + 2] * b[8 + column] + (column === 3 ? a[row + 3] : 0);
});
// The motion (or pose) at a moment of a film, from x, y, z and a quaternion at whole moments.
const motionAt = (track, moment) => {
  const one = 7 * Math.min(Math.floor(moment), track.length / 7 - 1), other = Math.min(one + 7, track.length - 7);
  const share = moment - one / 7;
  let along = 0;
  for (let k = 3; k < 7; k++) along += track[one + k] * track[other + k];
  const mixed = [0, 1, 2, 3, 4, 5, 6].map((k) =>
    track[one + k] * (1 - share) + (k > 2 && along < 0 ? -1 : 1) * track[other + k] * share);
  return fromPose(mixed.map((value, k) => (k < 3 ? value / 10000 : value)));
};
const fromPose = ([x, y, z, ...turn]) => {
  const [a, b, c, d] = unit(turn);
  return [1 - 2 * (b * b + c * c), 2 * (a * b - c * d), 2 * (a * c + b * d), x,
    2 * (a * b + c * d), 1 - 2 * (a * a + c * c), 2 * (b * c - a * d), y,
    2 * (a * c - b * d), 2 * (b * c + a * d), 1 - 2 * (a * a + b * b), z];
};
const columns = (m) => [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, m[3], m[7], m[11], 1];

// Triangles with a normal for each of their corners, from corners (a list of points) and faces (a list of indices).
const triangles = (corners, faces) => {
  const position = [], normal = [];
  for (let at = 0; at < faces.length; at += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => [0, 1, 2].map((axis) => corners[3 * faces[at + k] + axis]));
    const up = unit(cross(minus(b, a), minus(c, a)));
    position.push(...a, ...b, ...c);
    normal.push(...up, ...up, ...up);
  }
  return { position, normal };
};
const FACES = [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7];
const box = (x0, x1, y0, y1, z0, z1) => triangles(
  [z0, z1].flatMap((z) => [x0, y0, z, x1, y0, z, x1, y1, z, x0, y1, z]), FACES);

const SEGMENTS = 28;
const cylinder = (radius, length) => {
  const position = [], normal = [], half = length / 2;
  const put = (point, up) => { position.push(...point); normal.push(...up); };
  for (let k = 0; k < SEGMENTS; k++) {
    const [a, b] = [k, k + 1].map((at) => 2 * Math.PI * at / SEGMENTS).map((turn) => [Math.cos(turn), Math.sin(turn)]);
    const at = (turn, z) => [radius * turn[0], radius * turn[1], z], side = (turn) => [turn[0], turn[1], 0];
    const corners = [[a, -half], [b, -half], [b, half], [a, -half], [b, half], [a, half]];
    for (const [turn, z] of corners) put(at(turn, z), side(turn));
    for (const [z, up, ends] of [[half, 1, [a, b]], [-half, -1, [b, a]]]) {
      for (const point of [[0, 0, z], ...ends.map((turn) => at(turn, z))]) put(point, [0, 0, up]);
    }
  }
  return { position, normal };
};
const turned = (m, v, moved) => [0, 4, 8].map((row) =>
  m[row] * v[0] + m[row + 1] * v[1] + m[row + 2] * v[2] + (moved ? m[row + 3] : 0));
// The solids of a link of the arm as one body in its frame.
const linkBody = (shapes) => {
  const all = { position: [], normal: [], paint: [] };
  shapes.forEach(({ sides, round, position: place, quaternion, color }, number) => {
    const size = 1 + 0.004 * (number % 3); // surfaces in one place would flicker
    const [x, y, z] = sides.map((side) => size * side / 2), pose = fromPose([...place, ...quaternion]);
    const solid = round ? cylinder(x, 2 * z) : box(-x, x, -y, y, -z, z);
    for (let at = 0; at < solid.position.length; at += 3) {
      all.position.push(...turned(pose, solid.position.slice(at, at + 3), true));
      all.normal.push(...turned(pose, solid.normal.slice(at, at + 3), false));
      all.paint.push(...color.map((part) => 0.1 + 0.85 * part / 255));
    }
  });
  return all;
};

class TableView {
  constructor(figure, gl, data) {
    Object.assign(this, { figure, gl, data, canvas: gl.canvas, azimuth: 0, elevation: 0.75, zoom: 1 });
    if (data.film) Object.assign(this, { azimuth: 0.95, elevation: 0.6, zoom: 1.3 }); // beside the arm, which is tall
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    this.uniform = {};
    for (const name of ["view", "model", "color", "lit", "size", "opacity", "bounds"]) {
      this.uniform[name] = gl.getUniformLocation(program, name);
    }
    this.attribute = ["position", "normal", "paint"].map((name) => gl.getAttribLocation(program, name));
    const [x0, x1, y0, y1] = data.table;
    this.middle = [(x0 + x1) / 2, (y0 + y1) / 2, data.film ? 0.14 : 0.04];
    this.reach = Math.hypot(x1 - x0, y1 - y0) / 2;
    this.ground = this.upload(box(x0, x1, y0, y1, -0.02, 0));
    this.legs = [x0 + 0.01, x1 - 0.055].flatMap((x) => [y0 + 0.01, y1 - 0.055].map((y) =>
      this.upload(box(x, x + 0.045, y, y + 0.045, FLOOR, -0.02))));
    const base = data.robot;
    this.robot = base && !data.film && this.upload(box(-0.05, 0.05, -0.05, 0.05, -0.02, 0.12));
    const beside = base && (base[0] < x0 || base[0] > x1 || base[1] < y0 || base[1] > y1);
    const around = beside && [base[0] - 0.11, base[0] + 0.11, base[1] - 0.11, base[1] + 0.11];
    this.pedestal = beside && this.upload(box(...around, FLOOR, base[2]));
    this.tracks = data.film && data.film.motions.map((track) => track && new Int16Array(bytes(track)));
    this.links = data.film ? Object.entries(data.film.links).map(([link, track]) => ({
      track: new Int16Array(bytes(track)),
      body: this.upload(linkBody(data.film.shapes.filter((shape) => String(shape.link) === link))),
    })) : [];
    this.moment = 0;
    this.bodies = data.objects.map((object) => this.upload(object.points
      ? { position: lengths(object.points), paint: Float32Array.from(new Uint8Array(bytes(object.colors)), (c) => c / 255) }
      : triangles(lengths(object.vertices), new Uint16Array(bytes(object.faces)))));
    this.colors = data.objects.map((object) => object.color.map((part) => part / 255));
  }

  upload(parts) {
    const gl = this.gl;
    const buffers = ["position", "normal", "paint"].map((name) => {
      if (!parts[name]) return null;
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(parts[name]), gl.STATIC_DRAW);
      return buffer;
    });
    return { buffers, count: parts.position.length / 3, kind: parts.normal ? gl.TRIANGLES : gl.POINTS };
  }

  solid(body, color, motion, opacity = 1, flat = false) {
    const gl = this.gl;
    const plain = [[0, 0, 0], [0, 0, 1], [1, 1, 1]];
    body.buffers.forEach((buffer, at) => {
      const place = this.attribute[at];
      if (buffer && !(flat && at === 2)) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
      } else {
        gl.disableVertexAttribArray(place);
        gl.vertexAttrib3f(place, ...plain[at]);
      }
    });
    gl.uniformMatrix4fv(this.uniform.model, false, columns(motion));
    gl.uniform3f(this.uniform.color, ...(body.buffers[2] && !flat ? [1, 1, 1] : color));
    gl.uniform1f(this.uniform.lit, body.buffers[1] && !flat ? 1 : 0);
    gl.uniform1f(this.uniform.opacity, opacity);
    gl.drawArrays(body.kind, 0, body.count);
  }

  matrix() {
    const wide = this.canvas.width / this.canvas.height;
    const lens = 1 / Math.tan(0.33), distance = this.reach * 0.85 * lens * Math.max(1, 1.25 / wide) * this.zoom;
    const back = [-Math.cos(this.azimuth) * Math.cos(this.elevation), -Math.sin(this.azimuth) * Math.cos(this.elevation),
      Math.sin(this.elevation)];
    const right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    const eye = this.middle.map((value, axis) => value + distance * back[axis]);
    const [near, far] = [distance / 10, distance + 5], depth = (far + near) / (near - far);
    const rows = [right.map((v) => v * lens / wide), up.map((v) => v * lens), back.map((v) => v * depth),
      back.map((v) => -v)];
    const ends = [-dot(rows[0], eye), -dot(rows[1], eye), -dot(rows[2], eye) + 2 * far * near / (near - far),
      dot(back, eye)];
    return [0, 1, 2].flatMap((axis) => rows.map((row) => row[axis])).concat(ends);
  }

  draw() {
    this.waiting = false;
    const gl = this.gl, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((part) => Math.round(part * ratio));
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    gl.viewport(0, 0, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.uniformMatrix4fv(this.uniform.view, false, this.matrix());
    gl.uniform1f(this.uniform.size, 0.009 * height);
    const motions = this.continuous
      ? this.tracks.map((track) => (track ? motionAt(track, this.moment) : NOTHING))
      : this.frame.motions.map((motion) => motion || NOTHING);
    gl.uniform4f(this.uniform.bounds, ...EVERYWHERE);
    this.solid(this.ground, [0.86, 0.77, 0.64], NOTHING);
    for (const leg of this.legs) this.solid(leg, [0.75, 0.65, 0.53], NOTHING);
    if (this.pedestal) this.solid(this.pedestal, [0.62, 0.64, 0.68], NOTHING);
    const arm = this.links.map(({ track }) => motionAt(track, this.moment));
    this.links.forEach(({ body }, at) => this.solid(body, [1, 1, 1], arm[at]));
    const base = this.data.robot;
    if (this.robot) this.solid(this.robot, [0.3, 0.32, 0.36], [1, 0, 0, base[0], 0, 1, 0, base[1], 0, 0, 1, base[2]]);
    this.bodies.forEach((body, at) => this.solid(body, this.colors[at], motions[at]));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.enable(gl.STENCIL_TEST); // two shadows over each other are as dark as one
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.uniform4f(this.uniform.bounds, ...this.data.table); // where there is a table to fall on
    this.bodies.forEach((body, at) => this.solid(body, [0, 0, 0], after(SHADOW, motions[at]), 0.22, true));
    this.links.forEach(({ body }, at) => this.solid(body, [0, 0, 0], after(SHADOW, arm[at]), 0.22, true));
    gl.uniform4f(this.uniform.bounds, ...EVERYWHERE);
    gl.disable(gl.STENCIL_TEST);
    if (this.view.name === "goal") { // and pale, where everything comes from
      this.bodies.forEach((body, at) => {
        if (this.frame.motions[at]) this.solid(body, this.colors[at], NOTHING, 0.22);
      });
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  redraw() {
    if (!this.waiting) requestAnimationFrame(() => this.draw());
    this.waiting = true;
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, 0.05), 1.55);
    this.redraw();
  }

  nearer(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.2), 3);
    this.redraw();
  }
}

const controls = (view) => {
  const { figure, canvas, data } = view;
  const slider = figure.querySelector("input"), told = figure.querySelector("output");
  const buttons = [...figure.querySelectorAll("span button")], play = figure.querySelector("button.play");
  const film = data.film, last = film ? view.links[0].track.length / 7 - 1 : 0;
  let playing = false;
  const see = (moment) => { // of the film, between its whole moments too
    view.moment = moment;
    slider.value = moment;
    const mark = film.marks.filter(([at]) => at <= moment + 1e-6).pop();
    const seconds = Math.round(moment * film.every) + " s of " + Math.round(last * film.every) + " s";
    told.textContent = mark ? mark[1] + ", " + seconds : seconds;
    view.redraw();
  };
  const pause = () => {
    playing = false;
    play.textContent = "▶";
    play.setAttribute("aria-label", "play");
  };
  play.onclick = () => {
    if (playing) return pause();
    if (view.moment >= last) see(0);
    playing = true;
    play.textContent = "⏸";
    play.setAttribute("aria-label", "pause");
    let before = performance.now();
    const next = (now) => {
      if (!playing) return;
      see(Math.min(view.moment + SPEED * (now - before) / 1000 / film.every, last));
      before = now;
      if (view.moment < last) requestAnimationFrame(next); else pause();
    };
    requestAnimationFrame(next);
  };
  const show = (place) => {
    view.frame = view.view.frames[place];
    slider.value = place;
    const count = view.view.frames.length;
    told.textContent = view.frame.caption + (count > 1 ? " (" + (place + 1) + " of " + count + ")" : "");
    view.redraw();
  };
  const choose = (name) => {
    view.view = data.views.find((each) => each.name === name);
    view.continuous = Boolean(film) && name === "build";
    pause();
    play.hidden = !view.continuous;
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.value === name));
    slider.step = view.continuous ? "any" : "1";
    slider.max = view.continuous ? last : view.view.frames.length - 1;
    slider.hidden = !view.continuous && view.view.frames.length < 2;
    if (view.continuous) return see(last);
    view.moment = 0; // the arm as it stood before
    show(view.view.start);
  };
  for (const button of buttons) button.onclick = () => choose(button.value);
  slider.oninput = () => {
    if (!view.continuous) return show(Number(slider.value));
    pause();
    see(Number(slider.value));
  };
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y) || 1;
  };
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  };
  canvas.onpointermove = (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const apart = fingers.size === 2 ? spread() : 0;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (apart) view.nearer(apart / spread());
    else view.turn((event.clientX - before.x) / 150, (event.clientY - before.y) / 150);
  };
  canvas.onpointerup = canvas.onpointercancel = (event) => fingers.delete(event.pointerId);
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return; // until it was pressed, the wheel moves the page
    event.preventDefault();
    view.nearer(Math.exp(event.deltaY / 800));
  }, { passive: false });
  const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
  canvas.onkeydown = (event) => {
    if (keys[event.key]) view.turn(...keys[event.key]);
    else if (event.key === "+" || event.key === "-") view.nearer(event.key === "+" ? 0.9 : 1.1);
    else return;
    event.preventDefault();
  };
  new ResizeObserver(() => view.redraw()).observe(canvas);
  choose(data.views[data.views.length - 1].name);
};

for (const figure of document.querySelectorAll("figure.table-view")) {
  const canvas = figure.querySelector("canvas");
  const gl = canvas.getContext("webgl", { antialias: true, stencil: true });
  if (!gl) continue;
  figure.closest("section").hidden = false;
  controls(new TableView(figure, gl, JSON.parse(figure.querySelector("script").textContent)));
}
