// Fields and sliders: points of the target, limits, sizes, rubber. Each is made once and then only updated,
// so that the focus stays where a hand is.

import { make, nameText, text } from "./elements.js";
import { editable, factorOf, typed, unitOf, withUnit } from "./units.js";

const SPAN = 4;

// One row with number field, unit and slider. change(value in SI, last) is called for each step.
class NumberRow {
  constructor(host, id, { change, free = null, drop = null }) {
    this.change = change;
    this.field = make("input", { type: "text", inputmode: "decimal", id: `${id}-field`, autocomplete: "off", "aria-describedby": `${id}-wrong` });
    this.unit = make("span", { class: "unit" });
    this.name = make("label", { for: `${id}-field` });
    this.slider = make("input", { type: "range", min: -1, max: 1, step: 0.005 });
    this.wrong = make("p", { class: "wrong", id: `${id}-wrong`, role: "alert" });
    this.margin = make("p", { class: "margin" });
    this.box = null;
    this.row = make("div", { class: "control" }, this.name, make("span", { class: "field" }, this.field, this.unit), this.slider);
    if (free) {
      this.box = make("input", { type: "checkbox", id: `${id}-free` });
      this.box.addEventListener("change", () => free(this.box.checked));
      this.row.append(make("label", { class: "free", for: `${id}-free` }, this.box, "free: the design chooses it"));
    }
    this.row.append(this.margin, this.wrong);
    if (drop) {
      this.drop = make("button", { type: "button", class: "drop", onclick: drop }, "drop");
      this.row.append(this.drop);
    }
    host.append(this.row);
    this.field.addEventListener("change", () => this.entered());
    this.field.addEventListener("keydown", (event) => this.key(event));
    this.slider.addEventListener("input", () => this.slid(false));
    this.slider.addEventListener("change", () => this.slid(true));
  }

  // given: { label, value, unit, digits, free, active, margin, path, droppable }
  show(given) {
    this.given = given;
    nameText(this.name, given.label);
    this.name.title = given.path ?? "";
    text(this.unit, unitOf(given.unit));
    const locked = given.free === true;
    this.field.disabled = locked;
    this.slider.disabled = locked;
    // A name that is broken after its dots is not read as one word.
    this.field.setAttribute("aria-label", `${given.label} in ${unitOf(given.unit) || "1"}`);
    this.slider.setAttribute("aria-label", `${given.label}, slider`);
    if (this.box) {
      this.box.checked = locked;
      this.box.setAttribute("aria-label", `free: the design chooses it: ${given.label}`);
    }
    if (this.drop) {
      this.drop.hidden = given.droppable !== true;
      this.drop.setAttribute("aria-label", `Drop the limit: ${given.label}`);
    }
    this.row.classList.toggle("active", given.active === true);
    text(this.margin, given.margin ?? "");
    if (document.activeElement !== this.field || this.settled) {
      this.field.value = given.value === null ? "" : editable(given.value * factorOf(given.unit), given.digits);
      this.settled = false;
      this.field.removeAttribute("aria-invalid");
      text(this.wrong, "");
    }
    if (document.activeElement !== this.slider || !this.sliding) this.rest();
    this.slider.setAttribute("aria-valuetext", given.value === null ? "no number" : withUnit(given.value, given.unit, 4));
  }

  rest() {
    const { value } = this.given;
    if (value === null) return;
    const inside = this.base !== undefined && this.position(value) > -0.98 && this.position(value) < 0.98;
    if (!inside) { this.base = value > 0 ? value : 0; }
    this.slider.value = this.position(value);
  }

  position(value) {
    if (!(this.base > 0)) return value * factorOf(this.given.unit) / 10 - 1;
    return value > 0 ? Math.log(value / this.base) / Math.log(SPAN) : -1;
  }

  valueAt(position) {
    return this.base > 0 ? this.base * SPAN ** position : (position + 1) * 10 / factorOf(this.given.unit);
  }

  slid(last) {
    this.sliding = !last;
    text(this.wrong, "");
    const value = Number(this.valueAt(Number(this.slider.value)).toPrecision(4));
    this.field.value = editable(value * factorOf(this.given.unit));
    this.slider.setAttribute("aria-valuetext", withUnit(value, this.given.unit, 4));
    this.change(value, last);
  }

  entered() {
    const value = typed(this.field.value);
    if (Number.isNaN(value)) {
      text(this.wrong, "This is no number: write it like 12.5, without a unit.");
      this.field.setAttribute("aria-invalid", "true");
      return;
    }
    this.field.removeAttribute("aria-invalid");
    text(this.wrong, "");
    this.settled = true;
    this.change(value / factorOf(this.given.unit), true);
  }

  // Up and down change the number by one per cent, with Shift by ten.
  key(event) {
    if (event.key !== "ArrowUp" && event.key !== "ArrowDown") return;
    const value = typed(this.field.value);
    if (Number.isNaN(value)) return;
    event.preventDefault();
    const size = Math.max(Math.abs(value) * (event.shiftKey ? 0.1 : 0.01), 1e-6);
    const next = Number((value + (event.key === "ArrowUp" ? size : -size)).toPrecision(4));
    this.field.value = editable(next);
    this.change(next / factorOf(this.given.unit), false);
  }

  say(words) {
    text(this.wrong, words);
  }
}

// Rows by name; those that are no longer asked for go.
export class Rows {
  constructor(host, prefix, actions) {
    Object.assign(this, { host, prefix, actions, rows: new Map() });
    this.count = 0;
  }

  show(list) {
    const names = list.map((each) => each.name);
    if (names.join("\n") !== [...this.rows.keys()].join("\n")) {
      this.host.querySelectorAll(".control").forEach((row) => row.remove());
      this.rows = new Map();
      for (const { name } of list) {
        this.count += 1;
        const change = (value, last) => this.actions.change(name, value, last);
        const free = this.actions.free ? (yes) => this.actions.free(name, yes) : null;
        const drop = this.actions.drop ? () => this.actions.drop(name) : null;
        this.rows.set(name, new NumberRow(this.host, `${this.prefix}-${this.count}`, { change, free, drop }));
      }
    }
    for (const each of list) this.rows.get(each.name).show(each);
  }

  say(name, words) {
    this.rows.get(name)?.say(words);
  }
}

// The target as numbers, for whoever would rather type.
export class PointTable {
  constructor(host, act) {
    this.act = act;
    this.host = host;
    this.rows = [];
    host.append(make("div", { class: "point names", "aria-hidden": "true" }, make("span"), make("span", {}, "angle in °"), make("span", {}, "torque in N·m"), make("span")));
    this.add = make("button", { type: "button", onclick: () => this.extend() }, "Add a point");
    this.wrong = make("p", { class: "wrong", id: "points-wrong", role: "alert" });
    const field = (what) => make("input", { type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": what, "aria-describedby": "points-wrong" });
    this.lastAngle = field("Scale the whole curve: last angle in degrees");
    this.lastTorque = field("Scale the whole curve: last torque in newton metres");
    this.scale = make("form", { class: "point scale", onsubmit: (event) => { event.preventDefault(); this.scaled(); } },
      make("span", { class: "caption", "aria-hidden": "true" }, "scale the whole curve to"), make("span"), this.lastAngle, this.lastTorque, make("button", { type: "submit", "aria-label": "Scale the whole curve", title: "Scale the whole curve to this last angle and torque" }, "Scale"));
  }

  show(points) {
    while (this.rows.length < points.length) this.rows.push(this.row(this.rows.length));
    while (this.rows.length > points.length) this.rows.pop().row.remove();
    this.host.append(this.wrong, this.add, this.scale);
    const [angle, torque] = points.at(-1);
    this.lastAngle.placeholder = editable(angle * 180 / Math.PI);
    this.lastTorque.placeholder = editable(torque);
    points.forEach(([angle, torque], k) => {
      const { angleField, torqueField, remove } = this.rows[k];
      for (const [field, value] of [[angleField, angle * 180 / Math.PI], [torqueField, torque]]) {
        if (document.activeElement !== field || field.dataset.done) { field.value = editable(value); delete field.dataset.done; field.removeAttribute("aria-invalid"); }
        field.disabled = k === 0;
      }
      remove.disabled = k === 0 || points.length <= 2;
    });
    if (!this.host.querySelector("[aria-invalid=true]")) text(this.wrong, "");
    this.points = points;
  }

  row(k) {
    const field = (what) => {
      const made = make("input", { type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": `Point ${k + 1}: ${what}`, "aria-describedby": "points-wrong" });
      made.addEventListener("change", () => { made.dataset.done = "1"; this.entered(k); });
      return made;
    };
    const angleField = field("angle in degrees"), torqueField = field("torque in newton metres");
    const remove = make("button", { type: "button", "aria-label": `Remove point ${k + 1}`, onclick: () => this.act.remove(k) }, "×");
    const row = make("div", { class: "point" }, make("span", {}, String(k + 1)), angleField, torqueField, remove);
    this.host.append(row);
    return { row, angleField, torqueField, remove };
  }

  entered(k) {
    const { angleField, torqueField } = this.rows[k];
    const angle = typed(angleField.value) * Math.PI / 180, torque = typed(torqueField.value);
    for (const [field, value] of [[angleField, angle], [torqueField, torque]]) field.setAttribute("aria-invalid", String(Number.isNaN(value)));
    const what = [Number.isNaN(angle) ? "angle" : "", Number.isNaN(torque) ? "torque" : ""].filter(Boolean).join(" and ");
    text(this.wrong, what ? `Point ${k + 1}: the ${what} is no number. Write it like 12.5, without a unit.` : "");
    if (!what) this.act.move(k, angle, torque, true, performance.now());
  }

  // A field that is left empty stays as it is.
  scaled() {
    const fields = [this.lastAngle, this.lastTorque], given = fields.map((each) => (each.value.trim() === "" ? typed(each.placeholder) : typed(each.value)));
    fields.forEach((each, k) => each.setAttribute("aria-invalid", String(Number.isNaN(given[k]))));
    text(this.wrong, given.some(Number.isNaN) ? "Scale: this is no number. Write it like 12.5, without a unit." : "");
    if (given.some(Number.isNaN)) return;
    this.act.scale(given[0] * Math.PI / 180, given[1]);
    for (const each of fields) each.value = "";
  }

  extend() {
    const points = this.points ?? [];
    let widest = 1;
    for (let k = 1; k < points.length; k += 1) if (points[k][0] - points[k - 1][0] > points[widest][0] - points[widest - 1][0]) widest = k;
    if (points.length > 1) this.act.add((points[widest][0] + points[widest - 1][0]) / 2, (points[widest][1] + points[widest - 1][1]) / 2);
  }
}
