// The page around the map.

function tiles() {
  const counts = DATA.manifest.counts;
  const seen = COVERAGE ? COVERAGE.seen_by_at_least_m2[0] : null;
  const rejected = Object.values(DATA.rejects.by_reason).reduce((a, b) => a + b, 0);
  const says = [["rocks", counts.objects], ["views", counts.views], ["detections on the ground", counts.detections_placed],
    ["records set aside", rejected], ["m\u00b2 of ground seen", seen], ["warnings", DATA.manifest.warnings.length]];
  byId("figures").append(...says.filter(([, n]) => n !== null).map(([name, n]) => make("div", {}, make("b", {}, digits(n)), name)));
  byId("about").textContent = `rockmap ${DATA.manifest.version}, run ${DATA.manifest.run_id}, method ${DATA.manifest.config.fusion.method}, ${DATA.manifest.site.body}`;
}

function distributions() {
  const c = DATA.charts;
  const of = (title, histogram, names, words) => (histogram ? bars(title, histogram, names, words) : null);
  const last = "The last bar holds everything beyond it, too.";
  fill("distributions", "No rocks.", [
    ...(c.sizes ? sizeCharts(c.sizes, c.laws) : []),
    of("Existence", c.existence, ["probability of existence", "rocks"]),
    of("Residuals in pictures", c.residual_px, ["residual, px", "detections"], `From each detection to its rock drawn back into the picture. ${last}`),
    of("Residuals on the ground", c.residual_m, ["residual, m", "detections"], `From each detection\u2019s place to its rock\u2019s. ${last}`),
    of("Views that saw a rock", c.views_by_rock, ["views that saw it", "rocks"]),
    of("Detections of a view", c.detections_by_view, ["detections of a view", "views"]),
    lines("Detections along the traverse", [{ name: "detections", points: [...VIEWS.n_detections].map((n, k) => [k + 1, n]) }], ["view", "detections on the ground"], { from_zero: true }),
  ]);
}

function fill(id, otherwise, parts) {
  const shown = parts.filter((part) => part);
  byId(id).append(...(shown.length ? shown : [make("p", { class: "quiet" }, otherwise)]));
}

function coverageCharts() {
  if (!COVERAGE) return fill("coverage", "No view sees any ground.", []);
  const areas = COVERAGE.seen_by_at_least_m2;
  const rows = areas.slice(0, 10).map((area, k) => [`${k + 1} or more`, digits(area, 4), `${digits((100 * area) / areas[0])} %`]);
  const words = `Counted on a grid of ${digits(COVERAGE.columns)} \u00d7 ${digits(COVERAGE.rows)} cells of ${metres(COVERAGE.cell_m)}, which the map shades.`;
  fill("coverage", "", [
    make("div", { class: "card" }, table(["views", "m\u00b2", "of what is seen"], rows), make("p", { class: "quiet" }, words)),
    lines("Ground seen by at least so many views", [{ name: "area", points: areas.map((area, k) => [k + 1, area]) }], ["views", "ground seen, m\u00b2"], { from_zero: true, dotted: true }),
  ]);
}

// The six corrections of every pose along the way of its platform.
function poses() {
  if (VIEWS.correction.every(Number.isNaN)) return fill("poses", "Poses are as measured: the method does not correct any.", []);
  const by_way = WAYS.length === 1 && VIEWS.along_m[VIEWS.along_m.length - 1] > 0;
  const at = (k) => (by_way ? VIEWS.along_m[k] : k + 1);
  const of = (names, first, factor) => names.map((name, i) => ({
    name, kind: SERIES[i], points: VIEWS.id.map((_, k) => [at(k), factor * VIEWS.correction[6 * k + first + i]]),
  }));
  const where = by_way ? "way along the traverse, m" : "view";
  const options = { from_zero: true, dotted: true };
  fill("poses", "", [
    lines("Corrections of position", of(["east", "north", "up"], 0, 100), [where, "corrected by, cm"], { ...options, words: "From the measured place of the platform to the corrected one." }),
    lines("Corrections of attitude", of(["roll", "pitch", "yaw"], 3, 1), [where, "corrected by, degrees"], { ...options, words: "About the axes of the platform: forward, left and up." }),
    bars("How far poses were moved", spread([...VIEWS.shift_m].map((x) => 100 * x)), ["shift, cm", "views"]),
    bars("How far poses were turned", spread([...VIEWS.turn_deg]), ["turn, degrees", "views"]),
  ]);
}

function rejects() {
  const { by_reason, first } = DATA.rejects;
  const reasons = Object.entries(by_reason);
  if (reasons.length === 0) return fill("rejects", "None: every record was used.", []);
  const all = reasons.reduce((n, [, count]) => n + count, 0);
  const list = make("details", {}, make("summary", {}, first.length < all ? `The first ${first.length} of ${digits(all)}; rejects.csv has all` : "Each of them"),
    make("div", { class: "scroll" }, table(["file", "line", "record", "reason", "detail"], first.map((row) => row.map((x) => (x === null ? "\u2013" : String(x)))), 5)));
  fill("rejects", "", [table(["reason", "records"], reasons.map(([reason, count]) => [reason, digits(count)])), list]);
}

// What the numbers of a solver's lists are.
const PARTS = {
  noise_scales: ["column or bearing", "row", "size", "range"],
  pose_scales: ["east", "north", "up", "roll", "pitch", "yaw"],
  scores: ["mean logit of objects", "mean logit of clutter", "variance"],
};

// What a solver says of itself, whatever it is: numbers as a list, what has a curve as a chart.
function solver() {
  const parts = [];
  for (const evidence of DATA.manifest.solver ?? []) {
    const name = evidence.class === undefined ? "Belief fusion" : `Class ${ROCKS.classes[evidence.class] ?? "none"}`;
    const { log_likelihood: likelihood, detectability, ...rest } = evidence;
    const named = Object.entries(rest).map(([key, value]) => [key, PARTS[key] && Array.isArray(value) ? Object.fromEntries(value.map((x, i) => [PARTS[key][i] ?? i + 1, x])) : value]);
    parts.push(make("div", { class: "card" }, make("h3", {}, name), listed(Object.fromEntries(named))));
    if (likelihood?.length > 1) parts.push(lines(`${name}: likelihood`, [{ name: "log likelihood", points: likelihood.map((y, i) => [i + 1, y]) }], ["iteration", "log likelihood"]));
    if (detectability?.length > 1) parts.push(lines("Probability of detection", [{ name: "probability", points: detectability.map((y, i) => [i + 1, y]) }], ["bin of apparent size, or of range", "probability"], { range: [0, 1], dotted: true, words: "As learnt, in equal bins of the logarithm of the apparent size from small to large, or where marks have none, of the range from near to far." }));
  }
  fill("solver", "Nothing was solved.", parts);
}

// Any value of run.json as a list of names and values.
function listed(value) {
  if (value === null) return "\u2013";
  if (typeof value === "number") return digits(value, 6);
  if (typeof value !== "object") return String(value);
  if (Array.isArray(value) && value.every((x) => typeof x !== "object")) return value.map((x) => listed(x)).join(", ") || "\u2013";
  return make("dl", {}, ...Object.entries(value).flatMap(([key, x]) => [make("dt", {}, key), make("dd", {}, listed(x))]));
}

function settings() {
  const m = DATA.manifest;
  const parts = Object.entries(m.config).map(([section, values]) => make("div", { class: "card" }, make("h3", {}, `[${section}]`), listed(values)));
  parts.push(make("div", { class: "card" }, make("h3", {}, "Site"), listed(m.site)));
  const files = m.inputs.map((file) => [file.kind, file.file, digits(file.rows ?? null), (file.sha256 ?? "").slice(0, 16)]);
  parts.push(make("div", { class: "card wide" }, make("h3", {}, "Inputs"), table(["kind", "file", "rows", "SHA-256"], files, 2)));
  if (m.warnings.length) parts.push(make("div", { class: "card" }, make("h3", {}, "Warnings"), make("ul", {}, ...m.warnings.slice(0, 100).map((w) => make("li", {}, w)))));
  byId("settings").append(...parts);
}

const map = new RockMap(byId("map"));

// Chooses a rock, or none with -1, and says so.
function choose(i, is_centred = false) {
  map.chosen = i;
  showRock(i);
  byId("said").textContent = i < 0 ? "" : `${ROCKS.id[i]}: seen by ${ROCKS.n_views[i] === 1 ? "1 view" : `${digits(ROCKS.n_views[i])} views`}`;
  if (i >= 0) byId("find-id").value = ROCKS.id[i];
  if (i >= 0 && is_centred) {
    const [px, py] = map.pixelOf(ROCKS.east_m[i], ROCKS.north_m[i]);
    if (px < 40 || py < 40 || px > map.width - 40 || py > map.height - 40) [map.x, map.y] = [ROCKS.east_m[i], ROCKS.north_m[i]];
  }
  map.repaint();
}

function step(by) {
  if (N_ROCKS > 0) choose(map.chosen < 0 ? (by > 0 ? 0 : N_ROCKS - 1) : (map.chosen + by + N_ROCKS) % N_ROCKS, true);
}

// By keys and buttons: about the chosen rock where it is in view, so that it stays there.
function zoom(factor) {
  const at = map.chosen < 0 ? [] : map.pixelOf(ROCKS.east_m[map.chosen], ROCKS.north_m[map.chosen]);
  const is_in_view = at.length === 2 && at[0] > 0 && at[1] > 0 && at[0] < map.width && at[1] < map.height;
  map.zoom(factor, ...(is_in_view ? at : []));
}

function layerBoxes() {
  const named = [["rocks", "Rocks", N_ROCKS], ["ellipses", "95 % ellipses", N_ROCKS], ["detections", "Detections", DETECTIONS.id.length], ["views", "Views", VIEWS.id.length],
    ["traverse", "Traverse", WAYS.length], ["footprints", "Footprints", VIEWS.id.length], ["coverage", "Coverage", COVERAGE ? 1 : 0]];
  for (const [key, title, n] of named) {
    const box = make("input", { type: "checkbox", id: `layer-${key}` });
    box.checked = map.layers[key];
    box.disabled = n === 0;
    box.addEventListener("change", () => {
      map.layers[key] = box.checked;
      map.repaint();
    });
    byId("layers").append(make("label", {}, box, title));
  }
}

function legend() {
  const { title, ends, names, ramp } = map.colouring;
  if (N_ROCKS === 0) return;
  byId("legend").replaceChildren(make("div", {}, title), ...(ends
    ? [make("div", { class: "ramp", style: `background: linear-gradient(to right, ${ramp.join(", ")})` }), make("div", { class: "ends" }, make("span", {}, ends[0]), make("span", {}, ends[1]))]
    : names.slice(0, 12).map((name, k) => make("div", {}, make("i", { style: `background: ${ramp[k % ramp.length]}` }), name))));
}

// The longest of 1, 2 and 5 times a power of ten that is no wider than 130 pixels.
function scaleBar() {
  const most = 130 / map.scale;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = power * [5, 2, 1].find((s) => s * power <= most);
  const bar = byId("scale");
  bar.style.width = `${(length * map.scale).toFixed(1)}px`;
  const said = length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : `${Number((100 * length).toPrecision(3))} cm`;
  if (bar.firstElementChild.textContent !== said) bar.firstElementChild.textContent = said;
}

function pointers() {
  const canvas = map.canvas;
  const held = new Map();
  let moved = 0;
  let hover = null;
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const spread = () => {
    const [a, b] = [...held.values()];
    return { distance: Math.hypot(a[0] - b[0], a[1] - b[1]), middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2] };
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, at(event));
    if (held.size === 1) moved = 0;
    tip(-1);
  });
  canvas.addEventListener("pointermove", (event) => {
    const now = at(event);
    if (!held.has(event.pointerId)) {
      if (!hover) requestAnimationFrame(() => {
        tip(map.rockAt(...hover), hover);
        hover = null;
      });
      hover = now;
      return;
    }
    const before = held.get(event.pointerId);
    const pinched = held.size === 2 ? spread() : null;
    held.set(event.pointerId, now);
    moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (pinched) {
      const then = spread();
      map.pan(then.middle[0] - pinched.middle[0], then.middle[1] - pinched.middle[1]);
      map.zoom(then.distance / Math.max(1, pinched.distance), ...then.middle);
    } else if (held.size === 1 && moved > 3) {
      map.pan(now[0] - before[0], now[1] - before[1]);
    }
  });
  const release = (event) => {
    const was_click = held.size === 1 && moved <= 3 && event.type === "pointerup";
    held.delete(event.pointerId);
    if (was_click) choose(map.rockAt(...at(event)));
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => tip(-1));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    map.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0018)), ...at(event));
  }, { passive: false });
}

function tip(i, at) {
  const tip = byId("tip");
  tip.hidden = i < 0;
  map.canvas.style.cursor = i < 0 ? "" : "pointer";
  if (i < 0) return;
  const missed = ROCKS.misses[i + 1] - ROCKS.misses[i];
  tip.textContent = `${ROCKS.id[i]} \u00b7 ${metres(ROCKS.diameter_m[i])} \u00b7 seen by ${ROCKS.n_views[i]}, missed by ${missed}`;
  const left = Math.min(at[0] + 14, map.width - tip.offsetWidth - 4);
  tip.style.transform = `translate(${Math.max(0, left)}px, ${Math.max(0, at[1] - 34)}px)`;
}

function keys() {
  const move = 80;
  const does = {
    ArrowLeft: () => map.pan(move, 0), ArrowRight: () => map.pan(-move, 0), ArrowUp: () => map.pan(0, move), ArrowDown: () => map.pan(0, -move),
    "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: () => map.fit(), Home: () => map.fit(),
    n: () => step(1), p: () => step(-1), Enter: () => choose(map.nearest()), Escape: () => choose(-1),
  };
  map.canvas.addEventListener("keydown", (event) => {
    const action = does[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });
}

function controls() {
  byId("zoom-in").addEventListener("click", () => zoom(1.6));
  byId("zoom-out").addEventListener("click", () => zoom(1 / 1.6));
  byId("fit").addEventListener("click", () => map.fit());
  byId("next").addEventListener("click", () => step(1));
  byId("previous").addEventListener("click", () => step(-1));
  byId("find").addEventListener("submit", (event) => {
    event.preventDefault();
    const wanted = byId("find-id").value.trim();
    const i = ROCKS.id.indexOf(wanted);
    if (i >= 0) choose(i, true);
    else byId("said").textContent = `No rock is called ${wanted || "nothing"}.`;
  });
  themeButton(() => {
    map.colours();
    legend();
  });
}

map.onMove = scaleBar;
tiles();
layerBoxes();
legend();
showRock(-1);
pointers();
keys();
controls();
// The map is drawn first; what lies below the fold follows.
requestAnimationFrame(() => setTimeout(() => {
  performance.mark("map drawn");
  if (DATA.changes) {
    byId("changes-part").hidden = false;
    showChanges(DATA.changes, (id) => {
      choose(ROCKS.id.indexOf(id), true);
      byId("map").scrollIntoView({ block: "center" });
    });
  }
  distributions();
  coverageCharts();
  poses();
  rejects();
  solver();
  settings();
  document.documentElement.dataset.ready = "true";
}));
