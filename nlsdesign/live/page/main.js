// The page of one design: what is asked, what is shown, and how sure it is.

import { Compare } from "./compare.js";
import { Connection, download, upload } from "./connection.js";
import { PointTable, Rows } from "./controls.js";
import { announce, byId, make, text } from "./elements.js";
import { MechanismPicture } from "./mechanism.js";
import { AtAngle, Panels, sitsOn } from "./panels.js";
import { Questions } from "./questions.js";
import { Stock } from "./stock.js";
import { TaskCard } from "./task.js";
import { TargetEditor, torqueRange } from "./target_editor.js";
import { interpolated } from "./chart.js";
import { factorOf, plain, withUnit } from "./units.js";
import { Diagnosis, Tolerance } from "./work.js";

let answer = null;
let cards = [];
let materials = [];
let kinds = [];
let angle = null;
let full = null;
let shownNumber = 0;
let computing = false;

const connection = { send: (message) => live?.send(message) ?? false };
const questions = new Questions((message) => connection.send(message), (busy) => {
  document.body.dataset.busy = String(busy);
  // What was answered may have been no design: then the one that is shown is that of now after all.
  if (!busy && computing) { computing = false; showState(); fade(); }
});
window.addEventListener("pagehide", () => questions.flush());
const ask = (message, begin) => { const number = questions.ask(message, begin); later(); return number; };
const edit = (fields, { drag = null, last = true, begin } = {}) => ask({ what: "edit", edit: fields, drag, last, angle }, begin);

const act = {
  move: (k, at, torque, last, begin) => edit({ edit: "MovePoint", index: k, angle: at, torque }, { drag: `point ${k}`, last, begin }),
  add: (at, torque) => edit({ edit: "AddPoint", angle: at, torque: Math.max(0, torque) }),
  scale: (at, torque) => edit({ edit: "ScaleTarget", angle: at, torque }),
  remove: (k) => (k > 0 ? edit({ edit: "RemovePoint", index: k }) : announce("The first point stays.")),
};

const editor = new TargetEditor(byId("torque"), act);
const table = new PointTable(byId("points"), act);
const picture = new MechanismPicture(byId("mechanism"));
const panels = new Panels(byId("panels"));
const atAngle = new AtAngle(byId("linear-row"), ask);
const compare = new Compare(ask);
const tolerance = new Tolerance(ask);
const diagnosis = new Diagnosis(ask);
const stock = new Stock((message) => ask({ ...message, angle }));
const task = new TaskCard(byId("task"), edit);
const limits = new Rows(byId("limits"), "limit", {
  change: (limit, value, last) => edit({ edit: "ChangeLimit", limit, value }, { drag: `limit ${limit}`, last }),
  drop: (limit) => edit({ edit: "DropLimit", limit }),
});
byId("limit-add").addEventListener("click", () => {
  const limit = byId("limit-kind").value;
  if (limit && answer) edit({ edit: "ChangeLimit", limit, value: startOf(limit) });
});
const sizes = new Rows(byId("sizes"), "size", {
  change: (name, value, last) => edit({ edit: "SetNumber", name, value }, { drag: `number ${name}`, last }),
  free: (name, yes) => edit({ edit: yes ? "FreeNumber" : "HoldNumber", name }),
});
const laws = new Rows(byId("laws"), "law", sizes.actions);
const material = make("select", { id: "material" });
const contourBox = make("input", { type: "checkbox", id: "contour" });
byId("choice").append(
  make("label", { for: "material" }, "rubber of the library"), material,
  make("label", { class: "contour", for: "contour" }, contourBox, "free: the contour of the cam"),
);
material.addEventListener("change", () => { if (material.value) edit({ edit: "ChooseMaterial", material: material.value }); });
contourBox.addEventListener("change", () => edit({ edit: contourBox.checked ? "FreeNumber" : "HoldNumber", name: answer.controls.contour }));

const live = new Connection(receive, (words, lost) => {
  byId("connection").hidden = !words;
  text(byId("connection"), words);
  document.body.classList.toggle("lost", lost);
  showState();
  fade();
  if (!lost) questions.again();
});

// --- what comes -----------------------------------------------------------------------------------

function receive(message) {
  const kinds = {
    gallery: () => showGallery(message), answer: () => takeAnswer(message), at: () => takeAngle(message),
    refused: () => refuse(message), work: () => takeWork(message.work), motor: () => takeMotor(message.motor), kept: () => compare.show(message.kept, present()),
  };
  kinds[message.what]?.();
  if (typeof message.number === "number") questions.answered(message.number);
}

function takeAnswer(message) {
  if (message.number !== null && message.number < shownNumber) return;
  shownNumber = message.number ?? shownNumber;
  answer = message.answer;
  if (message.number !== null) byId("notice").hidden = true;
  clearTimeout(waiting);
  waiting = 0;
  if (message.at) latestAt = message.at;
  draw(message.number, "drag to drawn");
  if (message.answer.seconds !== undefined && message.number !== null) performance.measure("computed", { start: 0, duration: 1e3 * message.answer.seconds });
}

function takeAngle(message) {
  showAngle(message.at);
  if (message.number !== null) requestAnimationFrame(() => afterPaint(() => questions.drawn(message.number, "slide to drawn")));
}

// Answers that come within one frame are drawn once, the last of them.
let latestAt = null, latestNumber = null, drawing = false;
function draw(number, kind) {
  if (number !== null) latestNumber = number;
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    const shown = latestNumber, at = latestAt;
    drawing = false;
    latestNumber = latestAt = null;
    showAnswer();
    if (at) showAngle(at);
    if (shown !== null) afterPaint(() => questions.drawn(shown, kind));
  });
}

// After the frame that is being made now.
function afterPaint(then) {
  const channel = new MessageChannel();
  channel.port1.onmessage = then;
  channel.port2.postMessage(0);
}

function refuse(message) {
  // An alert, which a screen reader says by itself.
  text(byId("notice"), message.reason);
  byId("notice").hidden = false;
  if (answer) requestAnimationFrame(showAnswer);
}

function takeWork(work) {
  if (work.name === "SettleDesign") { full = work; showState(); fade(); }
  if (work.name === "ToleranceCloud") { lastCloud = work; tolerance.show(work, answer); }
  if (work.name === "DiagnoseRecords") diagnosis.show(work);
  if (work.name === "TryStock") stock.show(work);
  if (work.name === "TorqueLoop") atAngle.showLoopWork(work);
}

let lastCloud = null;

function takeMotor(motor) {
  task.showMotor(motor);
  if (answer && !editor.moving) showCurve(false);
}

// --- what is shown --------------------------------------------------------------------------------

function showAnswer() {
  const { controls, design } = answer;
  const frozen = editor.moving;
  table.show(controls.points.map((each) => [each[0], each[1]]));
  task.show(controls);
  stock.offer(controls);
  showCurve(frozen);
  limits.show(controls.limits.map(limitRow));
  showKinds();
  const lengths = (each) => /^m(\^2)?$/.test(each[2]) && each[1] < 1e3;
  sizes.show(controls.numbers.filter(lengths).map(numberRow));
  laws.show(controls.numbers.filter((each) => !lengths(each)).map(numberRow));
  if (document.activeElement !== material) material.value = controls.material;
  contourBox.checked = controls.contour_free;
  byId("undo").disabled = !controls.can_undo;
  byId("redo").disabled = !controls.can_redo;
  byId("keep").disabled = !design;
  tolerance.run.disabled = !design || lastCloud?.state === "computing";
  if (lastCloud && !frozen) tolerance.show(lastCloud, answer);
  if (design) {
    panels.show(design, frozen);
    showNumbers(design);
    slider(design.columns[0].values);
    if (!frozen) compare.show(null, present());
  }
  showLights(design);
  showTitle();
  showAdvice();
  const earlier = answer.stale ? (design ? "Deck, drawings, C and FMU are those of the last good design, of an earlier question: the question of now has no design." : "") : "";
  text(byId("files-earlier"), earlier);
  byId("files-earlier").hidden = earlier === "";
  showState();
  fade();
  cursor();
  const error = design ? `rms error ${withUnit(design.rms_error, "N*m", 3)}` : "no design";
  // A check follows a quick answer, so that it is worth a word only to a hand on the keys.
  if (answer.source === "full" || answer.state !== "solved") announceState();
  else editor.say(error, byId("state-name").textContent);
}

// The state is said once when the hand rests, not with each answer of a drag.
let stated = "";
function announceState() {
  const words = `${byId("state-name").textContent}. ${byId("state-words").textContent}`;
  if (words !== stated) announce(words);
  stated = words;
}

// The actuator of the gallery, or the name of a deck of one's own.
function showTitle() {
  const card = byId("gallery"), { title } = answer.controls;
  const known = cards.some((each) => each.name === title);
  if (cards.length) text(card.options[0], known ? "own deck" : `own deck: ${title}`);
  if (document.activeElement !== card) card.value = known ? title : "";
}

// A number that would help when it is freed is freed by a button.
function showAdvice() {
  const held = new Set(answer.controls.numbers.filter((each) => !each[4]).map((each) => each[0]));
  const named = [...answer.message.matchAll(/free ([\w.]+?)(?= |,|;|$)/g)].map((each) => each[1]).filter((name) => held.has(name));
  const code = named.join(" "), place = byId("remarks");
  if (place.dataset.code === code) return;
  place.dataset.code = code;
  place.replaceChildren(...[...new Set(named)].map((name) => make("button", { type: "button", onclick: () => edit({ edit: "FreeNumber", name }) }, `Free ${name}`)));
}

// What is compared with kept designs; actuator and rubber are those of the question, not of an earlier one.
function present() {
  if (!answer?.design) return null;
  const { stale, design, controls: { title, material } } = answer;
  return stale ? { name: "last good design", title: "–", material: "–", design } : { name: "now", title, material, design };
}

function showCurve(frozen) {
  const { controls, design } = answer;
  const points = controls.points.map((each) => [each[0], each[1]]);
  const last = points.at(-1)[0];
  const series = [];
  const column = (name) => design.columns.find((each) => each.name === name).values;
  if (design) {
    // The target belongs to the question, so an old design does not bring its own.
    series.push({ name: answer.stale ? "target of the design shown" : "target", x: column("angle"), y: column("target"), tone: "ink", dash: "dashed" });
    series.push({ name: answer.stale ? "last good design" : "design", x: column("angle"), y: column("torque"), tone: "blue" });
  }
  series.push(...task.curve);
  const wanted = torqueRange([points.map((each) => each[1]), ...series.map((each) => each.y)]);
  const room = { x: [0, 1.08 * Math.max(last, ...series.map((each) => each.x.at(-1)))], y: [wanted[0], wanted[1] * 1.15] };
  editor.bounds = { angle: [0, 6.28], torque: [0, 1e5], firstHeld: true };
  editor.show(series, { frozen, limits: room });
  editor.showTarget(points);
}

function limitRow([name, words, value, si, shown, upper, byDefault]) {
  const unit = shown === "%" ? "%" : si;
  const margin = answer.design?.margins.find((each) => each.limit === name);
  const from = byDefault ? "from the deck" : "set here";
  return { name, label: `${upper ? "largest" : "least"} ${words}`, value, unit, digits: byDefault ? 3 : 5, active: margin?.active ?? false, droppable: !byDefault,
    margin: margin ? `${from}; ${margin.active ? "the design sits on it" : `now ${withUnit(margin.value, unit, 3)}`}` : from };
}

// A new limit begins where the design is, so that nothing changes before it is moved.
function startOf(limit) {
  const ends = { MaximumStrain: /\.strain$/, MaximumLastingStrain: /\.strain$/, MaximumStress: /\.stress$/, MaximumCableTension: /^tension$/, MaximumCamRadius: /^radius$/, MinimumRadiusOfCurvature: /^radius_of_curvature$/, PositiveStiffness: /^stiffness$/ };
  const kind = kinds.find((each) => each.name === limit);
  const rows = (answer.design?.columns ?? []).filter((each) => ends[limit]?.test(each.name)).flatMap((each) => (limit === "MaximumLastingStrain" ? each.values.slice(0, 1) : each.values)).filter((value) => value !== null && value > 0);
  if (rows.length === 0) return 1;
  // A strain that no rubber bears is no place to begin at.
  const end = limit === "MaximumStrain" ? answer.design.strain_end ?? Infinity : Infinity;
  const value = Math.min(end, kind.upper ? Math.max(...rows) * 1.01 : Math.min(...rows) * 0.99);
  return Number(value.toPrecision(3));
}

// Kinds of limits that do not hold yet.
function showKinds() {
  const held = new Set(answer.controls.limits.map((each) => each[0]));
  const left = kinds.filter((each) => !held.has(each.name));
  const code = left.map((each) => each.name).join(" ");
  const select = byId("limit-kind");
  byId("limit-add").disabled = left.length === 0;
  select.parentElement.hidden = left.length === 0;
  if (select.dataset.code === code) return;
  select.dataset.code = code;
  select.replaceChildren(...left.map((each) => make("option", { value: each.name }, `${each.upper ? "largest" : "least"} ${each.words}`)));
}

function numberRow([name, value, unit, , free, , , source]) {
  const chosen = answer.design?.numbers.find((each) => each.name === name);
  return { name, path: `${name} (${source})`, label: name, value: free && chosen ? chosen.value : value, digits: free ? 3 : 5, unit, free,
    margin: free && chosen ? `chosen: ${withUnit(chosen.value, unit)}` : "" };
}

// Three questions, one light: green where all are answered yes. They are answered by the check.
const MARKS = { yes: "✓", no: "✗", unknown: "?" };
const ASKED = ["can be made", "will hold", "will be known"];
function lightsOf(design) {
  const known = design?.lights.length && !answer.stale ? design.lights : [];
  return ASKED.map((asked) => known.find((each) => each.asked === asked) ?? { asked, answer: "", words: "comes with the check" });
}

function showLights(design) {
  const lights = lightsOf(design), answers = lights.map((each) => each.answer), place = byId("lights");
  const worst = ["no", "", "unknown"].find((each) => answers.includes(each)) ?? "yes";
  place.className = `lights ${worst || "open"}`;
  place.replaceChildren(...lights.map((each) => make("li", { class: each.answer || "open", title: each.words }, make("span", { "aria-hidden": "true" }, MARKS[each.answer] ?? "…"), `${each.asked}${each.answer === "yes" ? "" : `: ${each.answer || "not yet"}`}`)));
}

function showNumbers(design) {
  const rows = [
    ["torque error, 95 % of made springs", design.made_error === null ? (design.checked ? "not known: no number is spread" : "comes with the check") : `${withUnit(design.made_error, "N*m", 3)} rms`],
    ["torque error, exact numbers", `${withUnit(design.rms_error, "N*m", 3)} (${plain(100 * design.relative_error, 2)} %)`],
    ["largest error, exact numbers", withUnit(design.largest_error, "N*m", 3)],
    ["limits it sits on", sitsOn(design) || "none"],
    ["rubber", withUnit(design.rubber_volume, "m^3", 3)],
    ...(answer.controls.can_undo ? [["answered in", `${plain(1e3 * answer.seconds, 2)} ms`]] : []),
  ];
  byId("reasons").replaceChildren(...lightsOf(design).map(({ asked, answer, words }) => make("p", {}, make("strong", {}, answer ? `${asked}: ${answer}` : asked), ` – ${words}`)));
  byId("numbers").replaceChildren(...rows.flatMap(([name, words]) => [make("dt", {}, name), make("dd", {}, words)]));
}

// What made springs do stands first; what exact numbers would give says how well the cam fits the curve.
function errorOf(design) {
  const exact = `${withUnit(design.rms_error, "N*m", 3)} rms, ${plain(100 * design.relative_error, 2)} % of the largest torque`;
  if (design.made_error !== null) return `95 % of made springs err by less than ${withUnit(design.made_error, "N*m", 3)} rms; with exact numbers ${exact}.`;
  return `Torque error with exact numbers ${exact}; ${design.checked ? "that of made springs is not known, for no number is spread" : "that of made springs comes with the check"}.`;
}

// One of: computing, quick answer, checked answer, infeasible, failed; always in words too.
function showState() {
  if (document.body.classList.contains("lost")) {
    showWords("not connected", "failed", answer ? "What is shown is the last answer that came. What is changed now is not computed." : "No design has come yet.");
    return;
  }
  if (!answer) return;
  const { design } = answer;
  const message = answer.message.replace(/^misses its target: /i, "").replace(/(\w)$/, "$1.").replace(/^[a-z](?=[a-z]* )/, (first) => first.toUpperCase());
  const missed = design && !design.met ? `Torque error ${plain(100 * design.relative_error, 3)} % of the largest torque; 1 % is allowed. ` : "";
  const checking = full?.state === "computing" && full.revision === answer.revision ? `The check runs: ${full.message}. ` : "";
  const failed = full?.state === "failed" && full.revision === answer.revision ? `The check failed: ${full.message}. ` : "";
  const shown = answer.stale ? (design ? "What is shown greyed is the last good design, of an earlier question. " : "") : "";
  const sits = design && sitsOn(design) ? `It sits on: ${sitsOn(design)}. ` : "No limit binds. ";
  const good = design ? `${errorOf(design)} ${sits}` : "";
  let name, kind, words;
  if (answer.state === "infeasible") [name, kind, words] = ["infeasible", "infeasible", `No design keeps all limits. ${message} `];
  else if (answer.state === "not solved") [name, kind, words] = ["not solved yet", "failed", `${message.replace(/^not solved yet: /i, "").replace(/^[a-z](?=[a-z]* )/, (first) => first.toUpperCase())} `];
  else if (design?.beyond.length) [name, kind, words] = ["beyond its rubber", "failed", `${design.checked ? "" : "Quick answer: "}${message} `];
  else if ((answer.source === "full" || design?.checked) && design.met && message) [name, kind, words] = ["checked, with remarks", "missed", `${good}${message} `];
  else if (answer.source === "full" || design?.checked) [name, kind, words] = design.met ? ["checked answer", "checked", `${good}${message} `] : ["misses its target", "missed", `${message || missed} `];
  else [name, kind, words] = design?.met ? ["quick answer", "quick", `${good}${message} `] : ["misses its target", "missed", `Quick answer: ${message || missed} `];
  showWords(name, kind, words + shown + checking + failed);
}

function showWords(name, kind, words) {
  byId("state").className = `state ${kind}`;
  text(byId("state-name"), name);
  text(byId("state-words"), words.trim());
  clearTimeout(cutting);
  cutting = setTimeout(showCut, 150);
}

// The bar has one height, so that no answer moves the page. Words that do not fit are there whole: for whoever
// points at them, brings the focus to them or has them read.
let cutting = 0;
function showCut() {
  const place = byId("state-words"), cut = place.scrollHeight > place.clientHeight + 1;
  place.title = cut ? place.textContent : "";
  if (cut) place.tabIndex = 0;
  else place.removeAttribute("tabindex");
}
window.addEventListener("resize", () => showCut());

// Computing is worth a word only where it takes longer than a glance.
let waiting = 0;
function later() {
  if (waiting) return;
  waiting = setTimeout(() => {
    waiting = 0;
    if (questions.busy && !document.body.classList.contains("lost")) { computing = true; showWords("computing", "computing", "What is shown is the answer to an earlier question."); fade(true); }
  }, 250);
}

function fade(old = false) {
  const stale = old || document.body.classList.contains("lost") || answer === null || answer.stale || answer.state !== "solved";
  for (const name of ["torque", "mechanism", "panels", "linear", "numbers", "reasons", "limits", "sizes", "laws", "angle-bar", "lights", "task"]) byId(name).classList.toggle("stale", stale);
  // Observability and poles come when the hand rests.
  if (answer?.design && !atAngle.holds(answer.design.revision, angle)) byId("linear").classList.add("stale");
}

// --- the angle ------------------------------------------------------------------------------------

const angleInput = byId("angle");
angleInput.addEventListener("input", () => turn(Number(angleInput.value)));

function slider(angles) {
  const last = angles.at(-1);
  if (angle === null) angle = 0.6 * last;
  angleInput.min = 0;
  angleInput.max = last;
  angleInput.step = last / 400;
  angleInput.disabled = false;
  angle = Math.min(angle, last);
  if (document.activeElement !== angleInput) angleInput.value = angle;
}

function turn(next) {
  angle = next;
  cursor();
  fade();
  ask({ what: "angle", angle, drag: "angle" });
}

function cursor() {
  if (angle === null || !answer?.design) return;
  const columns = answer.design.columns;
  editor.cursor(angle);
  panels.cursor(angle);
  tolerance.cursor(angle);
  compare.cursor(angle);
  const at = (name) => interpolated(columns[0].values, columns.find((each) => each.name === name).values, angle);
  const words = `${withUnit(angle, "rad", 3)}: torque ${withUnit(at("torque"), "N*m", 3)}, tension ${withUnit(at("tension"), "N", 3)}, lever arm ${withUnit(at("lever_arm"), "m", 3)}, stiffness ${withUnit(at("stiffness"), "N*m/rad", 3)}`;
  text(byId("angle-words"), words);
  angleInput.setAttribute("aria-valuetext", words);
  text(byId("linear-angle"), `θ = ${withUnit(angle, "rad", 3)}`);
}

// The mechanism comes at once; what takes longer to compute comes when the hand rests.
function showAngle(at) {
  if (at.mechanism) picture.show(at.mechanism);
  if (at.mechanism !== undefined) picture.explain(at.reason);
  if (at.poles) { atAngle.show(at); fade(); }
}

// --- gallery, files, keys -------------------------------------------------------------------------

function showGallery(message) {
  ({ cards, materials, limits: kinds } = message);
  task.offer(message.joints);
  if (answer) showKinds();
  const select = byId("gallery");
  const group = (label, chosen) => make("optgroup", { label }, ...chosen.map((each) => make("option", { value: each.name, disabled: each.reason !== "", title: each.line }, each.name)));
  const open = (kind) => cards.filter((each) => each.kind === kind && each.reason === "");
  // What cannot be opened stands below the reason that it shares with others.
  const reasons = [...new Set(cards.map((each) => each.reason))].filter((each) => each !== "");
  select.replaceChildren(make("option", { value: "", disabled: true }, "own deck"), group("decks", open("deck")), group("templates", open("template")),
    ...reasons.map((reason) => group(`cannot be opened: ${reason}`, cards.filter((each) => each.reason === reason))));
  select.disabled = false;
  if (answer) showTitle();
  material.replaceChildren(make("option", { value: "" }, "that of the deck"), ...materials.map(({ name, reason }) =>
    make("option", { value: name, disabled: reason !== "" }, reason ? `${name} (${reason})` : name)));
  if (answer) material.value = answer.controls.material;
  diagnosis.ready();
}

byId("gallery").addEventListener("change", (event) => { angle = null; edit({ edit: "ChooseDeck", name: event.target.value }); event.target.blur(); });
byId("undo").addEventListener("click", () => ask({ what: "step", back: true, angle }));
byId("redo").addEventListener("click", () => ask({ what: "step", back: false, angle }));
byId("keep").addEventListener("click", () => ask({ what: "keep", name: keptName() }));

function keptName() {
  const taken = new Set(compare.kept.map((each) => each.name));
  let number = compare.kept.length + 1;
  while (taken.has(`design ${number}`)) number += 1;
  return `design ${number}`;
}

for (const button of document.querySelectorAll("[data-file]")) {
  button.addEventListener("click", async () => {
    byId("files").open = false;
    announce(`${button.textContent} is being made`, 0);
    button.disabled = true;
    const wrong = await download(button.dataset.file);
    button.disabled = false;
    if (wrong) refuse({ reason: wrong });
    else if (answer?.stale && button.dataset.file !== "design") refuse({ reason: `${button.textContent}: what was saved is the last good design, of an earlier question. The question of now has no design.` });
    else announce(`${button.textContent} is saved`);
  });
}

byId("open").addEventListener("change", async (event) => {
  const [file] = event.target.files;
  event.target.value = "";
  byId("files").open = false;
  if (!file) return;
  const wrong = await upload("/api/open", file);
  byId("notice").hidden = true;
  if (wrong) refuse({ reason: wrong });
  else {
    angle = null;
    announce(`${file.name} is opened. Undo brings back the design before.`);
  }
});

document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
  const key = event.key.toLowerCase();
  const typing = event.target instanceof HTMLInputElement && event.target.type === "text";
  if (typing || !["z", "y"].includes(key)) return;
  event.preventDefault();
  ask({ what: "step", back: key === "z" && !event.shiftKey, angle });
});

document.addEventListener("click", (event) => { if (!event.target.closest("#files")) byId("files").open = false; });
document.addEventListener("keydown", (event) => { if (event.key === "Escape") byId("files").open = false; });
