// The map: east to the right, north up, metres to pixels by one scale.

// The 8 steps a value from 0 to 1 is coloured by, from doubtful to sure (after viridis).
const RAMP = ["#d8a200", "#9aa800", "#4a9e3f", "#1c8f74", "#22738a", "#31558a", "#41307a", "#40014f"];
const RAMP_DARK = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];
const CLASS_COLOURS = ["#b5482a", "#2f6fab", "#5b8c2a", "#8d4fa3", "#b98a1a", "#2b8f8a", "#a33b5f", "#6d6d6d"];
// More points than this in view are drawn as dots into a raster.
const MANY = 3000;
// The raster's pixels are this large.
const DOT_PX = 2;
const MIN_RADIUS_PX = 3.5;
const UNKNOWN_DIAMETER_M = 0.2;
const SCALE_95 = Math.sqrt(5.991464547107982);

class RockMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.raster = document.createElement("canvas");
    this.rocks = new Grid(ROCKS.east_m, ROCKS.north_m);
    this.detections = new Grid(DETECTIONS.east_m, DETECTIONS.north_m);
    this.largest = ROCKS.diameter_m.reduce((most, d) => (d > most ? d : most), UNKNOWN_DIAMETER_M);
    this.layers = { coverage: true, footprints: false, traverse: true, views: true, detections: false, ellipses: true, rocks: true };
    this.footprints = this.footprintBoxes();
    this.chosen = -1;
    this.onMove = () => {};
    this.colours();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.fit();
  }

  // Everything that lies on the map.
  extent() {
    const boxes = [N_ROCKS ? this.rocks.box : [Infinity, Infinity, -Infinity, -Infinity], boundsOf(VIEWS.east_m, VIEWS.north_m)];
    if (N_ROCKS === 0 && COVERAGE) {
      boxes.push([COVERAGE.east_m, COVERAGE.north_m, COVERAGE.east_m + COVERAGE.columns * COVERAGE.cell_m, COVERAGE.north_m + COVERAGE.rows * COVERAGE.cell_m]);
    }
    const box = [0, 1, 2, 3].map((i) => boxes.map((b) => b[i]).reduce((a, b) => (i < 2 ? Math.min(a, b) : Math.max(a, b))));
    return Number.isFinite(box[0]) ? box : [-1, -1, 1, 1];
  }

  fit() {
    const [west, south, east, north] = this.extent();
    this.x = (west + east) / 2;
    this.y = (south + north) / 2;
    this.scale = 0.86 * Math.min(this.width / Math.max(east - west, 0.5), this.height / Math.max(north - south, 0.5));
    this.least = this.scale / 20;
    this.repaint();
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.width = Math.max(1, this.canvas.clientWidth);
    this.height = Math.max(1, this.canvas.clientHeight);
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    this.ratio = ratio;
    this.raster.width = Math.ceil(this.width / DOT_PX);
    this.raster.height = Math.ceil(this.height / DOT_PX);
    this.rasterContext = this.raster.getContext("2d");
    this.image = this.rasterContext.createImageData(this.raster.width, this.raster.height);
    this.dots = new Uint32Array(this.image.data.buffer);
    this.repaint();
  }

  // Colours of the theme, and each rock's step on the ramp.
  colours() {
    const style = getComputedStyle(document.documentElement);
    const is_dark = style.colorScheme === "dark";
    this.ink = (name) => style.getPropertyValue(`--${name}`).trim();
    this.paint = Object.fromEntries(["ground", "cover", "outline", "way", "view", "detection", "ring", "accent"].map((name) => [name, this.ink(name)]));
    const ramp = is_dark ? RAMP_DARK : RAMP;
    const with_existence = ROCKS.p_exist.some((p) => !Number.isNaN(p));
    const most = ROCKS.n_views.reduce((a, b) => Math.max(a, b), 1);
    this.step = new Uint8Array(N_ROCKS);
    const clamp = (share, n) => Math.min(n - 1, Math.max(0, Math.floor(share * n)));
    if (with_existence) {
      this.colouring = { title: "Existence", ends: ["0", "1"], ramp };
      for (let i = 0; i < N_ROCKS; i++) this.step[i] = clamp(ROCKS.p_exist[i] || 0, ramp.length);
    } else if (ROCKS.classes.length > 1) {
      this.colouring = { title: "Class", names: ROCKS.classes.map((name) => name ?? "none"), ramp: CLASS_COLOURS };
      for (let i = 0; i < N_ROCKS; i++) this.step[i] = ROCKS.class[i] % CLASS_COLOURS.length;
    } else {
      this.colouring = { title: "Views that saw it", ends: ["1", String(most)], ramp };
      for (let i = 0; i < N_ROCKS; i++) this.step[i] = clamp(most > 1 ? Math.log(ROCKS.n_views[i] || 1) / Math.log(most) : 1, ramp.length);
    }
    this.packedRamp = this.colouring.ramp.map(packedColour);
    this.shade = COVERAGE && coverageImage(this.paint.cover);
    this.repaint();
  }

  repaint() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.draw();
    });
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.repaint();
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [east, north] = this.groundAt(px, py);
    this.scale = Math.min(20000, Math.max(this.least, this.scale * factor));
    this.x = east - (px - this.width / 2) / this.scale;
    this.y = north + (py - this.height / 2) / this.scale;
    this.repaint();
  }

  groundAt(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  pixelOf(east, north) {
    return [this.width / 2 + (east - this.x) * this.scale, this.height / 2 - (north - this.y) * this.scale];
  }

  radius(i) {
    return Math.max(MIN_RADIUS_PX, 0.5 * (ROCKS.diameter_m[i] || UNKNOWN_DIAMETER_M) * this.scale);
  }

  // The rock under a pixel, or near it; the nearest of several, -1 for none.
  rockAt(px, py, reach = 8) {
    if (!this.layers.rocks) return -1;
    const [east, north] = this.groundAt(px, py);
    const around = Math.max(reach / this.scale, this.largest / 2);
    let [best, nearest] = [-1, Infinity];
    this.rocks.each(east - around, north - around, east + around, north + around, (i) => {
      const distance = Math.hypot(ROCKS.east_m[i] - east, ROCKS.north_m[i] - north) * this.scale;
      if (distance < nearest && distance <= Math.max(reach, this.radius(i))) [best, nearest] = [i, distance];
    });
    return best;
  }

  nearest() {
    let [best, distance] = [-1, Infinity];
    for (let i = 0; i < N_ROCKS; i++) {
      const d = Math.hypot(ROCKS.east_m[i] - this.x, ROCKS.north_m[i] - this.y);
      if (d < distance) [best, distance] = [i, d];
    }
    return best;
  }

  draw() {
    const c = this.context;
    c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    c.fillStyle = this.paint.ground;
    c.fillRect(0, 0, this.width, this.height);
    const layers = this.layers;
    if (layers.coverage && this.shade) this.drawCoverage(c);
    if (layers.footprints) this.drawFootprints(c);
    if (layers.traverse) this.drawWays(c);
    if (layers.detections) this.drawDetections(c);
    if (layers.rocks || layers.ellipses) this.drawRocks(c, layers);
    if (layers.views) this.drawViews(c);
    if (this.chosen >= 0) this.drawChosen(c);
    this.onMove();
  }

  window(margin) {
    const [west, north] = this.groundAt(-margin, -margin);
    const [east, south] = this.groundAt(this.width + margin, this.height + margin);
    return [west, south, east, north];
  }

  drawCoverage(c) {
    const [left, bottom] = this.pixelOf(COVERAGE.east_m, COVERAGE.north_m);
    const [w, h] = [COVERAGE.columns * COVERAGE.cell_m * this.scale, COVERAGE.rows * COVERAGE.cell_m * this.scale];
    c.imageSmoothingEnabled = false;
    c.drawImage(this.shade, left, bottom - h, w, h);
  }

  footprintBoxes() {
    const boxes = [];
    for (let view = 0; view < VIEWS.id.length; view++) {
      const first = VIEWS.rings[VIEWS.footprints[view]];
      const last = VIEWS.rings[VIEWS.footprints[view + 1]];
      const corners = VIEWS.corners.subarray(2 * first, 2 * last);
      const x = corners.filter((_, i) => i % 2 === 0);
      boxes.push(boundsOf(x, corners.filter((_, i) => i % 2 === 1)));
    }
    return boxes;
  }

  drawFootprints(c) {
    const [west, south, east, north] = this.window(0);
    const seen = [];
    this.footprints.forEach((box, view) => {
      if (box[2] >= west && box[0] <= east && box[3] >= south && box[1] <= north) seen.push(view);
    });
    const stride = Math.ceil(seen.length / 400);
    c.beginPath();
    for (let k = 0; k < seen.length; k += stride) this.tracedFootprint(c, seen[k]);
    c.strokeStyle = this.paint.outline;
    c.lineWidth = 0.8;
    c.stroke();
  }

  tracedFootprint(c, view) {
    for (let ring = VIEWS.footprints[view]; ring < VIEWS.footprints[view + 1]; ring++) {
      for (let k = VIEWS.rings[ring]; k < VIEWS.rings[ring + 1]; k++) {
        const [px, py] = this.pixelOf(VIEWS.corners[2 * k], VIEWS.corners[2 * k + 1]);
        if (k === VIEWS.rings[ring]) c.moveTo(px, py);
        else c.lineTo(px, py);
      }
      c.closePath();
    }
  }

  drawWays(c) {
    c.beginPath();
    for (const way of WAYS) {
      let [lastX, lastY] = [-1e9, -1e9];
      for (let k = 0; k < way.length; k += 2) {
        const [px, py] = this.pixelOf(way[k], way[k + 1]);
        if (k === 0) c.moveTo(px, py);
        else if (Math.abs(px - lastX) + Math.abs(py - lastY) > 1.5 || k + 2 === way.length) c.lineTo(px, py);
        else continue;
        [lastX, lastY] = [px, py];
      }
    }
    c.strokeStyle = this.paint.way;
    c.lineWidth = 1.4;
    c.stroke();
  }

  drawViews(c) {
    c.beginPath();
    let [lastX, lastY] = [-1e9, -1e9];
    for (let view = 0; view < VIEWS.id.length; view++) {
      const [px, py] = this.pixelOf(VIEWS.east_m[view], VIEWS.north_m[view]);
      if (px < -9 || py < -9 || px > this.width + 9 || py > this.height + 9) continue;
      if (Math.abs(px - lastX) + Math.abs(py - lastY) < 3) continue;
      [lastX, lastY] = [px, py];
      const yaw = (VIEWS.yaw_deg[view] * Math.PI) / 180;
      if (Number.isNaN(yaw)) {
        c.moveTo(px + 2.5, py);
        c.arc(px, py, 2.5, 0, 7);
        continue;
      }
      const [s, k] = [Math.sin(yaw), Math.cos(yaw)];
      c.moveTo(px + 7 * s, py - 7 * k);
      c.lineTo(px - 4 * s + 3.5 * k, py + 4 * k + 3.5 * s);
      c.lineTo(px - 4 * s - 3.5 * k, py + 4 * k - 3.5 * s);
      c.closePath();
    }
    c.fillStyle = this.paint.view;
    c.fill();
  }

  // Points as dots of a raster, each the colour its step says.
  drawDots(c, grid, colour) {
    const { dots } = this;
    const [columns, rows] = [this.raster.width, this.raster.height];
    dots.fill(0);
    const perMetre = this.scale / DOT_PX;
    const [left, top] = [columns / 2 - this.x * perMetre, rows / 2 + this.y * perMetre];
    const { items, x, y } = grid;
    grid.ranges(...this.window(4), (first, last) => {
      for (let k = first; k < last; k++) {
        const i = items[k];
        const px = (left + x[i] * perMetre) | 0;
        const py = (top - y[i] * perMetre) | 0;
        if (px < 0 || py < 0 || px >= columns - 1 || py >= rows - 1) continue;
        const at = py * columns + px;
        dots[at] = dots[at + 1] = dots[at + columns] = dots[at + columns + 1] = colour(i);
      }
    });
    this.rasterContext.putImageData(this.image, 0, 0);
    c.imageSmoothingEnabled = false;
    c.drawImage(this.raster, 0, 0, columns * DOT_PX, rows * DOT_PX);
  }

  drawDetections(c) {
    const window = this.window(4);
    const packed = packedColour(this.paint.detection);
    if (this.detections.count(...window) > MANY) {
      this.drawDots(c, this.detections, () => packed);
      return;
    }
    c.beginPath();
    this.detections.each(...window, (i) => {
      const [px, py] = this.pixelOf(DETECTIONS.east_m[i], DETECTIONS.north_m[i]);
      c.moveTo(px + 2, py);
      c.arc(px, py, 2, 0, 7);
    });
    c.fillStyle = this.paint.detection;
    c.fill();
  }

  drawRocks(c, layers) {
    const margin = (this.largest / 2) * this.scale + 8;
    const window = this.window(Math.min(margin, 2000));
    if (this.rocks.count(...window) > MANY) {
      const { step, packedRamp } = this;
      if (layers.rocks) this.drawDots(c, this.rocks, (i) => packedRamp[step[i]]);
      return;
    }
    const by_step = this.colouring.ramp.map(() => []);
    this.rocks.each(...window, (i) => by_step[this.step[i]].push(i));
    if (layers.rocks) {
      by_step.forEach((rocks, step) => {
        if (!rocks.length) return;
        c.beginPath();
        for (const i of rocks) {
          const [px, py] = this.pixelOf(ROCKS.east_m[i], ROCKS.north_m[i]);
          const radius = this.radius(i);
          c.moveTo(px + radius, py);
          c.arc(px, py, radius, 0, 7);
        }
        c.fillStyle = this.colouring.ramp[step];
        c.fill();
      });
    }
    if (!layers.ellipses) return;
    c.beginPath();
    for (const i of by_step.flat()) this.tracedEllipse(c, i);
    c.strokeStyle = this.paint.ring;
    c.lineWidth = 0.9;
    c.stroke();
  }

  // The 95 % ellipse, from the horizontal covariance; one too small to show is left out.
  tracedEllipse(c, i) {
    const [ee, en, , nn] = ROCKS.covariance_m2.subarray(6 * i, 6 * i + 6);
    const middle = (ee + nn) / 2;
    const spread = Math.hypot((ee - nn) / 2, en);
    const major = SCALE_95 * Math.sqrt(Math.max(0, middle + spread)) * this.scale;
    const minor = SCALE_95 * Math.sqrt(Math.max(0, middle - spread)) * this.scale;
    if (major < 3) return;
    const [px, py] = this.pixelOf(ROCKS.east_m[i], ROCKS.north_m[i]);
    const turn = -0.5 * Math.atan2(2 * en, ee - nn);
    c.moveTo(px + major * Math.cos(turn), py + major * Math.sin(turn));
    c.ellipse(px, py, major, minor, turn, 0, 2 * Math.PI);
  }

  drawChosen(c) {
    const i = this.chosen;
    const [px, py] = this.pixelOf(ROCKS.east_m[i], ROCKS.north_m[i]);
    c.lineWidth = 1;
    c.strokeStyle = this.paint.detection;
    c.beginPath();
    for (let k = ROCKS.members[i]; k < ROCKS.members[i + 1]; k++) {
      const d = ROCKS.member[k];
      c.moveTo(px, py);
      c.lineTo(...this.pixelOf(DETECTIONS.east_m[d], DETECTIONS.north_m[d]));
    }
    c.stroke();
    c.setLineDash([5, 4]);
    c.strokeStyle = this.paint.way;
    c.beginPath();
    for (const view of viewsOf(i)) {
      c.moveTo(px, py);
      c.lineTo(...this.pixelOf(VIEWS.east_m[view], VIEWS.north_m[view]));
    }
    c.stroke();
    c.setLineDash([]);
    c.beginPath();
    this.tracedEllipse(c, i);
    c.moveTo(px + this.radius(i) + 4, py);
    c.arc(px, py, this.radius(i) + 4, 0, 7);
    c.strokeStyle = this.paint.accent;
    c.lineWidth = 2.5;
    c.stroke();
  }
}

// The views that detected a rock.
function viewsOf(i) {
  const views = new Set();
  for (let k = ROCKS.members[i]; k < ROCKS.members[i + 1]; k++) {
    if (ROCKS.weight[k] >= 0.5) views.add(DETECTIONS.view[ROCKS.member[k]]);
  }
  return views;
}

// A colour "#rrggbb" as a pixel of a raster, opaque.
function packedColour(colour) {
  const rgb = parseInt(colour.slice(1), 16);
  return (0xff000000 | ((rgb & 255) << 16) | (rgb & 0xff00) | (rgb >> 16)) >>> 0;
}

// The more views see a cell, the deeper its shade.
function coverageImage(cover) {
  const { columns, rows, views } = COVERAGE;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [columns, rows];
  const context = canvas.getContext("2d");
  const image = context.createImageData(columns, rows);
  const rgb = cover.split(",").map(Number);
  const most = Math.log1p(views.reduce((a, b) => Math.max(a, b), 1));
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const n = views[row * columns + column];
      const at = 4 * ((rows - 1 - row) * columns + column);
      image.data.set(rgb, at);
      image.data[at + 3] = n === 0 ? 0 : 255 * (0.08 + (0.42 * Math.log1p(n)) / most);
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}
