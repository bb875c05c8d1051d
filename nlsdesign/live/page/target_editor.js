// The torque curve with its target points: moved by mouse, finger or keys.

import { Chart, range } from "./chart.js";
import { announce, draw, set } from "./elements.js";
import { factorOf, plain, withUnit } from "./units.js";

const HELP = "Arrow keys move the point, with Shift in large steps; Delete removes it, Insert adds one after it.";

export class TargetEditor extends Chart {
  // act: { move(k, angle, torque, last), remove(k), add(angle) }
  constructor(host, act) {
    super(host, {
      title: "Torque", x: { name: "angle θ", unit: "rad" }, y: { name: "torque", unit: "N*m" }, height: 380, zero: true,
    });
    this.act = act;
    this.targets = [];
    this.handles = [];
    this.dragged = -1;
    set(this.svg, { role: "group" });
    this.svg.addEventListener("dblclick", (event) => {
      if (!event.target.closest(".handle")) this.act.add(...this.place(event));
    });
  }

  // points: [[angle, torque]]; what is dragged at the moment stays under the hand.
  showTarget(points) {
    this.points = points.map((each) => [...each]);
    while (this.handles.length < points.length) this.handles.push(this.handle(this.handles.length));
    while (this.handles.length > points.length) {
      const lost = this.handles.pop();
      if (document.activeElement === lost) this.handles.at(-1)?.focus();
      lost.remove();
    }
    points.forEach((_, k) => { if (k !== this.dragged) this.put(k); });
  }

  handle(k) {
    const knob = draw("circle", { class: "knob", r: 6.5 });
    const group = draw("g", { class: "handle", tabindex: 0, role: "slider", "aria-roledescription": "target point" },
      draw("circle", { class: "reach", r: 20 }), draw("circle", { class: "ring", r: 11 }), knob);
    if (!this.held(k)) group.addEventListener("pointerdown", (event) => this.grab(event, k));
    group.addEventListener("keydown", (event) => this.pressed(event, k));
    group.addEventListener("keyup", (event) => { if (event.key.startsWith("Arrow") || event.key.startsWith("Page")) this.rest(k); });
    this.over.append(group);
    if (this.held(k)) {
      // A mark, no control: the curve begins at angle zero without torque.
      group.replaceChildren(draw("circle", { class: "knob", r: 3.5 }));
      group.classList.add("fixed");
      for (const name of ["tabindex", "role", "aria-roledescription"]) group.removeAttribute(name);
      set(group, { "aria-hidden": "true" });
    }
    return group;
  }

  put(k) {
    const [angle, torque] = this.points[k];
    set(this.handles[k], { transform: `translate(${this.px(angle).toFixed(2)} ${this.py(torque).toFixed(2)})` });
    if (!this.held(k)) set(this.handles[k], {
      "aria-label": `Target point ${k + 1} of ${this.points.length}. ${HELP}`,
      "aria-valuenow": plain(torque), "aria-valuemin": plain(this.bounds.torque[0]), "aria-valuemax": plain(this.bounds.torque[1]),
      "aria-valuetext": `${withUnit(torque, "N*m", 4)} at ${withUnit(angle, "rad", 4)}`, "aria-orientation": "vertical",
    });
  }

  redraw() {
    super.redraw();
    if (this.points) this.points.forEach((_, k) => { if (this.handles[k]) this.put(k); });
  }

  // The interval in which a point may move: between its neighbours, within what the server takes.
  allowed(k) {
    const room = 0.002;
    return [
      k > 0 ? this.points[k - 1][0] + room : this.bounds.angle[0],
      k < this.points.length - 1 ? this.points[k + 1][0] - room : this.bounds.angle[1],
    ];
  }

  move(k, angle, torque) {
    const [low, high] = this.allowed(k);
    this.points[k] = [Math.min(high, Math.max(low, angle)), Math.min(this.bounds.torque[1], Math.max(this.bounds.torque[0], torque))];
    this.put(k);
  }

  // The first point stands at the begin of the curve; its angle is no choice.
  held(k) {
    return k === 0 && this.bounds.firstHeld;
  }

  grab(event, k) {
    if (event.button > 0) return;
    event.preventDefault();
    const group = this.handles[k];
    group.focus({ preventScroll: true });
    group.setPointerCapture(event.pointerId);
    this.dragged = k;
    const [a, t] = this.place(event), [angle, torque] = this.points[k];
    const offset = [angle - a, torque - t];
    const moved = (now) => {
      const begin = performance.now();
      const [x, y] = this.place(now);
      // Within the picture: it grows when the hand lets go.
      this.move(k, Math.min(this.limits.x[1], x + offset[0]), Math.min(this.limits.y[1], y + offset[1]));
      this.act.move(k, ...this.points[k], false, begin);
    };
    const done = () => {
      group.removeEventListener("pointermove", moved);
      group.removeEventListener("pointerup", done);
      group.removeEventListener("pointercancel", done);
      this.dragged = -1;
      this.act.move(k, ...this.points[k], true, performance.now());
    };
    group.addEventListener("pointermove", moved);
    group.addEventListener("pointerup", done);
    group.addEventListener("pointercancel", done);
  }

  pressed(event, k) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Delete" || event.key === "Backspace") {
      event.preventDefault();
      this.act.remove(k);
      return;
    }
    if (event.key === "Insert" || event.key === "+") {
      event.preventDefault();
      const next = this.points[Math.min(k + 1, this.points.length - 1)], here = this.points[k];
      const before = this.points[Math.max(0, k - 1)];
      this.act.add(...(next === here ? [(before[0] + here[0]) / 2, (before[1] + here[1]) / 2] : [(next[0] + here[0]) / 2, (next[1] + here[1]) / 2]));
      return;
    }
    const large = event.shiftKey ? 10 : 1;
    const torque = step(this.limits.y, factorOf("N*m")) * large, angle = step(this.limits.x, factorOf("rad")) * large;
    const ways = { ArrowUp: [0, torque], ArrowDown: [0, -torque], ArrowRight: [angle, 0], ArrowLeft: [-angle, 0], PageUp: [0, 10 * torque], PageDown: [0, -10 * torque] };
    const way = ways[event.key];
    if (!way) return;
    event.preventDefault();
    this.dragged = k;
    const begin = performance.now();
    this.move(k, this.points[k][0] + way[0], this.points[k][1] + way[1]);
    this.act.move(k, ...this.points[k], false, begin);
    this.spoken = k;
  }

  rest(k) {
    if (this.dragged !== k) return;
    this.dragged = -1;
    this.act.move(k, ...this.points[k], true, performance.now());
  }

  say(rms, words) {
    if (this.spoken === undefined) return;
    const [angle, torque] = this.points[this.spoken] ?? [null, null];
    if (angle !== null) announce(`${withUnit(torque, "N*m", 4)} at ${withUnit(angle, "rad", 4)}; ${rms}. ${words}`);
  }

  get moving() {
    return this.dragged >= 0;
  }
}

// A step that reads well, about a two-hundredth of what is shown.
function step([low, high], factor) {
  const size = (high - low) * factor / 200, power = 10 ** Math.floor(Math.log10(size));
  return ([1, 2, 5].map((k) => k * power).find((k) => k >= size * 0.99) ?? 10 * power) / factor;
}

export function torqueRange(rows) {
  return range(rows, { zero: true });
}
