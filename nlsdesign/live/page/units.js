// Numbers of the server are in SI; people read degrees, millimetres and megapascals.

const SHOWN = {
  "rad": ["°", 180 / Math.PI],
  "m": ["mm", 1e3],
  "m^2": ["mm²", 1e6],
  "m^3": ["cm³", 1e6],
  "Pa": ["MPa", 1e-6],
  "N*m": ["N·m", 1],
  "N*m/rad": ["N·m/rad", 1],
  "Pa*s": ["Pa·s", 1],
  "kg*m^2": ["kg·m²", 1],
  "%": ["%", 100],
};

export function unitOf(si) {
  return (SHOWN[si] ?? [si === "1" ? "" : si, 1])[0];
}

export function factorOf(si) {
  return (SHOWN[si] ?? ["", 1])[1];
}

// Four significant digits, as a scale needs, without an exponent where a person would write none.
export function plain(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(Math.max(0, digits - 2)).split("e");
    return `${minus(String(Number(mantissa)))}·10${superscript(Number(exponent))}`;
  }
  return minus(String(Number(value.toPrecision(digits))));
}

// Torques of a small error are read in smaller units.
export function scaled(si, largest) {
  if (si !== "N*m" || !(largest < 0.05) || largest === 0) return [unitOf(si), factorOf(si)];
  return largest < 5e-4 ? ["µN·m", 1e6] : ["mN·m", 1e3];
}

// Three digits, in a unit that suits the size; more where a step of a hand must be seen.
export function withUnit(value, si, digits = 3) {
  if (si === "N*m" && value !== null && Math.abs(value) < 0.05 && value !== 0) {
    const [unit, factor] = scaled(si, Math.abs(value));
    return `${plain(value * factor, digits)} ${unit}`;
  }
  const unit = unitOf(si);
  const number = plain(value === null ? null : value * factorOf(si), digits);
  return unit === "" ? number : unit === "°" ? `${number}°` : `${number} ${unit}`;
}

// As a field takes it back; what nobody typed needs no more than three digits.
export function editable(value, digits = 5) {
  if (value === null || !Number.isFinite(value)) return "";
  const short = Number(value.toPrecision(digits));
  return Math.abs(short) >= 1e7 || (short !== 0 && Math.abs(short) < 1e-4) ? short.toExponential() : String(short);
}

// "1,5" is how many people type one and a half.
export function typed(text) {
  const clean = text.trim().replace("−", "-").replace(",", ".");
  const number = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(clean) ? Number(clean) : NaN;
  return Number.isFinite(number) ? number : NaN;
}

function minus(text) {
  return text.replace("-", "−");
}

// A tick of a logarithmic axis.
export function powerOf(value) {
  return value === 0 ? "0" : `${value < 0 ? "−" : ""}10${superscript(Math.round(Math.log10(Math.abs(value))))}`;
}

function superscript(exponent) {
  const digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  return (exponent < 0 ? "⁻" : "") + [...String(Math.abs(exponent))].map((d) => digits[Number(d)]).join("");
}
