// Charts: each a drawing with its numbers as a table below it.

const CHART = { width: 340, height: 200, left: 58, right: 10, top: 12, bottom: 36 };
// Lines of more points than this are drawn without dots.
const MAX_DOTS = 300;
// Series told apart by colour have these classes, in order.
const SERIES = ["", "second", "third"];

// A scale from values to pixels, linear or logarithmic, with its round ticks.
function axis(low, high, from, to, is_log) {
  const [a, b] = is_log ? [Math.log10(low), Math.log10(high)] : [low, high];
  const span = b - a || 1;
  const at = (value) => from + (((is_log ? Math.log10(value) : value) - a) / span) * (to - from);
  return { at, ticks: is_log ? logTicks(low, high) : linearTicks(low, high) };
}

function linearTicks(low, high) {
  const rough = (high - low) / 5;
  // Below the last digits of a number there is nothing to divide.
  if (!(rough > 1e-12 * Math.max(Math.abs(low), Math.abs(high)))) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((s) => s * power >= rough * 0.999);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}

function logTicks(low, high) {
  const ticks = [];
  const steps = Math.log10(high / low) > 2.2 ? [1] : Math.log10(high / low) > 1 ? [1, 3] : [1, 2, 5];
  for (let p = Math.floor(Math.log10(low)); p <= Math.ceil(Math.log10(high)); p++) {
    for (const s of steps) if (s * 10 ** p >= low * 0.999 && s * 10 ** p <= high * 1.001) ticks.push(Number((s * 10 ** p).toPrecision(6)));
  }
  return ticks;
}

function frame(svg, x, y, names, size = CHART) {
  const { width, height, left, right, top, bottom } = size;
  for (const tick of x.ticks) svg.append(drawn("text", { x: x.at(tick), y: height - bottom + 14, "text-anchor": "middle" }, digits(tick)));
  for (const tick of y.ticks) {
    svg.append(drawn("path", { class: "axis", d: `M${left} ${y.at(tick)}H${width - right}` }),
      drawn("text", { x: left - 5, y: y.at(tick) + 3.5, "text-anchor": "end" }, digits(tick)));
  }
  svg.append(drawn("path", { class: "axis", d: `M${left} ${top}V${height - bottom}H${width - right}` }),
    drawn("text", { class: "name", x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, names[0]),
    drawn("text", { class: "name", x: 0, y: 0, "text-anchor": "middle", transform: `translate(11 ${(top + height - bottom) / 2}) rotate(-90)` }, names[1]));
}

// What the colours of several series mean, above their drawing.
function key(series) {
  return make("p", { class: "key-line" }, ...series.flatMap(({ name, kind }) => [make("i", { class: `stroke ${kind}` }), ` ${name} `]));
}

function figure(title, svg, head, rows, words, above = null) {
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `${title}; the numbers are in the table below`);
  const numbers = make("details", {}, make("summary", {}, "Numbers"));
  // Tables are made when they are looked at: a page may have thousands of rows of them.
  numbers.addEventListener("toggle", () => {
    if (numbers.open && !numbers.querySelector("table")) numbers.append(make("div", { class: "scroll" }, table(head, rows())));
  });
  return make("figure", { class: "chart" }, make("figcaption", {}, title), above, svg, words ? make("p", {}, words) : null, numbers);
}

function blank() {
  return drawn("svg", { viewBox: `0 0 ${CHART.width} ${CHART.height}` });
}

function bars(title, histogram, names, words) {
  const { width, height, left, right, top, bottom } = CHART;
  const { edges, counts } = histogram;
  const x = axis(edges[0], edges[edges.length - 1], left, width - right, false);
  const y = axis(0, Math.max(...counts, 1), height - bottom, top, false);
  const svg = blank();
  y.ticks = y.ticks.filter(Number.isInteger);
  frame(svg, x, y, names);
  const is_counted = edges[0] === -0.5;
  const span = (k) => {
    const [low, high] = is_counted ? [edges[k] + 0.5, edges[k + 1] - 0.5] : [edges[k], edges[k + 1]];
    return low === high ? digits(low) : `${digits(low)} to ${digits(high)}`;
  };
  counts.forEach((count, k) => {
    if (count === 0) return;
    const [x0, x1] = [x.at(edges[k]), x.at(edges[k + 1])];
    svg.append(drawn("rect", { class: "bars", x: x0 + 0.4, y: y.at(count), width: Math.max(0.6, x1 - x0 - 0.8), height: y.at(0) - y.at(count) },
      drawn("title", {}, `${span(k)}: ${digits(count)}`)));
  });
  return figure(title, svg, names, () => counts.map((count, k) => [span(k), digits(count)]), words);
}

// Series of { name, points: [[x, y], ...], kind }; `logs` says which axes are logarithmic, `from_zero`
// whether zero is on the other axis in any case, `dotted` whether each point is marked.
function lines(title, series, names, { logs = [false, false], range = null, words = null, from_zero = false, dotted = false } = {}) {
  const { width, height, left, right, top, bottom } = CHART;
  const all = series.flatMap((s) => s.points);
  if (all.length === 0) return null;
  const reach = (values, is_log) => {
    const low = values.reduce((a, b) => Math.min(a, b), Infinity);
    const high = values.reduce((a, b) => Math.max(a, b), -Infinity);
    if (is_log) return [low, Math.max(high, low * 1.01)];
    const near = 1e-9 * Math.max(Math.abs(low), Math.abs(high));
    return high - low > near ? [low, high] : [low - 0.5, high + 0.5];
  };
  const reached = () => {
    const values = all.map((p) => p[1]);
    return reach(from_zero && !logs[1] ? [0, ...values] : values, logs[1]);
  };
  const x = axis(...reach(all.map((p) => p[0]), logs[0]), left, width - right, logs[0]);
  const y = axis(...(range ?? reached()), height - bottom, top, logs[1]);
  const svg = blank();
  frame(svg, x, y, names);
  for (const { name, points, kind } of series) {
    const shown = points.filter((p) => !range || (p[1] >= range[0] && p[1] <= range[1]));
    if (shown.length === 0) continue;
    const d = shown.map((p, k) => `${k ? "L" : "M"}${x.at(p[0]).toFixed(1)} ${y.at(p[1]).toFixed(1)}`).join("");
    svg.append(drawn("path", { class: `line ${kind ?? ""} ${dotted && shown.length <= MAX_DOTS ? "thin" : ""}`, d: shown.length === 1 ? `${d}h1` : d }, drawn("title", {}, name)));
    if (dotted && shown.length <= MAX_DOTS) {
      for (const p of shown) svg.append(drawn("circle", { class: `dot ${kind ?? ""}`, cx: x.at(p[0]).toFixed(1), cy: y.at(p[1]).toFixed(1), r: 2 }, drawn("title", {}, `${name}: ${digits(p[1])} at ${digits(p[0])}`)));
    }
    const last = shown[shown.length - 1];
    if (kind === "faint") svg.append(drawn("text", { x: x.at(last[0]) - 2, y: y.at(last[1]) - 3, "text-anchor": "end" }, name));
  }
  const told = series.filter((s) => s.kind !== "faint");
  const zero = y.at(0);
  if (!logs[1] && y.ticks[0] < 0 && zero > top) svg.insertBefore(drawn("path", { class: "axis zero", d: `M${left} ${zero}H${width - right}` }), svg.firstChild);
  const rows = () => told.flatMap((s) => s.points.map((p) => [s.name, digits(p[0], 5), digits(p[1], 5)]));
  return figure(title, svg, ["", ...names], rows, words, told.length > 1 && told.every((s) => s.kind !== undefined) ? key(told) : null);
}

function sizeCharts(sizes, laws) {
  const points = (values) => sizes.diameter_m.map((d, k) => [d, values[k]]);
  const number = lines("Rocks of this diameter or more", [{ name: "measured", points: points(sizes.per_m2) }], ["diameter, m", "rocks per m\u00b2"],
    { logs: [true, true], words: `${digits(sizes.n_rocks)} rocks with a diameter on ${digits(sizes.seen_m2)} m\u00b2 seen.` });
  const low = Math.max(1e-6, Math.min(...sizes.area_share) / 3);
  const high = Math.min(1, Math.max(...sizes.area_share) * 6);
  const curve = (law) => {
    const [first, last] = [sizes.diameter_m[0], sizes.diameter_m[sizes.diameter_m.length - 1]];
    return Array.from({ length: 41 }, (_, k) => {
      const d = first * (last / first) ** (k / 40);
      return [d, law.k * Math.exp(-law.q * d)];
    });
  };
  const series = laws.map((law) => ({ name: `k = ${law.k}`, points: curve(law), kind: "faint" }));
  if (sizes.law) series.push({ name: `law of Golombek and Rapp, k = ${digits(sizes.law.k)}`, points: curve(sizes.law), kind: "second" });
  series.push({ name: "measured", points: points(sizes.area_share), kind: "" });
  const words = sizes.law
    ? `Dashed blue: the law of Golombek and Rapp (1997) that fits the larger half best, k = ${digits(sizes.law.k)}, q = ${digits(sizes.law.q)} per m. Dotted: the law for other abundances.`
    : "Dotted: the law of Golombek and Rapp (1997). Too few rocks to fit it.";
  const share = lines("Ground covered by rocks of this diameter or more", series, ["diameter, m", "share of the ground"], { logs: [true, true], range: [low, high], words });
  return [number, share];
}

// A histogram of numbers not below zero.
function spread(values) {
  const known = values.filter((x) => !Number.isNaN(x));
  const most = Math.max(...known, 1e-9);
  const ticks = linearTicks(0, most);
  const width = (ticks[1] ?? most) / 4;
  const counts = new Array(Math.floor(most / width) + 1).fill(0);
  for (const x of known) counts[Math.floor(x / width)] += 1;
  return { edges: counts.map((_, k) => k * width).concat(counts.length * width), counts };
}
