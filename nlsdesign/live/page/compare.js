// Kept designs side by side: numbers in a table, torque curves in one chart.

import { Chart } from "./chart.js";
import { byId, make } from "./elements.js";
import { sitsOn } from "./panels.js";
import { plain, withUnit } from "./units.js";

const TONES = ["vermillion", "green", "purple", "orange", "ink", "muted", "vermillion", "green"];
const DASHES = ["dashed", "dotted", "broken"];

export class Compare {
  constructor(ask) {
    this.ask = ask;
    this.chart = new Chart(byId("compare-chart"), { title: "Torque of the kept designs", x: { name: "angle θ", unit: "rad" }, y: { name: "torque", unit: "N*m" }, height: 240, zero: true });
    this.kept = [];
  }

  // now: { name, title, material, design } of what is shown at present, or null.
  show(kept, now) {
    if (kept) this.kept = kept;
    const section = byId("compare");
    section.hidden = this.kept.length === 0;
    if (section.hidden) return;
    const columns = [...this.kept, ...(now ? [now] : [])].filter((each) => each.design);
    const names = [...new Set(columns.flatMap(({ design }) => design.numbers.map((each) => each.name)))];
    const row = (head, words) => make("tr", {}, make("th", { scope: "row" }, head), ...columns.map((each) => make("td", { class: "numeric" }, words(each))));
    const number = (design, name) => {
      const given = design.numbers.find((each) => each.name === name);
      return given ? `${withUnit(given.value, given.unit)}${given.free ? " (free)" : ""}` : "–";
    };
    const heads = columns.map((each) => make("th", { scope: "col", class: "numeric", "aria-label": each.name }, each.name, " ",
      each === now ? null : make("button", { type: "button", "aria-label": `Forget ${each.name}`, onclick: () => this.ask({ what: "keep", forget: true, name: each.name }) }, "×")));
    byId("compare-table").replaceChildren(
      make("thead", {}, make("tr", {}, make("th", { scope: "col" }, "design"), ...heads)),
      make("tbody", {},
        row("actuator", (each) => each.title),
        row("rubber of the library", (each) => each.material || "that of the deck"),
        row("answer", ({ design }) => (design.checked ? "checked" : "quick")),
        row("torque error, 95 % of made springs", ({ design }) => (design.made_error === null ? "–" : `${withUnit(design.made_error, "N*m", 3)} rms`)),
        row("torque error, exact numbers", ({ design }) => `${withUnit(design.rms_error, "N*m", 3)} (${plain(100 * design.relative_error, 2)} %)`),
        row("largest error, exact numbers", ({ design }) => withUnit(design.largest_error, "N*m", 3)),
        row("limits that it sits on", ({ design }) => sitsOn(design) || "none"),
        row("rubber", ({ design }) => withUnit(design.rubber_volume, "m^3", 3)),
        ...names.map((name) => row(name, ({ design }) => number(design, name)))),
    );
    const column = (design, name) => design.columns.find((each) => each.name === name).values;
    this.chart.show(columns.map((each, k) => ({
      name: each.name, x: column(each.design, "angle"), y: column(each.design, "torque"),
      tone: each === now ? "blue" : TONES[k % TONES.length], dash: each === now ? "" : DASHES[k % 3],
    })));
  }

  cursor(angle) {
    if (this.kept.length) this.chart.cursor(angle);
  }
}
