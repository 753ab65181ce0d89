// Lays out the conversation: each turn begins with what was said; a title opens a card for what follows it.
import { element } from "./elements.js";

const MOST_ENTRIES = 600;
const NEAR_END = 60; // px: who is that near the end follows it

export class Transcript {
  constructor(log) {
    this.log = log;
    this.follows = true;
    this.scrolled = 0;
    this.clear();
    log.addEventListener("scroll", () => this._scrolled());
    new ResizeObserver(() => this._resized()).observe(log);
  }

  clear() {
    this.log.replaceChildren();
    this.card = null;
  }

  // An entry, as `agent/live_view/transcript.py` sends it.
  add(entry) {
    const made = MADE[entry.type]?.(entry);
    if (!made) return;
    // The next turn begins: an error of an earlier one is history.
    if (entry.type === "said") for (const error of this.log.querySelectorAll(":scope > .red")) error.className = "dim";
    const alone = ["said", "question"].includes(entry.type) || entry.style === "red" || (!this.card && entry.style === "dim");
    if (alone) {
      this.card = null;
      this.log.append(made);
    } else {
      if (entry.type === "title" || !this.card) this.log.append((this.card = element("section", "card")));
      if (entry.type === "check") this._checks().append(made);
      else this.card.append(made);
    }
    if (this.card?.childElementCount > MOST_ENTRIES) this.card.children[1].remove();
    while (this.log.childElementCount > MOST_ENTRIES) this.log.firstElementChild.remove();
    if (entry.type === "said") this.follows = true;
    this.follow();
  }

  // The table of checks at the end of the card.
  _checks() {
    if (!this.card.lastElementChild?.matches("table.checks")) this.card.append(element("table", "checks", element("tbody")));
    return this.card.lastElementChild.firstElementChild;
  }

  // Keeps the last entry in sight, unless someone reads further up.
  follow() {
    if (this.follows) this.log.scrollTop = this.log.scrollHeight;
  }

  _resized() {
    this.size = [this.log.clientWidth, this.log.clientHeight].join();
    this.follow();
  }

  _scrolled() {
    const log = this.log;
    if ([log.clientWidth, log.clientHeight].join() !== this.size) return; // nobody scrolled: the log was resized
    const atEnd = log.scrollHeight - log.scrollTop - log.clientHeight < NEAR_END;
    // Only who scrolls up stops it: entries may have come since it was moved to the end.
    if (atEnd || log.scrollTop < this.scrolled) this.follows = atEnd;
    this.scrolled = log.scrollTop;
  }
}

const MADE = {
  said: ({ text }) => element("p", "said", text),
  title: ({ text, took }) => element("h2", "", text, element("small", "", took)),
  line: ({ text, style }) => element("p", style, text),
  rows: ({ rows }) => element("table", "", element("tbody", "", ...rows.map(row))),
  check: ({ passed, text }) => row([passed ? "passed" : "failed", text], passed ? "passed" : "failed"),
  question: ({ text, options }) => {
    const [said, ...shown] = text.split("\n").reverse(); // lines before the last show what it is about
    const picture = shown.length ? [element("pre", "", shown.reverse().join("\n"))] : [];
    return element("section", "card question", ...picture, element("p", "bold", said), element("ol", "", ...options.map((one) => element("li", "", one))));
  },
};

function row(cells, className = "") {
  return element("tr", className, ...cells.map((cell, place) => {
    const made = element(place ? "td" : "th", "", cell);
    if (!place) made.scope = "row";
    return made;
  }));
}
