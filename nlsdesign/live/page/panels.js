// What a design does over the angle, and at one angle.

import { Chart, range } from "./chart.js";
import { draw, make, nameText, text } from "./elements.js";
import { plain, withUnit } from "./units.js";

const TONES = ["blue", "vermillion", "green", "purple"];
const DASHES = ["", "dashed", "dotted", "broken"];
// Panel: title, columns (one, or all with an ending), name and unit of the ordinate, limit drawn in it.
const PANELS = [
  { title: "Torque error", columns: /^error$/, unit: "N*m", name: "error", zero: true },
  { title: "Strain of the rubber", columns: /\.strain$/, unit: "%", name: "strain", limit: "MaximumStrain", zero: true },
  { title: "Stress of the rubber", columns: /\.stress$/, unit: "Pa", name: "nominal stress", limit: "MaximumStress", zero: true },
  { title: "Tension of a cable", columns: /^tension$/, unit: "N", name: "tension", limit: "MaximumCableTension", zero: true },
  { title: "Radius of curvature", columns: /^radius_of_curvature$/, unit: "m", name: "radius", limit: "MinimumRadiusOfCurvature", capped: true },
  { title: "Lever arm", columns: /^lever_arm$/, unit: "m", name: "lever arm", zero: true },
  { title: "Stiffness", columns: /^stiffness$/, unit: "N*m/rad", name: "stiffness", limit: "PositiveStiffness", zero: true },
];

export class Panels {
  constructor(host) {
    this.charts = PANELS.map((panel) => {
      const card = host.appendChild(make("div", { class: "card" }));
      const chart = new Chart(card, { title: panel.title, x: { name: "angle θ", unit: "rad" }, y: { name: panel.name, unit: panel.unit }, height: 180, zero: panel.zero });
      return { ...panel, card, chart };
    });
    this.margins = host.appendChild(make("div", { class: "card" }));
    this.margins.append(make("div", { class: "head" }, make("h3", {}, "Margins to the limits")));
    this.bars = this.margins.appendChild(make("div", {}));
  }

  // frozen: while a hand drags, axes only grow, so that a curve does not jump with its scale.
  show(design, frozen) {
    const angles = design.columns[0].values;
    for (const { chart, columns, limit, capped, zero, card } of this.charts) {
      const chosen = design.columns.filter((each) => columns.test(each.name));
      card.hidden = chosen.length === 0;
      const series = chosen.map((each, k) => ({ name: chosen.length > 1 ? each.name.replace(/\.\w+$/, "") : chart.y.name, x: angles, y: each.values, tone: TONES[k % 4], dash: DASHES[k % 4] }));
      const bounds = limit ? design.margins.filter((each) => each.limit === limit) : [];
      for (const bound of new Set(bounds.map((each) => each.bound))) {
        series.push({ name: bounds[0].upper ? "largest allowed" : "least allowed", x: [angles[0], angles[angles.length - 1]], y: [bound, bound], tone: "orange", dash: "dashed", flat: true });
      }
      if (limit === "MaximumStrain" && design.beyond.length) series.push({ name: "end of what is stated of the rubber", x: [angles[0], angles[angles.length - 1]], y: [design.strain_end, design.strain_end], tone: "vermillion", dash: "dotted", flat: true });
      const shown = capped ? series.map((s) => s.y.map((v) => (v === null ? null : Math.min(v, cap(series))))) : series.map((s) => s.y);
      const wanted = { x: [angles[0], angles[angles.length - 1]], y: range(shown, { zero }) };
      if (frozen && this.drawn) {
        const held = chart.limits;
        wanted.y = wanted.y[0] < held.y[0] || wanted.y[1] > held.y[1] ? [Math.min(wanted.y[0], held.y[0]), Math.max(wanted.y[1], held.y[1])] : held.y;
        wanted.x = [held.x[0], Math.max(held.x[1], wanted.x[1])];
      }
      chart.show(series, { limits: wanted });
    }
    this.drawn = true;
    this.showMargins(design.margins);
  }

  showMargins(margins) {
    while (this.bars.children.length > margins.length) this.bars.lastChild.remove();
    while (this.bars.children.length < margins.length) this.bars.append(bar());
    margins.forEach((each, k) => {
      const row = this.bars.children[k];
      const used = each.upper ? each.value / each.bound : each.bound / each.value;
      // A radius below zero is a hollow: far beyond a least one, though the ratio is negative.
      const broken = each.margin < -5e-4 * Math.abs(each.bound);
      const share = broken ? 1 : Number.isFinite(used) ? Math.min(1.15, Math.max(0, used)) / 1.15 : 0;
      row.classList.toggle("active", each.active);
      nameText(row.children[0], each.of);
      text(row.children[1], `${withUnit(each.value, unit(each), 3)} ${bounded(each)}${broken ? " · BROKEN" : each.active ? " · active" : ""}`);
      row.children[2].firstChild.setAttribute("width", (300 * share).toFixed(1));
      row.children[2].firstChild.setAttribute("class", broken ? "broken" : each.active ? "sits" : "free");
    });
  }

  cursor(angle) {
    for (const { chart } of this.charts) chart.cursor(angle);
  }
}

// Limits that a design sits on, in words with their numbers.
export function sitsOn(design) {
  return design.margins.filter((each) => each.active).map((each) => `${each.of} ${bounded(each)}`).join(", ");
}

function bounded(margin) {
  return `${margin.upper ? "≤" : "≥"} ${withUnit(margin.bound, unit(margin), 3)}`;
}

function unit(margin) {
  return margin.shown_unit === "%" || margin.limit === "MaximumStrain" ? "%" : margin.unit;
}

function bar() {
  return make("div", { class: "margin-row" }, make("span"), make("span", { class: "now" }),
    draw("svg", { viewBox: "0 0 300 10", preserveAspectRatio: "none", "aria-hidden": "true" }, draw("rect", { x: 0, y: 1, height: 8 }), draw("path", { d: `M${300 / 1.15} 0V10`, class: "line orange" })));
}

// A flank of the contour may be almost straight: what its radius is there would hide all the rest.
function cap(series) {
  const values = series[0].y.filter((v) => v !== null && v > 0).sort((a, b) => a - b);
  return Math.max(4 * (values[Math.floor(values.length / 4)] ?? 1), 1.5 * (series[1]?.y[0] ?? 0));
}

export class AtAngle {
  constructor(host, ask) {
    const card = (title, name) => {
      const state = make("p", { class: "job" });
      const place = make("div", { class: "card" }, make("div", { class: "head" }, make("h3", {}, title)), state);
      host.append(place);
      return { place, state, name };
    };
    this.seen = card("Observability", "observability");
    this.seen.list = this.seen.place.appendChild(make("dl", { class: "numbers" }));
    this.poles = card("Poles of the plant", "poles");
    this.poles.chart = new Chart(inner(this.poles.place), { title: "", x: { name: "real part, logarithmic,", unit: "1/s" }, y: { name: "imaginary part, log.,", unit: "rad/s" }, height: 200, symlog: true });
    this.loop = card("Torque loop", "loop");
    this.run = make("button", { type: "button", "aria-label": "Compute the torque loop", onclick: () => ask({ what: "work", name: "TorqueLoop" }) }, "Compute");
    this.loop.place.firstChild.append(this.run);
    this.loop.magnitude = new Chart(inner(this.loop.place), { title: "Magnitude", x: { name: "frequency", unit: "Hz" }, y: { name: "magnitude", unit: "dB" }, height: 150, log: true });
    this.loop.phase = new Chart(inner(this.loop.place), { title: "Phase", x: { name: "frequency", unit: "Hz" }, y: { name: "phase in °", unit: "" }, height: 130, log: true });
  }

  // Whether what is shown is that of a design at an angle.
  holds(revision, angle) {
    return this.at?.poles.revision === revision && Math.abs(this.at.angle - angle) < 1e-5;
  }

  show(at) {
    this.at = at;
    this.state(this.seen, at.observability, ({ verdict }) => verdict);
    const seen = at.observability.value;
    if (seen) {
      const rows = [["measured", seen.measured], ["rank", `${seen.rank} of ${seen.states}`], ["condition", plain(seen.condition, 3)]];
      this.seen.list.replaceChildren(...rows.flatMap(([name, words]) => [make("dt", {}, name), make("dd", {}, words)]));
    }
    this.state(this.poles, at.poles, (groups) => groups.map((each) => `${each.words}: ${poleWords(each)}`).join("; "));
    if (at.poles.value) this.poles.chart.alternative = `Poles of the plant: ${at.poles.value.map((each) => `${each.mode}: ${poleWords(each)}`).join("; ")}`;
    if (at.poles.value) this.poles.chart.show(at.poles.value.map((each, k) => ({ name: each.mode, x: each.real, y: each.imaginary, points: true, tone: TONES[k % 4] })));
    this.loopState();
    const loop = at.loop.value;
    if (loop) {
      this.loop.magnitude.show([{ name: "", x: loop.frequencies, y: loop.magnitude, tone: "blue" }]);
      this.loop.phase.show([{ name: "", x: loop.frequencies, y: loop.phase, tone: "blue" }]);
    }
  }

  showLoopWork(work) {
    this.work = work;
    this.loopState();
  }

  // One text for the loop, from what is known at the angle and from the work that runs.
  loopState() {
    const lazy = this.at?.loop, work = this.work, card = this.loop;
    const done = lazy?.state === "done" && lazy.value !== null;
    const running = work?.state === "computing", ofNow = lazy?.state === "computing" || work?.old === false;
    card.shown ||= done;
    const old = card.shown && !done;
    card.place.classList.toggle("stale", old);
    card.place.setAttribute("aria-busy", String(running && !done));
    this.run.hidden = done || (running && ofNow);
    const seen = old ? " The curve is greyed: it is of an earlier design." : "";
    let words = old ? `Not computed for this design.${seen}` : "not computed yet";
    if (done) words = `${lazy.value.stable ? "Stable" : "UNSTABLE"} ${lazy.message}${bandwidth(lazy.value)}: ${lazy.value.words}.`;
    else if (running) words = `computing${ofNow ? "" : " of an earlier design"}: ${work.message}, for ${Math.round(work.seconds)} s.${seen}`;
    else if (work?.state === "failed" && ofNow) words = `failed: ${work.message}.${seen}`;
    else if (work?.state === "cancelled" && ofNow) words = `Stopped.${seen}`;
    text(card.state, words);
  }

  // Each has a state of its own and says what it holds for.
  state(card, lazy, words) {
    const done = lazy.state === "done" && lazy.value !== null;
    card.place.classList.toggle("stale", !done && card.shown === true);
    card.shown ||= done;
    card.place.setAttribute("aria-busy", String(lazy.state === "computing"));
    const said = { computing: `computing ${lazy.message}`, failed: `failed: ${lazy.message}`, cancelled: "stopped", "asked for later": "not computed yet" };
    text(card.state, done ? words(lazy.value) : said[lazy.state] ?? lazy.state);
  }
}

// Where the response falls by 3 dB for the first time.
function bandwidth({ frequencies, magnitude, stable }) {
  const k = magnitude.findIndex((value) => value < -3);
  return stable && k > 0 ? `, −3 dB at ${plain(frequencies[k], 2)} Hz` : "";
}

// Pairs once, as a person writes them.
function poleWords({ real, imaginary }) {
  const shown = real.map((re, k) => [re, imaginary[k]]).filter(([, im]) => im >= 0);
  return `${shown.map(([re, im]) => (im > 0 ? `${plain(re, 3)} ± ${plain(im, 3)}i` : plain(re, 3))).join(", ")} in 1/s`;
}

function inner(place) {
  return place.appendChild(make("div", {}));
}
