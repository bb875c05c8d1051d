// Cam, cable and rubber in the plane, to scale; the server says where they are at the angle.

import { draw, make, set, text } from "./elements.js";
import { plain, withUnit } from "./units.js";
import { ticks } from "./chart.js";

const KEY = [["body", "cam"], ["cable", "cable"], ["arm", "lever arm"], ["rubber", "rubber"]];

export class MechanismPicture {
  constructor(host) {
    this.whole = draw("svg", { class: "mechanism", role: "img", preserveAspectRatio: "xMidYMid meet" });
    this.world = draw("g", { id: "mechanism-world", transform: "scale(1,-1)" });
    this.wholeBar = draw("g", {});
    this.sizes = draw("g", { class: "sizes" });
    this.whole.append(this.world, this.wholeBar, this.sizes);
    // The cam alone, larger: the same elements once more.
    this.near = draw("svg", { class: "mechanism near", "aria-hidden": "true", preserveAspectRatio: "xMidYMid meet" });
    this.nearBar = draw("g", {});
    this.near.append(draw("use", { href: "#mechanism-world" }), this.nearBar);
    this.now = make("p", { class: "now" });
    this.remark = make("p", { class: "hint" });
    const samples = KEY.map(([name, words]) => make("li", {}, draw("svg", { viewBox: "0 0 24 12", width: 24, height: 12, "aria-hidden": "true" },
      name === "body" || name === "rubber" ? draw("rect", { x: 1, y: 1, width: 22, height: 10, class: name }) : draw("path", { d: "M0 6H24", class: name })), words));
    host.append(make("div", { class: "head" }, make("h3", {}, "Mechanism"), this.now), this.near, this.whole, make("ul", { class: "key" }, ...samples), this.remark);
    this.parts = new Map();
  }

  show(mechanism) {
    const mm = (points) => points.map(([x, y]) => [x * 1e3, y * 1e3]);
    const used = new Set();
    const put = (name, kind, attributes) => {
      used.add(name);
      if (!this.parts.has(name)) this.parts.set(name, this.world.appendChild(draw(kind, {})));
      set(this.parts.get(name), attributes);
    };
    const [wide, high] = mechanism.extent.map((v) => v * 1e3);
    const radius = Math.max(...mechanism.halves.flat().map(([x, y]) => Math.hypot(x, y))) * 1e3;
    const size = 0.06 * radius;
    let arm = 0;
    mechanism.halves.forEach((points, k) => put(`half${k}`, "path", { class: "body", d: `${path(mm(points))}Z` }));
    mechanism.rubbers.forEach((points, k) => put(`rubber${k}`, "path", { class: "rubber", d: `${path(mm(points))}Z` }));
    mechanism.cables.forEach((points, k) => put(`cable${k}`, "path", { class: "cable", d: path(mm(points)) }));
    mechanism.contacts.forEach((point, k) => {
      const contact = mm([point])[0], guide = mm([mechanism.guides[k]])[0];
      const long = Math.hypot(guide[0] - contact[0], guide[1] - contact[1]) || 1;
      const along = [(guide[0] - contact[0]) / long, (guide[1] - contact[1]) / long];
      const reach = contact[0] * along[0] + contact[1] * along[1];
      const foot = [contact[0] - along[0] * reach, contact[1] - along[1] * reach];
      arm = Math.hypot(...foot);
      put(`arm${k}`, "path", { class: "arm", d: path([[0, 0], foot]) });
      put(`guide${k}`, "circle", { class: "guide", cx: guide[0], cy: guide[1], r: size });
      put(`contact${k}`, "circle", { class: "contact", cx: contact[0], cy: contact[1], r: size });
    });
    // The part as it is cut, once it is checked: its edge under the cable, and its holes.
    mechanism.edges.forEach((points, k) => put(`edge${k}`, "path", { class: "edge", d: `${path(mm(points))}Z` }));
    mechanism.holes.forEach(([x, y, r], k) => put(`hole${k}`, "circle", { class: "hole", cx: x * 1e3, cy: y * 1e3, r: r * 1e3 }));
    put("reach", "circle", { class: "reach-circle", cx: 0, cy: 0, r: radius });
    put("centre", "circle", { class: "centre", cx: 0, cy: 0, r: size });
    for (const [name, part] of this.parts) if (!used.has(name)) { part.remove(); this.parts.delete(name); }
    this.frame(wide, high, mechanism.halves.length > 1, Number(radius.toPrecision(2)));
    this.showSizes(mechanism.dimensions, wide);
    text(this.now, `${withUnit(mechanism.angle, "rad", 3)} · radius of the cam ${plain(radius, 3)} mm`);
    text(this.remark, mechanism.remark);
    set(this.whole, { "aria-label": `Cam, cable and rubber to scale at ${withUnit(mechanism.angle, "rad", 3)}: cam radius ${plain(radius, 3)} mm, lever arm ${plain(arm, 3)} mm` });
  }

  // Dimension lines with their size in mm; their text stands upright, so it is drawn outside the turned world.
  showSizes(rows, wide) {
    const tall = 0.03 * wide, size = 0.068 * wide;
    this.sizes.replaceChildren(...rows.flatMap(([words, ...ends]) => {
      const [x0, y0, x1, y1, long] = ends.map((each) => each * 1e3);
      // Beside a line below the cam, below one at the rubber.
      const [at, anchor] = x0 < 0 ? [x0 - tall, "end"] : x0 === 0 ? [x1 + tall, "start"] : [(x0 + x1) / 2, "middle"];
      return [
        draw("path", { class: "dimension", d: `M${x0} ${-y0 - tall / 2}v${tall}M${x0} ${-y0}H${x1}M${x1} ${-y1 - tall / 2}v${tall}` }),
        draw("text", { x: at, y: -y0 + (anchor === "middle" ? 1.3 : 0.35) * size, "text-anchor": anchor, "font-size": size }, `${words} ${plain(long, 3)} mm`),
      ];
    }));
  }

  // Why there is no picture for this design; the one that is seen belongs to an earlier one.
  explain(reason) {
    if (reason) text(this.remark, `No picture of this design: ${reason}`);
    for (const each of [this.near, this.whole]) each.classList.toggle("old", reason !== "");
  }

  // A scale in each picture, of a round length.
  frame(wide, high, both, radius) {
    const code = `${wide} ${high} ${both} ${radius}`;
    if (code === this.framed) return;
    this.framed = code;
    const left = both ? -wide : -1.2 * high;
    const frame = [left, -1.05 * high, wide - left, 2.1 * high + 0.07 * (wide - left)];
    scaleBar(this.whole, this.wholeBar, frame, 6);
    this.whole.style.aspectRatio = `${frame[2]} / ${frame[3]}`;
    scaleBar(this.near, this.nearBar, [-1.9 * radius, -1.15 * radius, 3.8 * radius, 2.5 * radius], 4);
  }
}

function scaleBar(svg, bar, [x0, y0, width, height], count) {
  set(svg, { viewBox: [x0, y0, width, height].map((v) => v.toFixed(2)).join(" ") });
  const length = ticks(0, width, count)[1] ?? width;
  const tall = 0.014 * width, x = x0 + 0.03 * width, y = y0 + height - 2.2 * tall;
  bar.replaceChildren(
    draw("path", { class: "scale", d: `M${x} ${y - tall}V${y + tall}M${x} ${y}H${x + length}M${x + length} ${y - tall}V${y + tall}` }),
    draw("text", { x: x + length + 0.02 * width, y: y + tall, "font-size": 0.036 * width }, `${length} mm`),
  );
}

function path(points) {
  return `M${points.map(([x, y]) => `${x.toFixed(3)} ${y.toFixed(3)}`).join("L")}`;
}
