(() => {
  const data = JSON.parse(document.getElementById("points-of-the-page").textContent);
  const panel = document.querySelector("aside.chosen");
  const part = (name) => panel.querySelector(name);
  const marks = [...document.querySelectorAll('svg a[href^="#point-"]')];
  const byPoint = new Map();
  for (const mark of marks) {
    const point = mark.getAttribute("href").slice(7);
    mark.setAttribute("aria-label", `point ${point}`);
    mark.setAttribute("tabindex", "-1");
    if (!byPoint.has(point)) byPoint.set(point, []);
    byPoint.get(point).push(mark);
  }
  const element = (name, text, more = "") => {
    const made = document.createElement(name);
    made.textContent = text;
    if (more) made.className = more;
    return made;
  };
  let asked = null;
  const clear = () => { for (const each of document.querySelectorAll("a.is-chosen")) each.classList.remove("is-chosen"); };
  const close = () => {
    clear();
    panel.hidden = true;
    document.body.classList.remove("has-chosen");
    if (location.hash.startsWith("#point-")) history.replaceState(null, "", location.pathname + location.search);
    if (asked && asked.isConnected) asked.focus();
    asked = null;
  };
  const show = (point) => {
    clear();
    for (const mark of byPoint.get(point) || []) mark.classList.add("is-chosen");
    const row = data.rows[point];
    part("h3").textContent = `Point ${point}`;
    const words = !row ? `Its row is not on this page. ${data.elsewhere}`
      : row.status === "failed" ? `Failed: ${row.reason}` : row.note || "";
    part(".said").textContent = words;
    part(".said").hidden = !words;
    const body = part("tbody");
    body.replaceChildren();
    if (row) {
      data.columns.forEach(([name, unit], k) => {
        const value = row.values[k];
        if (value === null) return;
        const line = document.createElement("tr");
        const text = typeof value === "number" ? String(value).replaceAll("-", "−") : value;
        line.append(element("td", name), element("td", unit ? `${text} ${unit}` : text, "number"));
        body.append(line);
      });
    }
    part(".scroll").hidden = !row;
    const deck = part(".deck");
    deck.replaceChildren();
    if (data.decks[point]) {
      const link = element("a", "The deck behind this point");
      link.setAttribute("href", data.decks[point]);
      deck.append(link);
    } else if (data.command) {
      deck.append("Its deck: ", element("code", data.command.replace("POINT", point)));
    }
    panel.hidden = false;
    document.body.classList.add("has-chosen");
    part(".scroll").scrollTop = 0;
  };
  const choose = (point, from) => {
    asked = from;
    history.replaceState(null, "", `#point-${point}`);
    show(point);
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#point-"]');
    if (!link) return;
    event.preventDefault();
    choose(link.getAttribute("href").slice(7), link);
  });
  part("button").addEventListener("click", close);
  document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !panel.hidden) close(); });

  for (const svg of document.querySelectorAll("svg")) {
    const own = [...svg.querySelectorAll('a[href^="#point-"]')];
    if (!own.length) continue;
    // From left to right; what is drawn last, on top, is entered first.
    let ordered = null;
    const order = () => {
      if (!ordered) ordered = own.map((mark) => [mark, mark.getBoundingClientRect()])
        .sort(([, a], [, b]) => a.left - b.left || a.top - b.top).map(([mark]) => mark);
      return ordered;
    };
    own[own.length - 1].setAttribute("tabindex", "0");
    svg.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      const place = order().indexOf(event.target);
      if (place < 0 || (!step && event.key !== "Home" && event.key !== "End")) return;
      event.preventDefault();
      const last = own.length - 1;
      const next = order()[event.key === "Home" ? 0 : event.key === "End" ? last : Math.min(last, Math.max(0, place + step))];
      event.target.setAttribute("tabindex", "-1");
      next.setAttribute("tabindex", "0");
      next.focus();
    });
  }
  for (const hidden of document.querySelectorAll(".choose")) hidden.hidden = false;
  const form = document.querySelector("form.choose");
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const field = form.querySelector("input");
    choose(String(Number(field.value)), field);
  });
  const fromAddress = () => { if (/^#point-\d+$/.test(location.hash)) show(location.hash.slice(7)); };
  window.addEventListener("hashchange", fromAddress);
  fromAddress();
})();
