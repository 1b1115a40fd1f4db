// The page: it shows what the stream of the station says, and sends actions back. No library, no build.
"use strict";

const SHOWN_RUNS = 200;
const PHASES = {
  START: "waiting for camera and arm", SYNC: "a small tilt that sets the clocks", LEVEL: "levelling", DWELL: "resting",
  REFERENCE: "reading the place before the tilt", TILT: "tilting", SLIP: "it slips", SETTLE: "coming to rest",
  RETURN: "back to level", DONE: "reading the place after the slide", ABORTED: "given up, levelling",
};
let session = 0, state = null, viewed = "", refusal = "";

// --- helpers -------------------------------------------------------------------------------------------------------

function element(name, text = "", attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

const counted = (number, what) => `${number} ${what}${number === 1 ? "" : "s"}`;

// A direction by its number, with the azimuth of the tilting axis where that is known.
function directionOf({ direction: number, azimuth_deg: azimuth }) {
  const name = number === null ? "–" : number < 0 ? "free" : String(number);
  return azimuth === null ? name : `${name} (${azimuth.toFixed(0)}°)`;
}

// Local time as YYYY-MM-DD HH:MM; a simulation of a whole session has a clock of its own.
function startOf({ started_s: seconds, mode }) {
  if (seconds === null) return "–";
  const at = new Date(1000 * seconds), two = (number) => String(number).padStart(2, "0");
  const day = [at.getFullYear(), two(at.getMonth() + 1), two(at.getDate())].join("-");
  return `${day} ${two(at.getHours())}:${two(at.getMinutes())}${mode === "lockstep" ? " (simulated)" : ""}`;
}
const figure = (value, digits = 2) => (value === null ? "–" : value.toFixed(digits));
const timeOf = (seconds) => (seconds < 120 ? `${seconds.toFixed(0)} s` : `${(seconds / 60).toFixed(0)} min`);

// --- the session ---------------------------------------------------------------------------------------------------

function phaseOf(now) {
  const starting = now.own && now.own.running;
  if (!now.running) return starting ? "starting" : now.ended ? `the session has ended with ${counted(now.done, "sample")}` : "no session";
  const waiting = now.paused && (now.phase === "DONE" || now.phase === "ABORTED" || now.phase === "START");
  return waiting ? "paused, the plate is level" : `run ${now.run}: ${PHASES[now.phase] || now.phase}${now.paused ? ", pausing after it" : ""}`;
}

// In mm, or in px while the camera's geometry is unknown.
function distanceOf(now) {
  const known = now.moved_mm !== null && now.threshold_mm !== null;
  const [moved, threshold, unit] = known ? [now.moved_mm, now.threshold_mm, "mm"] : [now.moved_px, now.threshold_px, "px"];
  if (moved > threshold) return `${moved.toFixed(1)} ${unit}: a slip (beyond ${threshold.toFixed(1)} ${unit})`;
  return `${moved.toFixed(1)} of the ${threshold.toFixed(1)} ${unit} that make a slip`;
}

function showSession(now) {
  byId("rig").textContent = `rig “${now.rig}”`;
  byId("notes").textContent = now.note_lines.join(" ");
  byId("notes").hidden = now.note_lines.length === 0;
  byId("state").textContent = phaseOf(now);
  byId("direction").textContent = directionOf(now);
  byId("tilt").textContent = now.tilt_deg === null ? "–" : `${now.tilt_deg.toFixed(2)}°`;
  const seen = now.moved_px !== null && now.threshold_px !== null;
  byId("moved").max = seen ? now.threshold_px : 1;
  byId("moved").value = seen ? Math.min(now.moved_px, now.threshold_px) : 0;
  byId("distance").textContent = seen ? distanceOf(now) : "no reference";
  byId("progress").max = now.total || 1;
  byId("progress").value = now.total ? now.done : 0;
  const left = now.left_s === null || !now.running || now.total === null ? "" : `, about ${timeOf(now.left_s)} left`;
  byId("done").textContent = `${now.done}${now.total === null ? "" : ` of ${now.total}`}${left}`;
  const own = now.own ? now.own.lines : [];
  showLines("log", [...own.slice(-12), ...now.lines.slice(-30)]);
  showHealth(now);
  const busy = now.running || (now.own !== null && now.own.running);
  byId("start").disabled = byId("samples").disabled = byId("seed").disabled = busy;
  byId("pause").disabled = !now.running;
  byId("pause").textContent = now.paused ? "Go on" : "Pause";
  byId("stop").disabled = !busy;
}

function showLines(id, lines) {
  const text = lines.join("\n"), where = byId(id);
  if (where.textContent === text) return;
  where.textContent = text;
  where.scrollTop = where.scrollHeight;
}

// Without a session nothing is written, and a part that has said nothing is no fault.
function healthOf(now) {
  const idle = !now.running && !now.ended;
  const parts = idle ? now.health.filter((part) => part.part !== "disk") : now.health;
  const silent = (part) => part.off || (idle && part.text.endsWith(" yet"));
  const looks = (part) => (silent(part) ? { class: "silent" } : part.well ? {} : { class: "bad" });
  return parts.map((part) => element("li", `${part.part}: ${part.text}`, looks(part)));
}

function showHealth(now) {
  byId("health").replaceChildren(...healthOf(now));
  const rows = now.by_direction.map((one) => {
    const row = element("tr");
    row.append(...[directionOf(one), one.count, figure(one.mean_deg), figure(one.sd_deg)].map((t) => element("td", t)));
    return row;
  });
  document.querySelector("#directions tbody").replaceChildren(...rows);
}

function showSamples({ session: number, samples }) {
  const body = document.querySelector("#runs tbody");
  if (number !== session) {
    session = number;
    body.replaceChildren();
  }
  for (const sample of samples) {
    const row = element("tr", "", { "data-run": sample.run });
    const remarks = [...(sample.censored ? ["no slip"] : []), ...sample.flags].join(", ");
    const onset = `${sample.censored ? "> " : ""}${figure(sample.onset_deg)}`;
    row.append(...[sample.run, directionOf(sample), onset, remarks].map((text) => element("td", text)));
    body.prepend(row);
  }
  while (body.rows.length > SHOWN_RUNS) body.lastChild.remove();
}

// --- the limit curve -----------------------------------------------------------------------------------------------

const SVG = "http://www.w3.org/2000/svg";

function drawn(name, attributes, text = "") {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

function showCurve({ points = [], curve = [], frame = "object", note = "" }) {
  const fitted = Math.max(0, ...curve.map((one) => one[1]));
  const top = 1.15 * (fitted ? Math.max(fitted, median(points) * 1.3) : Math.max(0.1, ...points.map((one) => one[1])));
  const at = (phi, mu) => {
    const radius = (100 * Math.min(mu, top)) / top;
    return [(radius * Math.cos(phi)).toFixed(2), (-radius * Math.sin(phi)).toFixed(2)];
  };
  const step = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5].find((one) => top / one <= 5) || top;
  const parts = [drawn("path", { class: "grid", d: "M-100 0H100M0-100V100" })], rings = [];
  for (let mu = step; mu <= top; mu += step) {
    parts.push(drawn("circle", { class: "grid", r: (100 * mu) / top }));
    rings.push(mu);
  }
  for (const [phi, mu, held] of points) {
    const [cx, cy] = at(phi, mu);
    parts.push(drawn("circle", { class: held ? "held" : "run", cx, cy, r: held ? 2.6 : 2.2 }));
  }
  if (curve.length) parts.push(drawn("path", { class: "fit", d: `M${curve.map((one) => at(...one).join(" ")).join("L")}` }));
  const seen = [...points.map((one) => at(...one).map(Number)), ...along(parts.find((one) => one.matches(".fit")))];
  const places = (phi) => rings.map((mu) => at(phi, mu)).map(([x, y]) => [Number(x) + 1, Number(y) - 2]);
  freest(places, seen).forEach(([x, y], ring) => parts.push(drawn("text", { x, y }, `µ ${rings[ring].toFixed(2)}`)));
  byId("curve").replaceChildren(...parts);
  const axes = `A dot is the friction that a run measured in its direction, as seen from the ${frame}; a ring is a run without a slip.`;
  const said = curve.length ? "the line is the fitted limit curve" : note;
  byId("curve-note").textContent = said ? `${axes} ${said[0].toUpperCase()}${said.slice(1).replace(/\.$/, "")}.` : axes;
}

// Points of a drawn line, nearer to each other than a number is high; none without a line.
function along(line) {
  const steps = line ? Math.ceil(line.getTotalLength()) : 0;
  return Array.from({ length: steps }, (_, step) => line.getPointAtLength(step)).map(({ x, y }) => [x, y]);
}

// The places of the rings' numbers, of `places(phi)`, that cover the least of what is drawn: a number begins on its ring,
// and lies outside of it at the upper right and inside at the lower left, so that a curve along a ring leaves one free.
function freest(places, seen) {
  const [width, height] = [24, 8];
  const under = ([x, y]) => seen.filter(([px, py]) => x - 1 < px && px < x + width && y - height < py && py < y + 2).length;
  const covered = (phi) => places(phi).reduce((sum, place) => sum + under(place), 0);
  const ways = Array.from({ length: 24 }, (_, number) => ((22.5 + 15 * number) * Math.PI) / 180);
  return places(ways.reduce((best, phi) => (covered(phi) < covered(best) ? phi : best)));
}

function median(points) {
  const sorted = points.map((one) => one[1]).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.floor(sorted.length / 2)] : 0;
}

// --- recordings ----------------------------------------------------------------------------------------------------

const ACTIONS = [["doctor", "Check"], ["report", "Report"], ["diagnosis", "Diagnosis"]];

async function loadRecordings() {
  const answer = await fetch("/recordings").catch(() => null);
  if (!answer || !answer.ok) return;
  const { recordings } = await answer.json();
  const rows = recordings.map(rowOf);
  const none = element("tr");
  none.append(element("td", "No recordings yet: start a session above.", { colspan: 5 }));
  document.querySelector("#files tbody").replaceChildren(...(rows.length ? rows : [none]));
}

function rowOf(file) {
  const row = element("tr", "", { "data-name": file.name });
  const doing = element("td");
  for (const [kind, label] of ACTIONS) {
    const button = element("button", label, { type: "button" });
    button.addEventListener("click", () => begin(kind, file.name));
    doing.append(button);
  }
  const view = element("button", "Rerun", { type: "button" });
  view.addEventListener("click", () => act("view", { recording: file.name }));
  doing.append(view);
  const made = element("td");
  for (const kind of file.pages) {
    const href = `/made/${kind}/${file.name.split("/").map(encodeURIComponent).join("/")}`;
    made.append(element("a", kind, { href, target: "_blank" }), " ");
  }
  row.append(element("td", file.name), element("td", startOf(file)), element("td", `${(file.bytes / 1e6).toFixed(1)} MB`), doing, made);
  return row;
}

// Work that is refused as other work runs says so until that has ended.
async function begin(kind, recording) {
  refusal = (await act("job", { kind, recording })) ? "" : byId("said").textContent;
}

function forgetRefusal() {
  if (refusal && byId("said").textContent === refusal) say("");
  refusal = "";
}

function showJob(job) {
  byId("job").hidden = job === null;
  if (job === null) return;
  const words = job.running ? "running" : job.status === 0 ? "done" : job.status === 1 ? "done, with findings" : "failed";
  byId("job-title").textContent = `${new Map(ACTIONS).get(job.kind)} of ${job.recording}: ${words}`;
  byId("job-end").hidden = !job.running;
  showLines("job-lines", job.lines);
}

function showViewer(view) {
  byId("viewer").hidden = view === null;
  if (view === null) return;
  const of = view.of || "the session";
  byId("viewer-note").textContent = view.fault || (view.url ? `${of}; it may take a moment to load` : `drawing ${of}`);
  byId("frame").hidden = !view.url;
  if (view.url && view.url !== viewed) byId("frame").src = view.url;
  viewed = view.url;
}

// --- the stream ----------------------------------------------------------------------------------------------------

function take(now) {
  const ended = (before, after) => before && before.running && !(after && after.running);
  if (state && (ended(state.job, now.job) || ended(state, now))) loadRecordings();
  if (state && ended(state.job, now.job)) forgetRefusal();
  state = now;
  showSession(now);
  showJob(now.job);
  showViewer(now.view);
}

byId("controls").addEventListener("submit", (event) => {
  event.preventDefault();
  act("session", { action: "start", samples: byId("samples").valueAsNumber, seed: byId("seed").valueAsNumber });
});
byId("pause").addEventListener("click", () => act("session", { action: state && state.paused ? "resume" : "pause" }));
byId("stop").addEventListener("click", () => act("session", { action: "stop" }));
byId("emergency").addEventListener("click", async () => {
  if (await act("arm-stop")) say("The arm is stopped where it is, and a session that runs ends. Look at the rig, then start another.");
});
byId("view-live").addEventListener("click", () => act("view", { recording: "" }));
byId("job-end").addEventListener("click", () => act("job-end"));
byId("reload").addEventListener("click", loadRecordings);
showCurve({ note: "No samples yet." });
follow({ state: take, samples: showSamples, curve: showCurve }, () => {
  session = 0;
  loadRecordings();
});
