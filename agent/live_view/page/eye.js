// From where the table is seen, and how the mouse, fingers and keys change that.
import { cross, lookAt, multiply, normalized, perspective, plus } from "./matrices.js";

export const ANGLE = 0.72; // of view, radians
const NEAR = 0.02, FAR = 20;
const HIGH = 0.15; // m above the table that are in sight, too
const MARGIN = 1.03;
const VIEWS = { robot: [Math.PI, 0.95], opposite: [0, 0.85], above: [Math.PI, 1.53] };

export class Eye {
  // `changed` is called when the table has to be drawn again.
  constructor(changed) {
    this.changed = changed;
    this.table = [0.18, 0.72, -0.45, 0.45];
    this.view("robot");
  }

  // Sees the whole table from one of its sides.
  view(name) {
    [this.azimuth, this.elevation] = VIEWS[name];
    this.zoom = 1;
    this.fitted = 0; // the shape of the picture in which the table was fitted; none yet
    this.changed();
  }

  // The matrix that projects the world on a picture of this size.
  project(width, height) {
    const scale = Math.tan(ANGLE / 2), aspect = width / height;
    if (this.zoom === 1 && this.fitted !== aspect) this._fit(scale, aspect);
    const distance = this.zoom * this.farEnough;
    this.perPixel = (distance * scale * 2) / height;
    const up = this.elevation > 1.52 ? [-Math.cos(this.azimuth), -Math.sin(this.azimuth), 0] : [0, 0, 1];
    const eye = plus(this.target, this._direction(), distance);
    return multiply(perspective(ANGLE, aspect, NEAR, FAR), lookAt(eye, this.target, up));
  }

  // Looks from as far at such a place that what stands on the table fills the picture.
  _fit(scale, aspect) {
    const back = this._direction(), [right, above] = this._across(back), [x0, x1, y0, y1] = this.table;
    const along = (axis, place) => axis[0] * place[0] + axis[1] * place[1] + axis[2] * place[2];
    this.target = [(x0 + x1) / 2, (y0 + y1) / 2, 0];
    for (let round = 0; round < 4; round++) {
      const corners = [];
      for (const x of [x0, x1]) for (const y of [y0, y1]) for (const z of [0, HIGH]) corners.push(plus([x, y, z], this.target, -1));
      this.farEnough = MARGIN * Math.max(...corners.map((one) =>
        along(back, one) + Math.max(Math.abs(along(right, one)) / aspect, Math.abs(along(above, one))) / scale));
      const heights = corners.map((one) => along(above, one) / (this.farEnough - along(back, one)));
      this.target = plus(this.target, above, ((Math.max(...heights) + Math.min(...heights)) / 2) * this.farEnough);
    }
    this.fitted = aspect;
  }

  _direction() {
    const flat = Math.cos(this.elevation);
    return [flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth), Math.sin(this.elevation)];
  }

  _across(back) {
    const right = normalized(cross([0, 0, 1], back));
    return [right, cross(back, right)];
  }

  turn(x, y) {
    this.azimuth -= x;
    this.elevation = Math.min(1.53, Math.max(-0.1, this.elevation + y));
    this.changed();
  }

  move(x, y) {
    const [right, above] = this._across(this._direction());
    const moved = plus(plus(this.target, right, -x * this.perPixel), above, y * this.perPixel);
    this.target = moved.map((value) => Math.min(2, Math.max(-2, value)));
    this.changed();
  }

  approach(factor) {
    this.zoom = Math.min(4, Math.max(0.15, this.zoom * factor));
    this.changed();
  }
}

// Lets the mouse, fingers and keys on the canvas move the eye. `grab` is asked first: where it returns a function, the
// pointer drags something else, and the function gets the events of its moves.
export function listen(canvas, eye, grab) {
  const pressed = new Map();
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    drag = pressed.size ? null : (grab(event) ?? null);
    pressed.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pressed.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointermove", (event) => {
    const before = pressed.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [x, y] = [now[0] - before[0], now[1] - before[1]];
    if (drag && pressed.size === 1) drag(event, x, y);
    else if (pressed.size === 2) {
      const other = [...pressed].find(([pointer]) => pointer !== event.pointerId)[1];
      const apart = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
      eye.approach(apart(before) / apart(now));
      eye.move(x / 2, y / 2);
    } else if (event.buttons & 2 || event.shiftKey) eye.move(x, y);
    else eye.turn(x / 180, y / 180);
    pressed.set(event.pointerId, now);
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    eye.approach(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) / 600));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => eye.turn(0.1, 0), ArrowRight: () => eye.turn(-0.1, 0), ArrowUp: () => eye.turn(0, 0.1),
    ArrowDown: () => eye.turn(0, -0.1), "+": () => eye.approach(0.9), "-": () => eye.approach(1.1),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
}
