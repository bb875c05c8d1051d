// Elements are made one by one and texts set as texts, so a name from a deck is never read as HTML.

const SVG = "http://www.w3.org/2000/svg";

export function make(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

export function draw(name, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, name), attributes, children);
}

function filled(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(key, String(value));
  }
  element.append(...children.filter((each) => each !== null && each !== undefined));
  return element;
}

export function set(element, attributes) {
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
}

export function text(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

// A name from a deck, which may go on in the next line after a dot or an underscore.
export function nameText(element, words) {
  if (element.textContent === words) return;
  const pieces = words.split(/(?<=[._])/);
  element.replaceChildren(...pieces.flatMap((piece, k) => (k ? [document.createElement("wbr"), piece] : [piece])));
}

export function byId(name) {
  return document.getElementById(name);
}

// What a screen reader says, once and not before the hand rests.
let pending = 0;
export function announce(words, wait = 350) {
  clearTimeout(pending);
  pending = setTimeout(() => text(byId("said"), words), wait);
}
