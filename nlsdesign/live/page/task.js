// What the joint has to do, and what the motor pays for it with this spring and with others.

import { upload } from "./connection.js";
import { announce, make, text } from "./elements.js";
import { editable, plain, typed } from "./units.js";

const FIELDS = [
  { name: "body_mass", words: "body mass", unit: "kg", factor: 1 },
  { name: "scale", words: "assistance", unit: "%", factor: 100 },
  { name: "share", words: "share of the time", unit: "%", factor: 100 },
];
const MOTOR = [["resistance", "winding resistance", "Ω"], ["gear_ratio", "gear ratio to try", ""]];
const MOST = 4;

export class TaskCard {
  constructor(host, edit) {
    this.edit = edit;
    this.joints = [];
    this.rows = [];
    this.list = make("div", { class: "tasks" });
    this.follow = make("button", { type: "button", onclick: () => edit({ edit: "FollowTasks" }) }, "Take the curve of least heat as target");
    this.motor = MOTOR.map(([name, words, unit]) => {
      const field = make("input", { type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": `Motor: ${words}${unit && ` in ${unit}`}` });
      field.addEventListener("change", () => this.entered(field, (value) => edit({ edit: "SetMotor", name, value }), true));
      return { name, field, label: make("label", {}, `${words}${unit && ` in ${unit}`} `, field) };
    });
    this.wrong = make("p", { class: "wrong", role: "alert" });
    this.table = make("table", { class: "paid" });
    this.words = make("p", { class: "job" });
    this.given = make("div", { class: "given" }, ...this.motor.map((each) => each.label), this.follow);
    this.take = make("button", { type: "button", onclick: () => edit({ edit: "TakeGearRatio" }) }, "Put this gear ratio into the deck");
    this.given.append(this.take);
    this.own = make("input", { type: "file", accept: ".csv", class: "unseen", "aria-label": "Choose a record of your own as a task" });
    this.own.addEventListener("change", () => this.load());
    this.record = make("label", { class: "button" }, "Own record (CSV)", this.own);
    this.purpose = make("p", { class: "job" }, "Choose a joint in walking, or a record of one period with the columns time, angle and torque. The page says what heat and peak power the motor pays, with this spring and with others.");
    host.append(make("div", { class: "head" }, make("h3", {}, "Task of the joint"), this.record), make("div", { class: "halves row" },
      make("div", {}, this.purpose, this.list, this.given, this.wrong), make("div", {}, make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Motor over the task" }, this.table), this.words)));
    this.answer = null;
  }

  // tasks: [[joint, body mass, assistance, share]]; what a hand types at the moment stays.
  show({ tasks, motor }) {
    this.tasks = tasks;
    const wanted = Math.min(MOST, tasks.length + 1);
    while (this.rows.length > wanted) this.rows.pop().row.remove();
    while (this.rows.length < wanted) this.rows.push(this.row(this.rows.length));
    this.rows.forEach(({ select, fields, drop, labels }, k) => {
      const task = tasks[k];
      // A record of one's own is offered where it stands.
      const own = task && task[4] !== "walking" ? task[0] : "";
      if (own !== select.dataset.own) { select.dataset.own = own; select.replaceChildren(...this.offered(own)); }
      if (document.activeElement !== select) select.value = task ? task[0] : "";
      select.setAttribute("aria-label", task ? `Task ${k + 1}: joint` : "Add a task: joint");
      drop.hidden = !task;
      labels.forEach((each, n) => { each.hidden = !task || (n === 0 && task[4] === "own") || (n === 2 && tasks.length < 2); });
      if (task) FIELDS.forEach(({ factor }, n) => this.put(fields[n], editable(task[n + 1] * factor)));
    });
    for (const { name, field } of this.motor) {
      this.put(field, motor[name] === undefined ? "" : editable(motor[name]));
      field.placeholder = "of the deck";
    }
    this.take.hidden = motor.gear_ratio === undefined;
    this.record.hidden = tasks.length >= MOST;
    this.purpose.hidden = tasks.length > 0;
    this.given.hidden = this.words.hidden = tasks.length === 0;
    if (tasks.length === 0) { this.answer = null; text(this.words, ""); }
    this.table.parentElement.hidden = this.answer === null || this.answer.rows.length === 0;
  }

  async load() {
    const [file] = this.own.files;
    this.own.value = "";
    if (!file) return;
    const wrong = await upload(`/api/open?kind=task&name=${encodeURIComponent(file.name)}`, file);
    text(this.wrong, wrong);
    if (!wrong) announce(`${file.name} is a task now.`);
  }

  offered(own = "") {
    return ["", ...this.joints, ...(own ? [own] : [])].map((value) => make("option", { value }, value || "no task"));
  }

  // The joints of which there are tables; they come after the first answer.
  offer(joints) {
    this.joints = joints;
    this.rows.forEach(({ select }, k) => { select.replaceChildren(...this.offered(select.dataset.own)); select.value = this.tasks[k]?.[0] ?? ""; });
  }

  put(field, words) {
    if (document.activeElement === field && !field.dataset.done) return;
    field.value = words;
    delete field.dataset.done;
    field.removeAttribute("aria-invalid");
  }

  row(k) {
    const select = make("select", {}, ...this.offered());
    const fields = FIELDS.map(({ words, unit }) => make("input", { type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": `Task ${k + 1}: ${words} in ${unit}` }));
    const labels = FIELDS.map(({ words, unit }, n) => make("label", {}, `${words} `, fields[n], ` ${unit}`));
    const drop = make("button", { type: "button", "aria-label": `Drop task ${k + 1}`, onclick: () => this.edit({ edit: "DropTask", index: k }) }, "×");
    const sent = (changed) => {
      const [joint, ...numbers] = this.tasks[k].slice(0, 4);
      const now = Object.fromEntries(FIELDS.map(({ name }, n) => [name, numbers[n]]));
      this.edit({ edit: "SetTask", index: k, joint, ...now, ...changed });
    };
    select.addEventListener("change", () => {
      if (this.tasks[k]) return select.value ? sent({ joint: select.value }) : this.edit({ edit: "DropTask", index: k });
      const mass = this.tasks.find((each) => each[4] !== "own")?.[1] ?? 75;
      if (select.value) this.edit({ edit: "SetTask", index: k, joint: select.value, body_mass: mass });
    });
    FIELDS.forEach(({ name, factor }, n) => fields[n].addEventListener("change", () => this.entered(fields[n], (value) => sent({ [name]: value / factor }))));
    const row = make("div", { class: "task" }, select, ...labels, drop);
    this.list.append(row);
    return { row, select, fields, labels, drop };
  }

  // What is left empty is that of the deck, where there may be one.
  entered(field, done, empty = false) {
    const blank = empty && field.value.trim() === "", value = typed(field.value);
    const wrong = !blank && Number.isNaN(value);
    field.setAttribute("aria-invalid", String(wrong));
    text(this.wrong, wrong ? `${field.getAttribute("aria-label")}: this is no number. Write it like 12.5, without a unit.` : "");
    if (wrong) return;
    field.dataset.done = "1";
    done(blank ? null : value);
  }

  // What the motor pays comes when the hand rests.
  showMotor(answer) {
    if (!this.tasks?.length) return;
    this.answer = answer;
    const shown = (value) => (value === null ? "–" : plain(value, 3));
    const head = make("tr", {}, ...["spring", "heat, W", "current, A rms", "peak power, W"].map((each, k) => make("th", { scope: "col", class: k ? "numeric" : "" }, each)));
    const rows = answer.rows.map(({ spring, heat, current, power, reason }) => make("tr", { class: spring === "this design" ? "chosen" : "" }, make("th", { scope: "row" }, spring),
      ...(reason ? [make("td", { colspan: 3 }, reason)] : [heat, current, power].map((value) => make("td", { class: "numeric" }, shown(value))))));
    this.table.replaceChildren(make("thead", {}, head), make("tbody", {}, ...rows));
    this.table.parentElement.hidden = rows.length === 0;
    text(this.words, answer.words);
    for (const { name, field } of this.motor) if (name === "gear_ratio" && answer.gear_ratio) field.placeholder = plain(answer.gear_ratio);
  }

  // The curve of least heat, to stand behind the target.
  get curve() {
    const { answer } = this;
    return answer?.rows.length ? [{ name: "least heat for the task", x: answer.angles, y: answer.torques, tone: "green", dash: "dotted" }] : [];
  }
}
