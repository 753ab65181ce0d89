// Lets the driver drag objects as ghosts, and say "like this": the arrangement becomes the example.
import { at } from "./elements.js";
import { fromPose, multiply, transformed } from "./matrices.js";

const REACH = 30; // px around an object's middle in which it is grabbed
const SMALL = 0.01; // m, to find out how places on the table move on the canvas
const PER_PIXEL = Math.PI / 180; // of a turn
const RAISED = 0.01; // m: a proposal that stacks objects is not taken over, because all are arranged on the table

export class Arranging {
  // `scene` shows the ghosts, or is null; `finish` gets the line that says where they are; `left` is called at the end.
  constructor(scene, finish, left) {
    Object.assign(this, { scene, finish, left, places: null, allowed: false });
    at("arrange").addEventListener("click", () => (this.places ? this.leave() : this.begin()));
    at("like-this").addEventListener("click", () => {
      const line = this.line();
      this.leave();
      this.finish(line);
    });
  }

  // Begins with the ghosts of a proposal, or with none.
  begin() {
    const { scene } = this, ghosts = scene.ghosts.filter((ghost) => scene.objects.has(ghost.name));
    const found = ghosts.map((ghost) => [ghost.name, this._taken(ghost)]);
    this.places = new Map();
    scene.clearGhosts();
    if (found.every(([, place]) => Math.abs(place.raised) < RAISED)) for (const [name, place] of found) this._put(name, place);
    scene.grab = (event) => this._grab(event);
    this._refresh();
  }

  leave() {
    if (!this.places) return;
    this.places = null;
    this.scene.grab = null;
    this.scene.clearGhosts();
    this.left();
    this._refresh();
  }

  // Says whether the driver may arrange; where not, what was begun ends.
  allow(allowed) {
    this.allowed = allowed && Boolean(this.scene);
    if (!allowed) this.leave();
    this._refresh();
  }

  _refresh() {
    at("arrange").hidden = !this.allowed;
    at("arrange").textContent = this.places ? "cancel" : "arrange";
    at("like-this").hidden = at("how-to-arrange").hidden = !this.places;
    at("like-this").disabled = !this.places || this.places.size < 2;
  }

  // The command that makes the arrangement the example.
  line() {
    const told = [...this.places].map(([name, { x, y, turn }]) =>
      `${name}: ${x.toFixed(3)}, ${y.toFixed(3)}, ${Math.round((turn * 180) / Math.PI)}`);
    return `/arrange ${told.join("; ")}`;
  }

  // Where a ghost is, and how it is turned against how its object stands now.
  _taken({ name, model }) {
    const object = this.scene.objects.get(name), now = fromPose(object.moving.now);
    const [x, y, z] = transformed(model, object.middle);
    return { x, y, turn: headingOf(model) - headingOf(now), raised: z - transformed(now, object.middle)[2] };
  }

  _put(name, { x, y, turn }) {
    const object = this.scene.objects.get(name), now = fromPose(object.moving.now);
    const [mx, my] = transformed(now, object.middle), c = Math.cos(turn), s = Math.sin(turn);
    const motion = [c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, x - c * mx + s * my, y - s * mx - c * my, 0, 1];
    this.places.set(name, { x, y, turn });
    this.scene.setGhost(name, multiply(motion, now));
    this._refresh();
  }

  // Lets the pointer drag the nearest ghost, or an object that has none yet; where nothing is near, it turns the view.
  _grab(event) {
    const box = this.scene.canvas.getBoundingClientRect();
    const pointer = [event.clientX - box.left, event.clientY - box.top];
    const near = [...this.scene.objects].map(([name, object]) => {
      const [x, y, z] = transformed(fromPose(object.moving.now), object.middle);
      const place = this.places.get(name) ?? { x, y, turn: 0 };
      const seen = this.scene.seenAt([place.x, place.y, z]);
      return { name, place, z, off: seen ? Math.hypot(seen[0] - pointer[0], seen[1] - pointer[1]) : Infinity };
    }).sort((one, other) => one.off - other.off)[0];
    if (!near || near.off > REACH) return null;
    return (moved, right, down) => {
      const { x, y, turn } = this.places.get(near.name) ?? near.place;
      if (moved.shiftKey || moved.buttons & 2) this._put(near.name, { x, y, turn: turn + right * PER_PIXEL });
      else {
        const [dx, dy] = this._onTable([x, y, near.z], right, down);
        this._put(near.name, { x: this._within(x + dx, 0), y: this._within(y + dy, 2), turn });
      }
    };
  }

  // By how much a place moves on the table while the pointer moves by pixels.
  _onTable([x, y, z], right, down) {
    const here = this.scene.seenAt([x, y, z]);
    const [ax, ay] = this.scene.seenAt([x + SMALL, y, z]).map((value, index) => (value - here[index]) / SMALL);
    const [bx, by] = this.scene.seenAt([x, y + SMALL, z]).map((value, index) => (value - here[index]) / SMALL);
    const area = ax * by - bx * ay;
    return Math.abs(area) < 1 ? [0, 0] : [(right * by - bx * down) / area, (ax * down - right * ay) / area];
  }

  _within(value, from) {
    const [low, high] = this.scene.eye.table.slice(from, from + 2);
    return Math.min(high, Math.max(low, value));
  }
}

function headingOf(matrix) {
  return Math.atan2(matrix[1], matrix[0]);
}
