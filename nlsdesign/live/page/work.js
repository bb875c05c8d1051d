// Long work on demand: the tolerance cloud and the diagnosis of bench records.

import { Chart } from "./chart.js";
import { upload } from "./connection.js";
import { announce, byId, draw, make, text } from "./elements.js";
import { withUnit } from "./units.js";

export class Tolerance {
  constructor(ask) {
    this.run = byId("tolerance-run");
    this.stop = byId("tolerance-stop");
    this.words = byId("tolerance-state");
    this.run.addEventListener("click", () => ask({ what: "tolerance" }));
    this.stop.addEventListener("click", () => ask({ what: "cancel", name: "tolerance" }));
    this.chart = new Chart(byId("tolerance-chart"), { title: "Torque of made springs", x: { name: "angle θ", unit: "rad" }, y: { name: "torque", unit: "N*m" }, height: 220, zero: true });
    byId("tolerance-chart").hidden = true;
  }

  show(work, revision) {
    const running = work.state === "computing";
    this.stop.hidden = !running;
    this.run.disabled = running;
    byId("tolerance").setAttribute("aria-busy", String(running));
    const cloud = work.value;
    const old = work.revision !== revision;
    byId("tolerance").classList.toggle("stale", work.state === "done" && old);
    const done = () => `${cloud.draws} made springs: 95 % of them below ${withUnit(cloud.quantiles["0.95"], "N*m", 3)} rms error.`;
    text(this.words, work.state === "done" ? `${old ? "Of an earlier design. " : ""}${done()}` : `${work.state}: ${work.message}`);
    if (work.state !== "done") return;
    announce(this.words.textContent);
    byId("tolerance-chart").hidden = false;
    this.chart.show([
      { name: "90 % of the made springs", x: cloud.angles, y: cloud.upper, lower: cloud.lower, area: true, tone: "muted" },
      { name: "design", x: cloud.angles, y: cloud.nominal, tone: "blue" },
      { name: "target", x: cloud.angles, y: cloud.target, tone: "ink", dash: "dashed" },
    ]);
  }
}

export class Diagnosis {
  constructor(ask) {
    this.ask = ask;
    this.files = byId("records");
    this.run = byId("diagnosis-run");
    this.stop = byId("diagnosis-stop");
    this.words = byId("diagnosis-state");
    this.stages = byId("stages");
    this.gap = byId("gap");
    this.files.addEventListener("change", () => this.load([...this.files.files]));
    this.run.addEventListener("click", () => ask({ what: "diagnose" }));
    this.stop.addEventListener("click", () => ask({ what: "cancel", name: "diagnosis" }));
  }

  ready() {
    this.files.disabled = false;
  }

  async load(files) {
    this.files.value = "";
    if (files.length === 0) return;
    this.run.disabled = true;
    for (const [k, file] of files.entries()) {
      text(this.words, `loading ${file.name} …`);
      const wrong = await upload(`/api/records?name=${encodeURIComponent(file.name)}${k === 0 ? "&first=1" : ""}`, file);
      if (wrong) {
        text(this.words, wrong);
        announce(wrong);
        return;
      }
    }
    text(this.words, `${files.length} ${files.length === 1 ? "file is" : "files are"} loaded: ${files.map((each) => each.name).join(", ").slice(0, 300)}`);
    announce(this.words.textContent);
    this.run.disabled = false;
  }

  show(work) {
    const running = work.state === "computing";
    this.stop.hidden = !running;
    this.run.disabled = running;
    byId("diagnosis").setAttribute("aria-busy", String(running));
    const stages = work.stages ?? [];
    while (this.stages.children.length > stages.length) this.stages.lastChild.remove();
    stages.forEach((words, k) => {
      if (k >= this.stages.children.length) this.stages.append(make("li"));
      text(this.stages.children[k], words);
      this.stages.children[k].classList.toggle("now-running", running && k === stages.length - 1);
    });
    if (running) text(this.words, `running for ${Math.round(work.seconds)} s`);
    else if (work.state !== "done") text(this.words, `${work.state}: ${work.message}`);
    this.gap.replaceChildren();
    if (work.state !== "done") return;
    text(this.words, work.value.headline);
    announce(work.value.headline);
    this.gap.append(...work.value.gaps.map(gapRow));
  }
}

// The gap shrinks: before in vermillion, after in blue, on one scale.
function gapRow({ name, unit, before, after }) {
  const share = before > 0 ? Math.min(1, after / before) : 0;
  return make("div", { class: "gap-row" }, make("span", {}, name), make("span", { class: "numeric" }, `${before > 0 ? Math.round(100 * (1 - share)) : 0} % less`),
    draw("svg", { viewBox: "0 0 300 18", preserveAspectRatio: "none", role: "img", "aria-label": `before ${withUnit(before, unit, 3)}, after ${withUnit(after, unit, 3)}` },
      draw("rect", { class: "before", x: 0, y: 0, width: before > 0 ? 300 : 0, height: 8 }), draw("rect", { class: "after", x: 0, y: 10, width: 300 * share, height: 8 })),
    make("span", {}, `before ${withUnit(before, unit, 3)}`), make("span", { class: "numeric" }, `after ${withUnit(after, unit, 3)}`));
}
