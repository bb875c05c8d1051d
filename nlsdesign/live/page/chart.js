// One panel with axes, lines and a cursor that all panels share. Drawn once; then only paths change.

import { draw, make, set, text } from "./elements.js";
import { factorOf, plain, powerOf, scaled, unitOf, withUnit } from "./units.js";

const LEFT = 56, RIGHT = 10, TOP = 10, BOTTOM = 30;

export function ticks(low, high, count) {
  const span = high - low;
  const power = 10 ** Math.floor(Math.log10(span / count));
  const step = [1, 2, 2.5, 5, 10].map((k) => k * power).find((k) => span / k <= count) ?? 10 * power;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; k += 1) found.push(Number((k * step).toPrecision(12)));
  return found;
}

// A range that holds all numbers with some room; never empty.
export function range(rows, { zero = false } = {}) {
  let low = Infinity, high = -Infinity;
  for (const row of rows) for (const value of row) {
    if (value !== null && Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
  }
  if (low > high) return [0, 1];
  if (zero) { low = Math.min(low, 0); high = Math.max(high, 0); }
  const room = high - low > 1e-12 * Math.max(1, Math.abs(high)) ? 0.06 * (high - low) : Math.max(0.1 * Math.abs(high), 1e-9);
  return [zero && low === 0 ? 0 : low - room, zero && high === 0 ? 0 : high + room];
}

export class Chart {
  // x and y: { name, unit }; the unit in SI. log: the abscissa.
  constructor(host, { title, x, y, height = 190, width = 420, log = false, zero = false, symlog = false }) {
    Object.assign(this, { title, x, y, width, height, log, zero, symlog });
    this.svg = draw("svg", { role: "img", class: "chart", viewBox: `0 0 ${width} ${height}`, "aria-label": title });
    this.grid = draw("g", { class: "grid" });
    this.lines = draw("g", { class: "lines" });
    this.over = draw("g", { class: "over" });
    this.cursorLine = draw("line", { class: "cursor", y1: TOP, y2: height - BOTTOM, x1: 0, x2: 0, visibility: "hidden" });
    this.dots = draw("g", { class: "dots" });
    this.svg.append(this.grid, this.lines, ...(log || symlog ? [] : [this.cursorLine]), this.dots, this.over);
    this.svg.classList.add("empty");
    this.heading = title ? make("h3", {}, title) : null;
    this.key = make("ul", { class: "key" });
    this.value = make("p", { class: "now" });
    host.append(make("div", { class: "head" }, ...(title ? [this.heading] : []), this.value), this.svg, this.key);
    this.paths = [];
    this.series = [];
    this.limits = { x: log ? [0.1, 10] : [0, 1], y: [0, 1] };
    this.at = null;
    this.fit(host);
  }

  // The picture has the size of its place, so that letters have theirs on every screen.
  fit(host) {
    const observer = new ResizeObserver(([entry]) => {
      const width = Math.round(entry.contentRect.width);
      if (width < 60 || width === this.width) return;
      this.width = width;
      set(this.svg, { viewBox: `0 0 ${width} ${this.height}` });
      this.drawn = "";
      this.redraw();
    });
    observer.observe(host);
    set(this.svg, { height: this.height });
  }

  px(value) {
    const [low, high] = this.symlog ? this.limits.x.map(folded) : this.limits.x;
    if (this.symlog) value = folded(value);
    const share = this.log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return LEFT + share * (this.width - LEFT - RIGHT);
  }

  py(value) {
    const [low, high] = this.symlog ? this.limits.y.map(folded) : this.limits.y;
    if (this.symlog) value = folded(value);
    return TOP + (high - value) / (high - low) * (this.height - TOP - BOTTOM);
  }

  // From a place in the picture back to numbers in SI.
  place(event) {
    const box = this.svg.getBoundingClientRect();
    const [a, b] = this.limits.x, [low, high] = this.limits.y;
    const sx = (event.clientX - box.left) * this.width / box.width, sy = (event.clientY - box.top) * this.height / box.height;
    return [a + (sx - LEFT) / (this.width - LEFT - RIGHT) * (b - a), high - (sy - TOP) / (this.height - TOP - BOTTOM) * (high - low)];
  }

  // series: [{ name, x, y, tone, dash, points }]; frozen: keep the axes, as while a point is dragged.
  show(series, { frozen = false, limits = null } = {}) {
    this.series = series;
    this.svg.classList.toggle("empty", series.length === 0);
    if (!frozen) {
      const next = limits ?? {};
      this.limits = {
        x: next.x ?? (this.symlog ? around(series.map((s) => s.x)) : this.log ? logRange(series) : tight(series.map((s) => s.x))),
        y: next.y ?? (this.symlog ? around(series.map((s) => s.y)) : range(series.map((s) => s.y), { zero: this.zero })),
      };
    }
    this.redraw();
  }

  redraw() {
    if (this.series.length === 0) return;
    this.axes();
    while (this.paths.length < this.series.length) this.paths.push(this.lines.appendChild(draw("path", { fill: "none" })));
    while (this.paths.length > this.series.length) this.paths.pop().remove();
    this.series.forEach((s, k) => {
      set(this.paths[k], { d: s.points ? this.marks(s) : s.area ? this.area(s) : this.path(s), class: `line ${s.tone} ${s.dash ?? ""} ${s.points ? "points" : ""} ${s.area ? "area" : ""}` });
    });
    this.entries();
    this.cursor(this.at);
  }

  path({ x, y }) {
    let d = "", pen = "M", outside = false;
    for (let k = 0; k < x.length; k += 1) {
      if (y[k] === null || !Number.isFinite(y[k])) { pen = "M"; continue; }
      // A line along the edge would read as values that are there.
      const beyond = this.py(y[k]) < 0 || this.py(y[k]) > this.height;
      if (beyond && outside) pen = "M";
      outside = beyond;
      d += `${pen}${this.px(x[k]).toFixed(1)} ${this.clipped(y[k]).toFixed(1)}`;
      pen = "L";
    }
    return d || "M-9 -9";
  }

  area({ x, y, lower }) {
    const up = x.map((v, k) => `${this.px(v).toFixed(1)} ${this.clipped(y[k]).toFixed(1)}`);
    const down = x.map((v, k) => `${this.px(v).toFixed(1)} ${this.clipped(lower[k]).toFixed(1)}`).reverse();
    return `M${[...up, ...down].join("L")}Z`;
  }

  marks({ x, y }) {
    return x.map((v, k) => {
      const a = this.px(v), b = this.clipped(y[k]);
      return `M${a - 4} ${b - 4}L${a + 4} ${b + 4}M${a - 4} ${b + 4}L${a + 4} ${b - 4}`;
    }).join("") || "M-9 -9";
  }

  clipped(value) {
    return Math.min(this.height, Math.max(0, this.py(value)));
  }

  axes() {
    const code = JSON.stringify([this.limits, this.width]);
    if (code === this.drawn) return;
    this.drawn = code;
    this.grid.replaceChildren();
    const fx = factorOf(this.x.unit), [unitUp, fy] = scaled(this.y.unit, Math.max(...this.limits.y.map(Math.abs)));
    const bottom = this.height - BOTTOM, right = this.width - RIGHT;
    const px = (value) => this.px(value), py = (value) => this.py(value);
    const decades = this.log || this.symlog ? powers(this.limits.x, px, 28) : null, written = decades ? powerOf : (value) => plain(value * fx);
    if (decades) for (const value of between(this.limits.x, px, this.symlog)) this.grid.append(draw("line", { class: "minor", x1: px(value), x2: px(value), y1: TOP, y2: bottom }));
    if (this.symlog) for (const value of between(this.limits.y, py, true)) this.grid.append(draw("line", { class: "minor", x1: LEFT, x2: right, y1: py(value), y2: py(value) }));
    const across = decades ?? ticks(...this.limits.x.map((v) => v * fx), this.width / 70).map((v) => v / fx);
    for (const value of across) {
      const a = this.px(value);
      this.grid.append(draw("line", { x1: a, x2: a, y1: TOP, y2: bottom }), draw("text", { x: a, y: bottom + 13, "text-anchor": "middle" }, written(value)));
    }
    const up = this.symlog ? powers(this.limits.y, py, 15) : ticks(...this.limits.y.map((v) => v * fy), this.height / 38).map((v) => v / fy);
    for (const value of up) {
      const b = this.py(value);
      this.grid.append(draw("line", { x1: LEFT, x2: right, y1: b, y2: b }), draw("text", { x: LEFT - 6, y: b + 3.5, "text-anchor": "end" }, this.symlog ? powerOf(value) : plain(value * fy)));
    }
    const named = (axis, unit) => (unit ? `${axis.name} in ${unit}` : axis.name);
    this.grid.append(
      draw("text", { class: "axis", x: right, y: this.height - 4, "text-anchor": "end" }, named(this.x, unitOf(this.x.unit))),
      draw("text", { class: "axis", x: 11, y: TOP + (bottom - TOP) / 2, "text-anchor": "middle", transform: `rotate(-90 11 ${TOP + (bottom - TOP) / 2})` }, named(this.y, unitUp)),
    );
  }

  entries() {
    const named = this.series.filter((s) => s.name);
    const code = named.map((s) => s.name + s.tone + s.dash).join("|");
    if (code === this.keyed) return;
    this.keyed = code;
    this.key.replaceChildren(...(named.length > 1 ? named.map((s) => make("li", {}, sample(s), s.name)) : []));
  }

  // The common cursor: a line, a dot on each curve, and its number in words.
  cursor(at) {
    this.at = at;
    this.dots.replaceChildren();
    if (at === null || this.log || this.symlog || this.series.length === 0) { this.describe(""); return; }
    set(this.cursorLine, { x1: this.px(at), x2: this.px(at), visibility: "visible" });
    const now = [];
    for (const s of this.series) {
      if (s.points || s.area || s.flat) continue;
      const value = interpolated(s.x, s.y, at);
      if (value === null) continue;
      this.dots.append(draw("circle", { cx: this.px(at), cy: this.clipped(value), r: 3.2, class: s.tone }));
      now.push([s.name, withUnit(value, this.y.unit)]);
    }
    const words = now.length > 1 ? now.slice(0, 2).map(([name, number]) => `${name} ${number}`) : now.map(([, number]) => number);
    text(this.value, words.join(" · "));
    this.describe(`; at ${withUnit(at, this.x.unit, 3)}: ${words.join(", ") || "no number"}`);
  }

  // In words what the picture shows, once the hand rests: where each curve begins and ends, and what it reaches.
  describe(here) {
    clearTimeout(this.describing);
    this.describing = setTimeout(() => {
      const curves = this.series.filter((s) => !s.points).map((s) => `${s.name ? `${s.name} ` : ""}${course(s, this.x, this.y)}`);
      const title = this.y.unit ? this.title : `${this.title} (${this.y.name})`;
      const words = this.alternative ?? `${title} over ${this.x.name}: ${curves.join("; ")}${here}`;
      if (this.svg.getAttribute("aria-label") !== words) this.svg.setAttribute("aria-label", words);
    }, 150);
  }
}

function course({ x, y, lower, flat }, across, up) {
  if (flat) return withUnit(y[0], up.unit, 3);
  if (lower) return `from ${withUnit(lower.at(-1), up.unit, 3)} to ${withUnit(y.at(-1), up.unit, 3)} at ${withUnit(x.at(-1), across.unit, 3)}`;
  const known = x.map((at, k) => [at, y[k]]).filter(([, value]) => value !== null && Number.isFinite(value));
  if (known.length === 0) return "no number";
  const least = known.reduce((a, b) => (b[1] < a[1] ? b : a)), most = known.reduce((a, b) => (b[1] > a[1] ? b : a));
  const at = ([place, value]) => `${withUnit(value, up.unit, 3)} at ${withUnit(place, across.unit, 3)}`;
  return `from ${at(known[0])} to ${at(known.at(-1))}, least ${at(least)}, largest ${at(most)}`;
}

export function interpolated(x, y, at) {
  if (x.length === 0 || at < x[0] - 1e-9 || at > x[x.length - 1] + 1e-9) return null;
  let k = 1;
  while (k < x.length - 1 && x[k] < at) k += 1;
  if (x.length === 1) return y[0];
  if (y[k - 1] === null || y[k] === null) return null;
  const share = x[k] > x[k - 1] ? Math.min(1, Math.max(0, (at - x[k - 1]) / (x[k] - x[k - 1]))) : 0;
  return y[k - 1] + share * (y[k] - y[k - 1]);
}

function tight(rows) {
  const all = rows.flat().filter((v) => Number.isFinite(v));
  if (all.length === 0) return [0, 1];
  let low = Math.min(...all), high = Math.max(...all);
  if (low === high) { low -= 0.5; high += 0.5; }
  return [low, high];
}

// Zero inside, room on both sides.
function around(rows) {
  const [low, high] = tight(rows);
  return [Math.min(3 * low, -12), Math.max(3 * high, 12)];
}

function logRange(series) {
  const [low, high] = tight(series.map((s) => s.x.filter((v) => v > 0)));
  return low > 0 ? [low, high] : [0.1, 10];
}

// Poles lie between one per minute and ten thousand per second, on both sides of zero.
function folded(value) {
  return Math.sign(value) * Math.log10(1 + Math.abs(value));
}

// Powers of ten that are as far apart as their labels need, from the smallest size outwards; zero where it is inside.
export function powers([low, high], place, room) {
  const signs = low > 0 ? [1] : [1, -1], found = low > 0 ? [] : [0];
  const first = low > 0 ? Math.ceil(Math.log10(low) - 1e-6) : 0;
  const zero = found.length ? place(0) : -Infinity;
  for (const sign of signs) {
    let last = zero;
    for (let power = first; sign * 10 ** power <= high * 1.001 && sign * 10 ** power >= (low > 0 ? 0 : low); power += 1) {
      const value = sign * 10 ** power;
      if (Math.abs(place(value) - last) < (last === zero ? 0.75 : 1) * room) continue;  // "0" is narrow
      found.push(value);
      last = place(value);
    }
  }
  return found;
}

// Fine lines at two to nine times each power, which show that a scale is no linear one.
function between([low, high], place, both) {
  const found = [], most = Math.max(high, both ? -low : high);
  const first = both ? 0 : Math.floor(Math.log10(low));
  if (Math.abs(place(10 ** (first + 2)) - place(10 ** (first + 1))) < 18) return found;
  for (let power = first; 10 ** power < most; power += 1) for (let k = 2; k < 10; k += 1) {
    for (const value of both ? [k * 10 ** power, -k * 10 ** power] : [k * 10 ** power]) if (value >= low && value <= high) found.push(value);
  }
  return found;
}

function sample({ tone, dash, points, area }) {
  const mark = points ? "M8 2L16 10M8 10L16 2" : area ? "M0 2H24V10H0Z" : "M0 6H24";
  return draw("svg", { viewBox: "0 0 24 12", width: 24, height: 12, "aria-hidden": "true" }, draw("path", { d: mark, fill: "none", class: `line ${tone} ${dash ?? ""} ${area ? "area" : ""}` }));
}
