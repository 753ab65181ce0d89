// Connects the page: shows what the agent tells, and sends what the driver types. Nothing is decided here.
import { Scene3D, floats } from "./scene_3d.js";

const MOST_LINES = 600;
const SLOWEST_RETRY = 15000; // ms
const at = (id) => document.getElementById(id);

const state = { follows: true, scrolled: 0, role: "", prompt: null, choosing: false, busy: "", candidates: null, rank: 0, chosen: 0, socket: null, retry: 500 };
let scene = null;
try {
  scene = new Scene3D(at("scene"), at("labels"));
} catch {
  at("no-webgl").hidden = false;
  at("scene").hidden = true;
}

// --- what the agent tells --------------------------------------------------------------------

const told = {
  text({ parts }) {
    const log = at("log");
    const line = document.createElement("p");
    const said = parts.length > 0 && parts[0][1].includes("bold") && parts[0][0].startsWith("> ");
    line.classList.toggle("said", said);
    parts.forEach(([text, names], place) => {
      const piece = document.createElement("span");
      if (names && !said) piece.className = names;
      piece.textContent = said && place === 0 ? text.slice(2) : text;
      line.append(piece);
    });
    if (!parts.length && !log.lastElementChild?.textContent) return; // one empty line at a time
    log.append(line);
    while (log.childElementCount > MOST_LINES) log.firstElementChild.remove();
    if (said) state.follows = true;
    follow();
  },
  roles({ driver, viewers }) {
    state.role = driver;
    const who = { you: "you drive", other: "you watch; another page drives", nobody: "you watch; nobody drives", terminal: "you watch; the terminal drives" };
    at("role").textContent = who[driver] + (viewers > 1 ? ` (${viewers} pages)` : "");
    at("take-over").hidden = !(driver === "other" || driver === "nobody");
    at("take-over").textContent = driver === "nobody" ? "drive" : "take over";
    showInput();
  },
  busy({ what }) {
    state.busy = what;
    showInput();
  },
  asking({ prompt, choices, choosing, stopping }) {
    Object.assign(state, { prompt, choosing, stopping });
    if (!prompt && state.candidates) showRank(state.chosen); // what is built is what was chosen, not what was looked at
    at("choices").replaceChildren(...choices.map(({ label, line }) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = label;
      button.addEventListener("click", () => say(line));
      return button;
    }));
    at("refused").hidden = true;
    showInput();
  },
  refused({ reason }) {
    at("refused").textContent = reason;
    at("refused").hidden = false;
  },
  progress({ stage, placed, motions, outcome }) {
    state.stage = stage;
    state.outcome = outcome;
    const bar = at("bar");
    bar.hidden = !motions;
    bar.max = motions || 1;
    bar.value = placed;
    bar.title = `${placed} of ${motions}`;
    state.motions = motions;
    showInput();
  },
  scene(message) {
    Object.assign(state, { candidates: null, rank: 0, chosen: 0 });
    scene?.setScene(message);
    showCandidates();
  },
  arm: (message) => scene?.setArm(message),
  poses: (message) => scene?.setPoses(message),
  candidates(message) {
    state.candidates = message.count ? { ...message, motions: floats(message.motions) } : null;
    if (!message.count) scene?.clearGhosts();
    showRank(1);
  },
  chosen({ rank }) {
    state.chosen = rank;
    showRank(rank);
  },
  preview(message) {
    if (message.scene !== scene?.number) return;
    scene.setGhosts(message.names, floats(message.motions), 0);
    at("candidates").hidden = false;
    at("rank").textContent = `denoising: step ${message.step} of ${message.steps}`;
    for (const id of ["previous", "next", "choose"]) at(id).hidden = true;
  },
  picture({ caption, jpeg }) {
    at("picture").src = `data:image/jpeg;base64,${jpeg}`;
    at("picture").alt = at("caption").textContent = caption;
    at("camera").hidden = false;
  },
};

// Keeps the last line in sight, unless someone reads further up.
function follow() {
  if (state.follows) at("log").scrollTop = at("log").scrollHeight;
}

at("log").addEventListener("scroll", () => {
  const log = at("log");
  const atEnd = log.scrollHeight - log.scrollTop - log.clientHeight < 60;
  // Only who scrolls up stops it: lines may have come since it was moved to the end.
  if (atEnd || log.scrollTop < state.scrolled) state.follows = atEnd;
  state.scrolled = log.scrollTop;
});
new ResizeObserver(follow).observe(at("log"));

function showInput() {
  const drives = state.role === "you", asked = Boolean(state.prompt), open = state.socket?.readyState === WebSocket.OPEN;
  at("form").hidden = !drives;
  at("choices").hidden = !drives || !asked;
  at("line").disabled = at("send").disabled = !open;
  at("line").placeholder = asked ? (state.choosing ? "build it? or say what to change" : "say what to build, or ask") : "one moment";
  at("stop").hidden = !drives || asked || state.prompt === null;
  at("stop").disabled = Boolean(state.stopping);
  const counted = state.motions ? ` (${at("bar").title})` : "";
  const stage = state.stage || "";
  at("stage-text").textContent = state.stopping ? "stopping" : asked || state.motions || !state.busy ? stage + counted : state.busy;
  at("stage-text").className = state.outcome || "";
  at("choose").hidden = !(drives && state.choosing && state.candidates && state.rank !== state.chosen);
}

function showRank(rank) {
  const all = state.candidates;
  if (all) {
    state.rank = Math.min(all.count, Math.max(1, rank));
    scene?.setGhosts(all.names, all.motions, state.rank - 1);
  }
  showCandidates();
}

function showCandidates() {
  const all = state.candidates;
  at("candidates").hidden = !all;
  if (all) {
    for (const id of ["previous", "next"]) at(id).hidden = false;
    at("previous").disabled = state.rank <= 1;
    at("next").disabled = state.rank >= all.count;
    const score = all.scores[state.rank - 1];
    const parts = [`${state.rank} of ${all.count}`];
    if (score !== null) parts.push(`score ${score.toFixed(2)}`);
    parts.push(state.rank === state.chosen ? "chosen" : all.words[state.rank - 1]);
    at("rank").textContent = parts.join(", ");
  }
  showInput();
}

// --- what the driver does --------------------------------------------------------------------

function send(message) {
  if (state.socket?.readyState === WebSocket.OPEN) state.socket.send(JSON.stringify(message));
}

function say(line) {
  send({ kind: "line", line });
}

at("form").addEventListener("submit", (event) => {
  event.preventDefault();
  const line = at("line").value.trim();
  if (!line) return;
  if (!state.prompt) {
    told.refused({ reason: "the agent is at work; wait, or stop it" });
    return;
  }
  say(line);
  at("line").value = "";
});
at("stop").addEventListener("click", () => send({ kind: "stop" }));
at("take-over").addEventListener("click", () => send({ kind: "take_over" }));
at("choose").addEventListener("click", () => say(`/choose ${state.rank}`));
at("previous").addEventListener("click", () => showRank(state.rank - 1));
at("next").addEventListener("click", () => showRank(state.rank + 1));
at("enlarge").addEventListener("click", () => at("camera").classList.toggle("large"));
for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => scene?.view(button.dataset.view));
toggle("names", (shown) => (at("labels").hidden = !shown));
toggle("ghosts", (shown) => scene && (scene.showsGhosts = shown));
toggle("arm", (shown) => scene && (scene.showsArm = shown));

function toggle(id, show) {
  at(id).addEventListener("click", () => {
    const shown = at(id).getAttribute("aria-pressed") !== "true";
    at(id).setAttribute("aria-pressed", String(shown));
    show(shown);
    scene?.redraw();
  });
}

// --- the connection --------------------------------------------------------------------------

function connect(again) {
  const address = new URL("/socket", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  // A page that comes back does not take an empty seat, unless it was its own.
  if (again && state.role !== "you") address.search = "again";
  const socket = new WebSocket(address);
  state.socket = socket;
  socket.addEventListener("open", () => {
    state.retry = 500;
    at("log").replaceChildren();
    showInput();
  });
  socket.addEventListener("message", (event) => {
    const message = JSON.parse(event.data);
    told[message.kind]?.(message);
  });
  socket.addEventListener("close", (event) => {
    at("role").textContent = event.code === 1001 ? "structagent has ended; this is the last state" : "the connection is lost; trying again";
    at("take-over").hidden = true;
    showInput();
    setTimeout(() => connect(true), state.retry);
    state.retry = Math.min(SLOWEST_RETRY, 2 * state.retry);
  });
}

window.structagent = { state, scene };
connect(false);
