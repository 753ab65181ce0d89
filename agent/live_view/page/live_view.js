// Connects the page: shows what the agent tells, and sends what the driver types. Nothing is decided here.
import { Arranging } from "./arranging.js";
import { Candidates } from "./candidates.js";
import { at, button, toggle } from "./elements.js";
import { Scene3D } from "./scene_3d.js";
import { Transcript } from "./transcript.js";

const FIRST_RETRY = 500, SLOWEST_RETRY = 4000; // ms
const ENDED = 1001; // the code with which structagent closes its connections

let scene = null;
try {
  scene = new Scene3D(at("scene"), at("labels"));
} catch {
  at("no-webgl").hidden = false;
  at("scene").hidden = true;
}
const transcript = new Transcript(at("log"));
const candidates = new Candidates(scene, (rank) => say(`/choose ${rank}`));
const arranging = new Arranging(scene, say, () => candidates.show(candidates.rank));
// What the agent has told, as far as controls follow from it.
const NOTHING = { prompt: null, choosing: false, stopping: false, listening: false, busy: "", stage: "", placed: 0, motions: 0, outcome: "" };
const state = { role: "", start: "", socket: null, retry: FIRST_RETRY, ...NOTHING };

// --- what the agent tells --------------------------------------------------------------------

const told = {
  // The first message of each connection. Whatever else is known is told again after it.
  hello({ start }) {
    Object.assign(state, NOTHING);
    candidates.clear();
    transcript.clear();
    at("choices").replaceChildren();
    at("refused").hidden = true;
    if (state.start && state.start !== start) {
      scene?.clear();
      at("camera").hidden = true;
      transcript.add({ type: "line", style: "dim", text: "structagent was started again; what was said and proposed before is gone" });
    }
    state.start = start;
    refresh();
  },
  entry(entry) {
    if (entry.type === "said") at("refused").hidden = true; // the next turn begins
    transcript.add(entry);
  },
  roles({ driver, viewers }) {
    state.role = driver;
    const who = { you: "you drive", other: "you watch; another page drives", nobody: "you watch; nobody drives", terminal: "you watch; the terminal drives" };
    at("role").textContent = who[driver] + (viewers > 1 ? ` (${viewers} pages)` : "");
    at("take-over").textContent = driver === "nobody" ? "drive" : "take over";
    refresh();
  },
  busy({ what }) {
    state.busy = what;
    refresh();
  },
  asking({ prompt, choices, choosing, stopping, listening }) {
    Object.assign(state, { prompt, choosing, stopping, listening });
    at("choices").replaceChildren(...choices.map(({ label, line }) => button(label, () => answer(line))));
    at("refused").hidden = true;
    refresh();
  },
  refused({ reason }) {
    at("refused").textContent = reason;
    at("refused").hidden = false;
  },
  progress({ stage, placed, motions, outcome }) {
    Object.assign(state, { stage, placed, motions, outcome });
    refresh();
  },
  scene(message) {
    arranging.leave();
    scene?.setScene(message);
    candidates.setScene(message);
  },
  arm: (message) => scene?.setArm(message),
  poses: (message) => scene?.setPoses(message),
  candidates: (message) => candidates.set(message),
  chosen: ({ rank }) => candidates.setChosen(rank),
  preview(message) {
    if (message.scene === scene?.number) candidates.preview(message);
  },
  picture({ caption, jpeg }) {
    at("picture").src = `data:image/jpeg;base64,${jpeg}`;
    at("picture").alt = at("picture").title = at("caption").textContent = caption;
    at("camera").hidden = false;
  },
};

// Shows and hides the controls, as the state is.
function refresh() {
  const open = state.socket?.readyState === WebSocket.OPEN;
  const drives = open && state.role === "you", asked = Boolean(state.prompt);
  const building = Boolean(state.motions) && !state.outcome && !asked;
  at("take-over").hidden = !open || !["other", "nobody"].includes(state.role);
  at("form").hidden = !drives;
  at("choices").hidden = !drives || !(asked || state.listening);
  const atWork = state.listening ? "say what should be different, or ask" : "one moment";
  at("line").placeholder = asked ? (state.choosing ? "build it? or say what to change" : "say what to build, or ask") : atWork;
  at("stop").hidden = !drives || asked || state.prompt === null;
  at("stop").disabled = state.stopping;
  const bar = at("bar");
  bar.hidden = !state.motions;
  bar.max = state.motions || 1;
  bar.value = state.placed;
  // Where nothing is at work, the chat itself says what came of it.
  const counted = `${state.stage} (${state.placed} of ${state.motions})`;
  const stage = state.motions ? counted : asked || state.outcome ? "" : state.busy || state.stage;
  at("stage-text").textContent = state.stopping ? "stopping" : stage;
  at("stage-text").className = state.outcome;
  candidates.allow(drives && state.choosing, building);
  arranging.allow(drives && asked);
}

// --- what the driver does --------------------------------------------------------------------

function send(message) {
  if (state.socket?.readyState === WebSocket.OPEN) state.socket.send(JSON.stringify(message));
}

function say(line) {
  send({ kind: "line", line });
}

// Sends the line of a button, which is gone then: the keyboard goes on in the line, where there is one.
function answer(line) {
  say(line);
  if (matchMedia("(pointer: fine)").matches) at("line").focus();
}

at("form").addEventListener("submit", (event) => {
  event.preventDefault();
  const line = at("line").value.trim();
  if (!line) return;
  if (!state.prompt && !state.listening) {
    told.refused({ reason: "the agent is at work; wait, or stop it" });
    return;
  }
  say(line);
  at("line").value = "";
});
at("stop").addEventListener("click", () => send({ kind: "stop" }));
at("take-over").addEventListener("click", () => send({ kind: "take_over" }));
at("enlarge").addEventListener("click", () => {
  const large = at("camera").classList.toggle("large");
  at("enlarge").setAttribute("aria-expanded", String(large));
});
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && at("camera").classList.contains("large")) at("enlarge").click();
});
for (const one of document.querySelectorAll("[data-view]")) one.addEventListener("click", () => scene?.eye.view(one.dataset.view));
toggle("names", (shown) => (at("labels").hidden = !shown));
toggle("ghosts", (shown) => scene?.show("showsGhosts", shown));
toggle("arm", (shown) => scene?.show("showsArm", shown));

// --- the connection --------------------------------------------------------------------------

function connect(again) {
  const address = new URL("/socket", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  // A page that comes back does not take an empty seat, unless it was its own.
  if (again && state.role !== "you") address.search = "again";
  const socket = new WebSocket(address);
  state.socket = socket;
  socket.addEventListener("open", () => (state.retry = FIRST_RETRY));
  socket.addEventListener("message", (event) => {
    const message = JSON.parse(event.data);
    told[message.kind]?.(message);
  });
  socket.addEventListener("close", (event) => {
    if (state.retry === FIRST_RETRY) {
      at("role").textContent = event.code === ENDED ? "structagent has ended; this is the last state" : "the connection is lost; trying again";
    }
    refresh();
    setTimeout(() => connect(true), state.retry);
    state.retry = Math.min(SLOWEST_RETRY, 2 * state.retry);
  });
}

window.structagent = { state, scene, candidates, arranging };
connect(false);
