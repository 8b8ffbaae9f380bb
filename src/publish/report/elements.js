// Elements of the page, and how numbers are written.

// Element, attributes, children; text never becomes markup.
function make(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

function drawn(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

function filled(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

function byId(id) {
  return document.getElementById(id);
}

// The button that switches between light and dark; `repaint` does what no style sheet does then.
function themeButton(repaint = () => {}) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", repaint);
  byId("theme").addEventListener("click", () => {
    const root = document.documentElement;
    const now = root.dataset.theme ?? (dark.matches ? "dark" : "light");
    root.dataset.theme = now === "dark" ? "light" : "dark";
    repaint();
  });
}

// A number with so many significant digits, or a dash where there is none.
function digits(x, n = 3) {
  if (x === null || x === undefined || Number.isNaN(x)) return "\u2013";
  if (Number.isInteger(x) && Math.abs(x) < 1e9) return x.toLocaleString("en").replace("-", "\u2212");
  if (Math.abs(x) >= 1000 && Math.abs(x) < 1e6) return x.toLocaleString("en", { maximumSignificantDigits: n }).replace("-", "\u2212");
  const text = Math.abs(x) >= 1e-4 && Math.abs(x) < 1e6 ? String(Number(x.toPrecision(n))) : x.toExponential(n - 1);
  return text.replace("-", "\u2212");
}

// A number with so many decimals, or a dash.
function fixed(x, n) {
  return Number.isNaN(x) ? "\u2013" : x.toFixed(n).replace("-", "\u2212");
}

function metres(x) {
  if (Number.isNaN(x)) return "\u2013";
  return Math.abs(x) < 1 ? `${digits(100 * x)} cm` : `${digits(x, 4)} m`;
}

function table(head, rows, textColumns = 1) {
  const side = (i) => (i < textColumns ? { class: "text" } : {});
  return make("table", {},
    make("thead", {}, make("tr", {}, ...head.map((cell, i) => make("th", { scope: "col", ...side(i) }, cell)))),
    make("tbody", {}, ...rows.map((row) => make("tr", {}, ...row.map((cell, i) => make("td", side(i), cell ?? "\u2013"))))));
}
