// What the panel says of the chosen rock.

const CROPS = new Map();
for (const crop of DATA.crops) {
  if (!CROPS.has(crop.rock)) CROPS.set(crop.rock, []);
  CROPS.get(crop.rock).push(crop);
}

function showRock(i) {
  const panel = byId("rock");
  panel.replaceChildren();
  if (i < 0) {
    panel.append(introduction());
    return;
  }
  panel.append(
    make("h2", {}, ROCKS.id[i]),
    facts(i),
    make("h3", {}, "Seen by"),
    crops(i, true),
    make("h3", {}, "Covers it and did not detect it"),
    crops(i, false),
    make("h3", {}, "Detections and residuals"),
    make("div", { class: "wide" }, members(i)),
    make("h3", {}, "Covariance"),
    covariance(i));
  panel.scrollTop = 0;
}

function introduction() {
  const limits = DATA.crop_limits;
  const shown = DATA.crops.length;
  const words = N_ROCKS === 0
    ? "No rocks in this run."
    : "Click on a rock, or type its name, to see the pictures and detections it rests on.";
  const cut = limits.wanted > shown
    ? `This page holds ${digits(shown)} of ${digits(limits.wanted)} crops: a first one of every rock before a second one of any.`
    : `This page holds all ${digits(shown)} crops.`;
  return make("div", { class: "quiet" }, make("p", {}, words),
    N_ROCKS > 0 ? make("p", {}, `${cut} Crops are at most ${limits.side_px} pixels wide, ${limits.seen} of views that saw a rock and ${limits.missed} of views that missed it, and ${digits(limits.text / 1e6)} MB in all.`) : null);
}

function facts(i) {
  const list = make("dl");
  const say = (term, text) => list.append(make("dt", {}, term), make("dd", {}, text));
  const name = ROCKS.classes[ROCKS.class[i]];
  if (name) say("Class", name);
  if (!Number.isNaN(ROCKS.p_exist[i])) say("Existence", digits(ROCKS.p_exist[i], 4));
  say("Diameter", metres(ROCKS.diameter_m[i]));
  say("Latitude", `${ROCKS.lat_deg[i].toFixed(8)}\u00b0`);
  say("Longitude", `${ROCKS.lon_deg[i].toFixed(8)}\u00b0`);
  say("Height", `${(Math.round(100 * ROCKS.height_m[i]) / 100 + 0).toFixed(2)} m`);
  say("East, north", `${ROCKS.east_m[i].toFixed(3)}, ${ROCKS.north_m[i].toFixed(3)} m`);
  say("1-sigma ellipse", `${metres(ROCKS.sigma_major_m[i])} \u00d7 ${metres(ROCKS.sigma_minor_m[i])}, long axis ${digits(ROCKS.sigma_az_deg[i])}\u00b0 from north`);
  const n_missed = ROCKS.misses[i + 1] - ROCKS.misses[i];
  say("Views", `${digits(ROCKS.n_views[i])} saw it, ${digits(n_missed)} did not`);
  return list;
}

// Crops of the views that saw a rock, or of those that missed it; those without a crop by name.
function crops(i, is_seen) {
  const here = (CROPS.get(i) ?? []).filter((crop) => (crop.detection !== null) === is_seen);
  const views = is_seen ? [...viewsOf(i)] : [...ROCKS.missed_by.subarray(ROCKS.misses[i], ROCKS.misses[i + 1])];
  const out = make("div");
  if (views.length === 0) return make("p", { class: "quiet" }, is_seen ? "No view." : "None: every view that covers it detected it.");
  if (here.length > 0) {
    out.append(make("div", { class: "crops" }, ...here.map((crop) => cropFigure(i, crop))));
    const key = (colour, words) => [make("span", { class: "key", style: `color: ${colour}` }), ` ${words} `];
    out.append(make("p", { class: "quiet" }, ...(is_seen ? key("#ffc43d", "the detection") : []), ...key("#35e0ff", "the rock\u2019s place, with its 95 % ellipse")));
  }
  const with_crop = new Set(here.map((crop) => crop.view));
  const others = views.filter((view) => !with_crop.has(view));
  if (others.length > 0) {
    const names = others.slice(0, 60).map((view) => VIEWS.id[view]).join(", ");
    const more = others.length > 60 ? ` and ${others.length - 60} more` : "";
    out.append(make("p", { class: "quiet" }, `${here.length ? "Without a crop: " : "No crops: "}${names}${more}.`));
  }
  return out;
}

function cropFigure(i, crop) {
  const image_id = VIEWS.id[crop.view];
  const member = crop.detection === null ? -1 : memberOf(i, crop.detection);
  const residual = member < 0 ? NaN : ROCKS.residual_px[member];
  const said = crop.detection === null
    ? `${ROCKS.id[i]} in ${image_id}, which did not detect it`
    : `${ROCKS.id[i]} in ${image_id}, ${digits(residual)} pixels from its detection`;
  const path = VIEWS.picture[crop.view];
  const name = path
    ? make("a", { href: path.split("/").map(encodeURIComponent).join("/"), target: "_blank", rel: "noopener" }, image_id)
    : image_id;
  return make("figure", {}, cropPicture(crop, said),
    make("figcaption", {}, name, make("br"), crop.detection === null ? "missed" : `${residual.toFixed(1)}\u00a0px off, ${digits(DETECTIONS.range_m[crop.detection])}\u00a0m`));
}

// Pixels of the picture are the units of the drawing; a pixel's middle has whole coordinates.
function cropPicture(crop, said) {
  const [x, y, w, h] = [crop.column - 0.5, crop.row - 0.5, crop.width, crop.height];
  const svg = drawn("svg", { viewBox: `${x} ${y} ${w} ${h}`, role: "img", "aria-label": said },
    drawn("image", { href: `data:image/jpeg;base64,${crop.jpeg}`, x, y, width: w, height: h, preserveAspectRatio: "none" }));
  if (crop.mark_px) {
    const [left, top, right, bottom] = crop.mark_px;
    svg.append(right > left
      ? drawn("rect", { class: "mark", x: left, y: top, width: right - left, height: bottom - top })
      : drawn("circle", { class: "mark", cx: left, cy: top, r: w / 20 }));
  }
  const [u, v] = crop.place_px;
  const arm = w / 18;
  svg.append(drawn("path", { class: "place", d: `M${u - arm} ${v}h${2 * arm}M${u} ${v - arm}v${2 * arm}` }));
  const [uu, uv, vv] = crop.covariance_px2;
  const [middle, spread] = [(uu + vv) / 2, Math.hypot((uu - vv) / 2, uv)];
  const turn = (0.5 * Math.atan2(2 * uv, uu - vv) * 180) / Math.PI;
  const [rx, ry] = [SCALE_95 * Math.sqrt(Math.max(0, middle + spread)), SCALE_95 * Math.sqrt(Math.max(0, middle - spread))];
  svg.append(drawn("ellipse", { class: "place", cx: u, cy: v, rx, ry, transform: `rotate(${turn} ${u} ${v})` }));
  return svg;
}

function memberOf(i, detection) {
  for (let k = ROCKS.members[i]; k < ROCKS.members[i + 1]; k++) if (ROCKS.member[k] === detection) return k;
  return -1;
}

function members(i) {
  const rows = [];
  for (let k = ROCKS.members[i]; k < ROCKS.members[i + 1]; k++) {
    const d = ROCKS.member[k];
    rows.push([VIEWS.id[DETECTIONS.view[d]], DETECTIONS.id[d], digits(ROCKS.weight[k], 3), fixed(ROCKS.residual_px[k], 2), fixed(100 * ROCKS.residual_m[k], 1), digits(DETECTIONS.range_m[d]), digits(DETECTIONS.score[d], 2)]);
  }
  return table(["view", "mark", "weight", "px", "cm", "range, m", "score"], rows, 2);
}

function covariance(i) {
  const [ee, en, eu, nn, nu, uu] = ROCKS.covariance_m2.subarray(6 * i, 6 * i + 6);
  const rows = [["east", ee, en, eu], ["north", en, nn, nu], ["up", eu, nu, uu]];
  return make("div", {}, table(["cm\u00b2", "east", "north", "up"], rows.map(([name, ...row]) => [name, ...row.map((x) => digits(1e4 * x))])),
    make("p", { class: "quiet" }, `One sigma: ${metres(Math.sqrt(ee))} east, ${metres(Math.sqrt(nn))} north, ${metres(Math.sqrt(uu))} up.`));
}
