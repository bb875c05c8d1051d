"use strict";
(() => {
  const root = document.documentElement;
  const button = document.getElementById("theme");
  const preferred = window.matchMedia("(prefers-color-scheme: dark)");
  const remembered = () => { try { return localStorage.getItem("theme"); } catch { return null; } };
  const theme = () => root.dataset.theme || (preferred.matches ? "dark" : "light");
  const label = () => {
    const other = theme() === "dark" ? "light" : "dark";
    button.textContent = other === "dark" ? "Dark" : "Light";
    button.setAttribute("aria-label", `Show the page in ${other} colours`);
  };
  const stored = remembered();
  if (stored === "light" || stored === "dark") root.dataset.theme = stored;
  button.hidden = false;
  button.addEventListener("click", () => {
    root.dataset.theme = theme() === "dark" ? "light" : "dark";
    try { localStorage.setItem("theme", root.dataset.theme); } catch { /* a page without memory still works */ }
    label();
  });
  preferred.addEventListener("change", label);
  label();

  for (const figure of document.querySelectorAll("figure.cam")) {
    const frames = JSON.parse(figure.dataset.frames);
    const part = (name) => figure.querySelector(`[data-part="${name}"]`);
    const marker = document.getElementById(figure.dataset.marker);
    const picture = figure.querySelector("svg.mechanism");
    const slider = figure.querySelector("input");
    const put = (element, values) => {
      for (const [name, value] of Object.entries(values)) element.setAttribute(name, value);
    };
    const show = (frame) => {
      const [x, y, width, height] = frame.rubber;
      put(part("cam"), { transform: `rotate(${frame.angle})` });
      put(part("cable"), { d: frame.cable });
      put(part("contact"), { cx: frame.contact[0], cy: frame.contact[1] });
      put(part("guide"), { cx: frame.guide[0], cy: frame.guide[1] });
      put(part("action"), { d: `M${frame.contact[0]} ${frame.contact[1]}L${frame.foot[0]} ${frame.foot[1]}` });
      put(part("arm"), { d: `M0 0L${frame.foot[0]} ${frame.foot[1]}` });
      put(part("rubber"), { x, y, width, height });
      put(marker, { transform: `translate(${frame.marker[0]} ${frame.marker[1]})` });
      const shown = { angle: `${frame.angle}°`.replace("-", "−"), ...frame.words };
      for (const place of figure.querySelectorAll("[data-reading]")) place.textContent = shown[place.dataset.reading];
      put(slider, { "aria-valuetext": `${frame.angle} degrees, torque ${frame.words.torque}` });
      put(picture, { "aria-label": `The cam at ${frame.angle} degrees, lever arm ${frame.words["lever arm"]}, torque ${frame.words.torque}` });
    };
    figure.querySelector("label.slider").hidden = false;
    slider.addEventListener("input", () => show(frames[Number(slider.value)]));
    show(frames[Number(slider.value)]);
  }

  window.addEventListener("beforeprint", () => {
    for (const folded of document.querySelectorAll("details")) folded.open = true;
  });
})();
