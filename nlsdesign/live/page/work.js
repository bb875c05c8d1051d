// Long work on demand: the tolerance cloud and the diagnosis of bench records.

import { Chart, range } from "./chart.js";
import { upload } from "./connection.js";
import { announce, byId, draw, make, text } from "./elements.js";
import { withUnit } from "./units.js";

export class Tolerance {
  constructor(ask) {
    this.run = byId("tolerance-run");
    this.stop = byId("tolerance-stop");
    this.words = byId("tolerance-state");
    this.purpose = this.words.textContent;
    this.run.addEventListener("click", () => ask({ what: "work", name: "ToleranceCloud" }));
    this.stop.addEventListener("click", () => ask({ what: "work", name: "ToleranceCloud", stop: true }));
    this.chart = new Chart(byId("tolerance-chart"), { title: "Torque of made springs", x: { name: "angle θ", unit: "rad" }, y: { name: "torque", unit: "N*m" }, height: 220, zero: true });
    byId("tolerance-chart").hidden = true;
  }

  show(work, answer) {
    const running = work.state === "computing";
    this.stop.hidden = !running;
    this.run.disabled = running || !answer?.design;
    byId("tolerance").setAttribute("aria-busy", String(running));
    const cloud = work.value;
    const old = work.old || work.revision !== answer?.revision;
    byId("tolerance").classList.toggle("stale", old && cloud !== null);
    if (!cloud) {
      if (work.state === "not begun") text(this.words, this.purpose);
      else text(this.words, running ? `${work.message}, for ${Math.round(work.seconds)} s` : ended(work));
      byId("tolerance-chart").hidden = true;
      return;
    }
    const sorted = [...cloud.errors].sort((a, b) => a - b);
    const words = `${old ? "Of an earlier design, compute it anew. " : ""}${sorted.length} made springs: 95 % have an rms error below ${withUnit(sorted[Math.ceil(0.95 * sorted.length) - 1], "N*m", 3)}.`;
    if (this.words.textContent !== words) announce(words);
    text(this.words, words);
    byId("tolerance-chart").hidden = false;
    const target = answer.design && !old ? [{ name: "target", x: answer.design.columns[0].values, y: answer.design.columns.find((each) => each.name === "target").values, tone: "ink", dash: "dashed" }] : [];
    this.chart.show([
      { name: "90 % of the made springs", x: cloud.angles, y: cloud.band[2], lower: cloud.band[0], area: true, tone: "muted" },
      { name: "without deviations", x: cloud.angles, y: cloud.nominal, tone: "blue" },
      ...target,
    ], { limits: { x: [cloud.angles[0], cloud.angles.at(-1)], y: range([cloud.band[0], cloud.band[2]], { zero: true }) } });
  }

  cursor(angle) {
    this.chart.cursor(angle);
  }
}

export class Diagnosis {
  constructor(ask) {
    this.ask = ask;
    this.files = byId("records");
    this.run = byId("diagnosis-run");
    this.stop = byId("diagnosis-stop");
    this.words = byId("diagnosis-state");
    this.purpose = this.words.textContent;
    this.stages = byId("stages");
    this.gap = byId("gap");
    this.stages.hidden = true;
    this.loaded = false;
    this.loading = false;
    this.files.addEventListener("change", () => this.load([...this.files.files]));
    this.run.addEventListener("click", () => ask({ what: "work", name: "DiagnoseRecords" }));
    this.stop.addEventListener("click", () => ask({ what: "work", name: "DiagnoseRecords", stop: true }));
  }

  ready() {
    this.files.disabled = false;
  }

  async load(files) {
    this.files.value = "";
    if (files.length === 0) return;
    if (!this.stop.hidden) this.ask({ what: "work", name: "DiagnoseRecords", stop: true });
    this.run.disabled = true;
    this.loaded = false;
    this.loading = true;
    this.clear();
    await this.send(files);
    this.loading = false;
    this.run.disabled = !this.loaded;
  }

  async send(files) {
    for (const [k, file] of files.entries()) {
      text(this.words, `loading ${file.name} …`);
      const wrong = await upload(`/api/records?name=${encodeURIComponent(file.name)}${k === 0 ? "&first=1" : ""}`, file);
      if (wrong) {
        text(this.words, wrong);
        announce(wrong);
        return;
      }
    }
    text(this.words, there(files.map((each) => each.name)));
    announce(this.words.textContent);
    this.loaded = true;
  }

  clear() {
    this.gap.replaceChildren();
    this.stages.replaceChildren();
    this.stages.hidden = true;
  }

  show(work) {
    if (this.loading) {
      this.stop.hidden = work.state !== "computing";
      return;
    }
    this.loaded = work.files.length > 0;
    if (work.state === "not begun") {
      this.clear();
      this.stop.hidden = true;
      this.run.disabled = !this.loaded;
      text(this.words, this.loaded ? there(work.files) : this.purpose);
      return;
    }
    const running = work.state === "computing";
    this.stop.hidden = !running;
    this.run.disabled = running || !this.loaded;
    byId("diagnosis").setAttribute("aria-busy", String(running));
    while (this.stages.children.length > work.stages.length) this.stages.lastChild.remove();
    work.stages.forEach((words, k) => {
      if (k >= this.stages.children.length) this.stages.append(make("li"));
      text(this.stages.children[k], words);
      this.stages.children[k].classList.toggle("now-running", running && k === work.stages.length - 1);
    });
    this.stages.hidden = work.stages.length === 0;
    this.stages.scrollTop = this.stages.scrollHeight;
    const result = work.value;
    if (!result) {
      const files = this.loaded ? there(work.files) : "";
      text(this.words, running ? `running for ${Math.round(work.seconds)} s` : work.old ? files : `${ended(work)}${files && `; ${files}`}`);
      this.gap.replaceChildren();
      return;
    }
    const words = VERDICTS[result.verdict] ?? result.verdict;
    const verdict = result.effects.length ? `${words}: ${result.effects.join("; ")}` : words;
    const named = work.old ? `Of other records or another machine, diagnose anew. ${verdict}` : verdict;
    this.gap.classList.toggle("stale", work.old);
    if (this.words.textContent === named) return;
    text(this.words, named);
    announce(named);
    const chart = make("div", {});
    this.gap.replaceChildren(gapRow(result.gap), chart, make("details", { class: "more" }, make("summary", {}, "the whole verdict"), make("pre", {}, result.words)));
    const { time, measured, before, after, unit, quantity, record } = result.course;
    const error = (row) => row.map((value, k) => (value === null ? null : measured[k] - value));
    new Chart(chart, { title: `Error of ${quantity}, ${record}`, x: { name: "time", unit: "s" }, y: { name: "error", unit }, height: 190 })
      .show([{ name: "as declared", x: time, y: error(before), tone: "vermillion", dash: "thin" }, { name: "with what was named", x: time, y: error(after), tone: "blue", dash: "thin" }]);
  }
}

export function ended(work) {
  return work.state === "cancelled" ? "stopped" : `${work.state}: ${work.message}`;
}

function there(names) {
  return `${names.length} ${names.length === 1 ? "file is" : "files are"} loaded: ${names.join(", ").slice(0, 300)}`;
}

const VERDICTS = {
  none: "Nothing is missing that these records show",
  named: "Missing in the declared machine",
  unknown: "Something is missing that the catalogue does not know",
  undecidable: "These records cannot decide what is missing",
  data_suspect: "The records themselves are in doubt",
};

// The gap shrinks: before in vermillion, after in blue, the noise floor as a mark, on one scale.
function gapRow({ beside, unit, before, after, noise_floor: floor, role }) {
  const most = Math.max(before, after, floor) || 1;
  const wide = (value) => (300 * value / most).toFixed(1);
  const less = before > 0 ? Math.round(100 * (1 - after / before)) : 0;
  return make("div", { class: "gap-row" }, make("span", {}, `error of ${beside}, ${role.replace("_", " ")} records`), make("span", { class: "numeric" }, `${less} % less`),
    draw("svg", { viewBox: "0 0 300 20", preserveAspectRatio: "none", role: "img", "aria-label": `before ${withUnit(before, unit, 3)}, after ${withUnit(after, unit, 3)}, noise alone ${withUnit(floor, unit, 3)}` },
      draw("rect", { class: "before", x: 0, y: 0, width: wide(before), height: 9 }), draw("rect", { class: "after", x: 0, y: 11, width: wide(after), height: 9 }),
      draw("path", { class: "line ink", d: `M${wide(floor)} 0V20`, "vector-effect": "non-scaling-stroke" })),
    make("span", {}, `before ${withUnit(before, unit, 3)}, noise alone ${withUnit(floor, unit, 3)}`), make("span", { class: "numeric" }, `after ${withUnit(after, unit, 3)}`));
}
