// What can be bought: rubbers of the library, values of a size, coils of a list; each is designed, one is taken.

import { upload } from "./connection.js";
import { announce, byId, make, text } from "./elements.js";
import { factorOf, typed, unitOf, withUnit } from "./units.js";
import { ended } from "./work.js";

export class Stock {
  constructor(ask) {
    this.ask = ask;
    const field = (attributes) => make("input", { autocomplete: "off", ...attributes });
    this.rubbers = field({ type: "checkbox", id: "stock-rubbers", checked: true });
    this.size = make("select", { "aria-label": "Size in stock" });
    this.values = field({ type: "text", "aria-label": "Values in stock, parted by spaces" });
    this.unit = make("span", { class: "unit" });
    this.files = field({ type: "file", id: "stock-coils", accept: ".csv", class: "unseen", "aria-label": "Choose a list of coils" });
    this.run = make("button", { type: "button", "aria-label": "Design each of the stock", onclick: () => this.begin() }, "Design each");
    this.stop = make("button", { type: "button", "aria-label": "Stop the stock", hidden: true, onclick: () => ask({ what: "work", name: "TryStock", stop: true }) }, "Stop");
    this.words = make("p", { class: "job" });
    this.table = make("table", { class: "paid" });
    this.scroll = make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Springs from the stock", hidden: true }, this.table);
    this.rubber = make("div", { class: "task" }, make("label", { for: "stock-rubbers" }, this.rubbers, " rubbers of the library with a law"),
      make("label", {}, "and of ", this.size), make("label", {}, "the values ", this.values, " ", this.unit), this.run);
    this.coils = make("div", { class: "task" }, make("label", { class: "button", for: "stock-coils" }, "Choose a list of coils (CSV)", this.files));
    byId("stock").append(make("div", { class: "head" }, make("h3", {}, "What can be bought"), this.stop), this.rubber, this.coils, this.words, this.scroll);
    this.size.addEventListener("change", () => this.showUnit());
    this.files.addEventListener("change", () => this.load());
    this.known = "";
  }

  // What of the spring can be bought, and its sizes.
  offer({ stock, numbers }) {
    this.numbers = numbers;
    this.rubber.hidden = !stock.includes("rubber");
    this.coils.hidden = !stock.includes("coil");
    byId("stock").hidden = stock.length === 0;
    const names = numbers.map((each) => each[0]).join(" ");
    if (names === this.known) return;
    this.known = names;
    this.size.replaceChildren(make("option", { value: "" }, "no size"), ...numbers.map(([name]) => make("option", { value: name }, name)));
    this.showUnit();
  }

  showUnit() {
    const size = this.numbers.find((each) => each[0] === this.size.value);
    this.values.parentElement.hidden = !size;
    text(this.unit, size ? unitOf(size[2]) : "");
  }

  begin() {
    const size = this.numbers.find((each) => each[0] === this.size.value);
    const values = size ? this.values.value.trim().split(/[\s;]+/).filter(Boolean).map(typed) : [];
    const wrong = values.some(Number.isNaN) || (size && values.length === 0);
    this.values.setAttribute("aria-invalid", String(Boolean(wrong)));
    if (wrong) { this.say("The values are no numbers: write them like 1 1.5 2, without a unit."); return; }
    this.ask({ what: "stock", rubbers: this.rubbers.checked, size: this.size.value, values: values.map((each) => each / factorOf(size[2])) });
  }

  async load() {
    const [file] = this.files.files;
    this.files.value = "";
    if (!file) return;
    const wrong = await upload(`/api/open?kind=coils&name=${encodeURIComponent(file.name)}`, file);
    if (wrong) this.say(wrong);
  }

  say(words) {
    if (this.words.textContent !== words) announce(words);
    text(this.words, words);
  }

  show(work) {
    const running = work.state === "computing", rows = work.value?.rows ?? [];
    this.stop.hidden = !running;
    this.run.disabled = running;
    this.scroll.hidden = rows.length === 0;
    byId("stock").setAttribute("aria-busy", String(running));
    byId("stock").classList.toggle("stale", work.old && rows.length > 0);
    if (work.state === "not begun") { text(this.words, "Each is designed for the target, with what is free; the best by its error is not always the one that is at hand."); return; }
    if (running) text(this.words, `${work.message}, for ${Math.round(work.seconds)} s`);
    else this.say(rows.length ? `${work.old ? "Of an earlier question. " : ""}${rows.filter((each) => each[2]).length} of ${rows.length} meet the target.` : ended(work));
    if (!rows.length || this.table.dataset.of === String(work.revision)) return;
    this.table.dataset.of = String(work.revision);
    const head = make("tr", {}, ...["spring", "torque error, rms", ""].map((each, k) => make("th", { scope: "col", class: k === 1 ? "numeric" : "" }, each)));
    this.table.replaceChildren(make("thead", {}, head), make("tbody", {}, ...rows.map(([label, rms, met, reason], k) => make("tr", {},
      make("th", { scope: "row" }, label), make("td", { class: "numeric", title: reason }, rms === null ? "no design" : `${withUnit(rms, "N*m", 3)}${met ? "" : ", misses"}`),
      make("td", {}, rms === null ? null : make("button", { type: "button", "aria-label": `Take ${label}`, onclick: () => this.ask({ what: "stock", take: k }) }, "Take"))))));
  }
}
