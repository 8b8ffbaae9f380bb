// Points in the cells of a grid, to find those in a rectangle without looking at all of them.
class Grid {
  constructor(x, y) {
    this.x = x;
    this.y = y;
    this.box = x.length ? boundsOf(x, y) : [0, 0, 0, 0];
    const [west, south, east, north] = this.box;
    const n = Math.max(1, x.length);
    this.side = Math.max(1e-3, Math.sqrt(((east - west) * (north - south) * 4) / n), Math.max(east - west, north - south) / 2000);
    this.columns = Math.max(1, Math.ceil((east - west) / this.side + 1e-9));
    this.rows = Math.max(1, Math.ceil((north - south) / this.side + 1e-9));
    const cell = new Uint32Array(x.length);
    this.start = new Uint32Array(this.columns * this.rows + 1);
    for (let i = 0; i < x.length; i++) {
      cell[i] = this.row(y[i]) * this.columns + this.column(x[i]);
      this.start[cell[i] + 1]++;
    }
    for (let c = 0; c < this.columns * this.rows; c++) this.start[c + 1] += this.start[c];
    const next = this.start.slice();
    this.items = new Uint32Array(x.length);
    for (let i = 0; i < x.length; i++) this.items[next[cell[i]]++] = i;
  }

  column(x) {
    return Math.min(this.columns - 1, Math.max(0, Math.floor((x - this.box[0]) / this.side)));
  }

  row(y) {
    return Math.min(this.rows - 1, Math.max(0, Math.floor((y - this.box[1]) / this.side)));
  }

  // Calls back with ranges of `items` that hold all points of the rectangle, and some beside it.
  ranges(west, south, east, north, range) {
    if (!this.x.length || east < this.box[0] || west > this.box[2] || north < this.box[1] || south > this.box[3]) return;
    const [from, to] = [this.column(west), this.column(east)];
    for (let row = this.row(south); row <= this.row(north); row++) {
      const first = this.start[row * this.columns + from];
      const last = this.start[row * this.columns + to + 1];
      if (last > first) range(first, last);
    }
  }

  count(west, south, east, north) {
    let n = 0;
    this.ranges(west, south, east, north, (first, last) => (n += last - first));
    return n;
  }

  each(west, south, east, north, visit) {
    this.ranges(west, south, east, north, (first, last) => {
      for (let k = first; k < last; k++) {
        const i = this.items[k];
        if (this.x[i] >= west && this.x[i] <= east && this.y[i] >= south && this.y[i] <= north) visit(i);
      }
    });
  }
}

function boundsOf(x, y) {
  let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < x.length; i++) {
    west = Math.min(west, x[i]);
    east = Math.max(east, x[i]);
    south = Math.min(south, y[i]);
    north = Math.max(north, y[i]);
  }
  return [west, south, east, north];
}
