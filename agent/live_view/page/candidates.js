// The proposed arrangements: small pictures of the best ones, and a bar that steps through all of them.
import { at, button, element } from "./elements.js";
import { floats } from "./solids.js";
import { drawFromAbove, hullFromAbove } from "./thumbnails.js";

const MOST_PICTURES = 8;
const PICTURE = [96, 58]; // px, as wide as the table is beside its depth

export class Candidates {
  // `scene` draws the goal as ghosts, or is null; `choose` makes a rank the one to build, where the driver may.
  constructor(scene, choose) {
    this.scene = scene;
    this.choose = choose;
    this.clear();
    at("previous").addEventListener("click", () => this.show(this.rank - 1));
    at("next").addEventListener("click", () => this.show(this.rank + 1));
    at("choose").addEventListener("click", () => choose(this.rank));
  }

  clear() {
    Object.assign(this, { all: null, rank: 0, chosen: 0, mayChoose: false, building: false, table: null, clouds: new Map() });
    at("thumbnails").replaceChildren();
    this.refresh();
  }

  setScene({ table, objects }) {
    this.set({ count: 0 });
    this.table = table;
    this.clouds = new Map(objects.map((one) => [one.name, { points: floats(one.points), color: one.color }]));
  }

  set(message) {
    this.all = message.count ? { ...message, motions: floats(message.motions) } : null;
    this.chosen = this.rank = 0;
    this.scene?.clearGhosts();
    this._drawPictures();
    this.show(1);
  }

  setChosen(rank) {
    this.chosen = rank;
    this.show(rank);
  }

  // Shows one arrangement; nothing is chosen by it.
  show(rank) {
    if (this.all) {
      this.rank = Math.min(this.all.count, Math.max(1, rank));
      this.scene?.setGhosts(this.all.names, this.all.motions, this.rank - 1);
    }
    this.refresh();
  }

  // A sample of the model while it is denoising.
  preview(message) {
    this.scene?.setGhosts(message.names, floats(message.motions), 0);
    at("candidates").hidden = false;
    at("rank").textContent = `denoising: step ${message.step} of ${message.steps}`;
    for (const id of ["previous", "next", "choose"]) at(id).hidden = true;
  }

  // What may be done: `mayChoose` where the driver is asked about a proposal, `building` while the arm is at work.
  allow(mayChoose, building) {
    if (building && !this.building && this.all) this.show(this.chosen); // what is built, not what was looked at
    Object.assign(this, { mayChoose, building });
    this.refresh();
  }

  refresh() {
    const { all, rank, chosen } = this;
    at("candidates").hidden = !all || this.building;
    at("thumbnails").hidden = !all || this.building;
    at("choose").hidden = !(this.mayChoose && all && rank !== chosen);
    if (!all) return;
    for (const id of ["previous", "next"]) at(id).hidden = false;
    at("previous").disabled = rank <= 1;
    at("next").disabled = rank >= all.count;
    const parts = [`${rank} of ${all.count}`, score(all, rank), rank === chosen ? "chosen" : all.words[rank - 1]];
    at("rank").textContent = parts.filter(Boolean).join(", ");
    for (const one of at("thumbnails").children) {
      one.setAttribute("aria-current", String(Number(one.dataset.rank) === rank));
      one.classList.toggle("chosen", Number(one.dataset.rank) === chosen);
    }
  }

  _drawPictures() {
    const count = this.all && this.table ? Math.min(MOST_PICTURES, this.all.count) : 0;
    at("thumbnails").replaceChildren(...Array.from({ length: count }, (_, place) => this._picture(place)));
  }

  _picture(place) {
    const rank = place + 1, canvas = element("canvas");
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    [canvas.width, canvas.height] = PICTURE.map((side) => Math.round(side * ratio));
    drawFromAbove(canvas, this.table, this._outlines(place));
    const made = button("", () => (this.mayChoose && rank !== this.chosen ? this.choose(rank) : this.show(rank)));
    made.append(canvas, element("span", "", [String(rank), score(this.all, rank).replace("score ", "")].filter(Boolean).join(" · ")));
    made.dataset.rank = rank;
    made.title = this.all.words[place];
    made.setAttribute("aria-label", ["arrangement " + rank, score(this.all, rank), this.all.words[place]].filter(Boolean).join(", "));
    return made;
  }

  _outlines(place) {
    const { names, motions } = this.all, size = 12;
    const still = [...this.clouds.keys()].filter((name) => !names.includes(name));
    const moved = names.filter((name) => this.clouds.has(name));
    const outline = (name, motion) => {
      const { points, color } = this.clouds.get(name);
      return { color, takesPart: Boolean(motion), hull: hullFromAbove(points, motion) };
    };
    const motion = (name) => {
      const from = size * (place * names.length + names.indexOf(name));
      return motions.subarray(from, from + size);
    };
    return [...still.map((name) => outline(name)), ...moved.map((name) => outline(name, motion(name)))];
  }
}

function score(all, rank) {
  const value = all.scores[rank - 1];
  return value === null ? "" : `score ${value.toFixed(2)}`;
}
