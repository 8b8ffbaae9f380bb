// What became of every object between an earlier map and this one.

const STATUSES = ["same", "moved", "new", "gone", "unseen"];
const STATUS_WORDS = {
  same: "in both maps, no farther apart than expected",
  moved: "in both maps, farther apart than expected",
  new: "in the later map alone",
  gone: "in the earlier map alone",
  unseen: "in one map alone, where no view of the other looked",
};
// The most rows of the table of changes.
const MAX_CHANGES = 500;

// Shows a comparison; `pick` is called with the name of a rock of the later map that is clicked on.
function showChanges(changes, pick) {
  const { summary } = changes;
  const tiles = STATUSES.map((status) => make("div", { title: STATUS_WORDS[status] }, make("b", {}, digits(summary.counts[status])),
    make("i", { class: `spot ${status}` }), ` ${status}`));
  byId("changes").append(
    make("p", { class: "quiet" }, `From ${summary.a.map} (${digits(summary.a.n_objects)} objects) to ${summary.b.map} (${digits(summary.b.n_objects)} objects).`),
    make("div", { class: "tiles" }, ...tiles),
    make("div", { class: "charts" }, changesMap(changes), ...changesCharts(changes), agreement(summary)),
    changesTable(changes, pick));
}

function agreement(summary) {
  const { agreement: { rms_m, mean_d2 }, shift, options } = summary;
  const rows = [["Root mean square distance of the same", rms_m === null ? "\u2013" : metres(rms_m)],
    ["Mean squared Mahalanobis distance (2 where sigmas are right)", digits(mean_d2)],
    ["Registration, 1 sigma", metres(options.sigma_m)], ["Share of the same to recognise", digits(options.confidence)],
    ["May have moved by", metres(options.radius_m)], ["Least existence", digits(options.min_exist)]];
  if (shift) {
    rows.unshift(["Common shift, east", `${metres(shift.east_m)} (sigma ${metres(shift.sigma_east_m)})`],
      ["Common shift, north", `${metres(shift.north_m)} (sigma ${metres(shift.sigma_north_m)})`]);
  }
  return make("div", { class: "card" }, make("h3", {}, "Agreement and options"), table(["", ""], rows));
}

// Where the objects are: a path of dots for each status, so that many thousands are few elements.
function changesMap({ status, now_m, was_m }) {
  const here = status.map((_, i) => now_m[i] ?? was_m[i]);
  const [width, height, left, right, top, bottom] = [680, 440, 58, 12, 12, 36];
  const spread = [0, 1].map((k) => here.map((p) => p[k])).map((values) => [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)]);
  const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}` });
  if (here.length === 0) return figure("Where they are", svg, ["status"], () => []);
  const [inner, tall] = [width - left - right - 20, height - top - bottom - 20];
  const scale = Math.min(inner / Math.max(spread[0][1] - spread[0][0], 1), tall / Math.max(spread[1][1] - spread[1][0], 1));
  const middle = spread.map(([low, high]) => (low + high) / 2);
  const at = ([east, north]) => [left + (width - left - right) / 2 + (east - middle[0]) * scale, top + (height - top - bottom) / 2 - (north - middle[1]) * scale];
  const half = [(width - left - right) / 2 / scale, (height - top - bottom) / 2 / scale];
  const axisOf = (k, place) => ({ at: (v) => at(k === 0 ? [v, middle[1]] : [middle[0], v])[place], ticks: linearTicks(middle[k] - half[k], middle[k] + half[k]) });
  frame(svg, axisOf(0, 0), axisOf(1, 1), ["east, m", "north, m"], { width, height, left, right, top, bottom });
  for (const name of ["unseen", "same", "gone", "new", "moved"]) {
    const d = status.map((s, i) => (s === name ? `M${at(here[i]).map((x) => x.toFixed(1)).join(" ")}h0` : "")).join("");
    if (d) svg.append(drawn("path", { class: `spots ${name}`, d }, drawn("title", {}, `${name}: ${STATUS_WORDS[name]}`)));
  }
  const ways = status.map((s, i) => (s === "moved" ? `M${at(was_m[i]).map((x) => x.toFixed(1)).join(" ")}L${at(now_m[i]).map((x) => x.toFixed(1)).join(" ")}` : "")).join("");
  if (ways) svg.append(drawn("path", { class: "way moved", d: ways }));
  const shown = status.map((s, i) => [s, i]).filter(([s]) => s !== "same");
  const out = figure("Where they are", svg, ["status", "east, m", "north, m"], () => shown.map(([s, i]) => [s, ...here[i].map((x) => fixed(x, 3))]), "What is gone is drawn where it was; a line leads from where a moved one was.");
  out.classList.add("broad");
  return out;
}

function changesCharts({ status, distance_m, sigma }) {
  const of = (values, name) => values.filter((x, i) => status[i] === name && x !== null);
  const [near, moved, sigmas] = [of(distance_m, "same"), of(distance_m, "moved"), of(sigma, "same")];
  return [
    near.length ? bars("How far apart the same are", spread(near.map((x) => 100 * x)), ["distance, cm", "objects"]) : null,
    sigmas.length ? bars("The same in standard deviations", spread(sigmas), ["Mahalanobis distance", "objects"]) : null,
    moved.length ? bars("How far others moved", spread(moved), ["distance, m", "objects"]) : null,
  ].filter((chart) => chart);
}

function changesTable(changes, pick) {
  const { status, id_a, id_b, distance_m, p_exist_a, p_exist_b, now_m, was_m } = changes;
  const told = status.map((_, i) => i).filter((i) => status[i] !== "same" && status[i] !== "unseen");
  const link = (id) => {
    if (!pick || id === null) return id;
    const button = make("button", { type: "button", class: "link" }, id);
    button.addEventListener("click", () => pick(id));
    return button;
  };
  const rows = told.slice(0, MAX_CHANGES).map((i) => [status[i], id_a[i], link(id_b[i]), digits(distance_m[i]), digits(p_exist_a[i]), digits(p_exist_b[i]), ...(now_m[i] ?? was_m[i]).map((x) => fixed(x, 2))]);
  if (rows.length === 0) return make("p", { class: "quiet" }, "Nothing moved, nothing is new, nothing is gone.");
  const title = told.length > rows.length ? `The first ${rows.length} of ${digits(told.length)} changes; compare.csv has all` : "Every change";
  const list = make("details", {}, make("summary", {}, title),
    make("div", { class: "scroll" }, table(["status", "earlier", "later", "distance, m", "existed", "exists", "east, m", "north, m"], rows, 3)));
  list.open = rows.length <= 30;
  return list;
}
