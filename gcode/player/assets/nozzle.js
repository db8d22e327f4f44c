// The nozzle's body in the plane of the sheet, and what of the print pushes into it.

// It consists of parts, as `gcode.nozzle_body.Faces` has them: each a bottom at `floor` above the tip, `half` as wide
// there, and sides that lean outwards until they are `widest` apart (null: without end) by half.

// Half its width at a height above the tip, in mm.
function halfWidth(nozzle, above) {
  let half = 0;
  for (const part of nozzle.parts) {
    if (above < part.floor) continue;
    half = Math.max(half, Math.min(part.half + (above - part.floor) * part.sine / part.cosine, part.widest ?? Infinity));
  }
  return half;
}

// Its outline from the tip at (0, 0), up to `top` mm: points on its right side, from below.
function outline(nozzle, top) {
  const heights = [0, top];
  for (const { floor, half, sine, cosine, widest } of nozzle.parts) {
    heights.push(floor);
    if (sine > 0 && widest !== null) heights.push(floor + (widest - half) * cosine / sine);
  }
  const right = [];
  for (const height of heights.filter((one) => one <= top).sort((a, b) => a - b)) {
    // Where a part begins there are two widths: below and above.
    if (height > 0) right.push([halfWidth(nozzle, height - 1e-9), height]);
    right.push([halfWidth(nozzle, height), height]);
  }
  return right;
}

// How deep a point at (dx, dy) from the tip is inside the body: its distance to the nearest face; 0 outside.
function depthInside(nozzle, dx, dy) {
  let depth = 0;
  const out = Math.abs(dx);
  for (const { floor, half, sine, cosine, widest } of nozzle.parts) {
    const sides = Math.min((half - out) * cosine + dy * sine, (widest ?? Infinity) - out);
    depth = Math.max(depth, Math.min(dy - floor, sides));
  }
  return depth;
}

// Toolpaths in upright strips, to find those near a place without asking all.
class Strips {
  constructor(track) {
    this.track = track;
    const [x0, , x1] = track.box;
    this.low = x0;
    this.count = Math.max(1, Math.min(2000, Math.ceil(Math.sqrt(track.n) * 2)));
    this.width = Math.max((x1 - x0) / this.count, 1e-6);
    // Of each strip its toolpaths stand in `all` from `first` on, in their order.
    this.first = new Int32Array(this.count + 3);
    const { x, stepOf, n } = track, each = (visit) => {
      for (let k = 0; k < n; k++) {
        const s = stepOf[k], to = this.index(Math.max(x[s - 1], x[s]));
        for (let i = this.index(Math.min(x[s - 1], x[s])); i <= to; i++) visit(i, k);
      }
    };
    each((i) => { this.first[i + 2]++; });
    for (let i = 1; i < this.first.length; i++) this.first[i] += this.first[i - 1];
    this.all = new Int32Array(this.first.at(-1));
    each((i, k) => { this.all[this.first[i + 1]++] = k; });
    this.seen = new Int32Array(track.n);
    this.mark = 0;
  }

  index(x) { return Math.max(0, Math.min(this.count, Math.floor((x - this.low) / this.width))); }

  // Calls visit(k, x0, y0, x1, y1) once for each toolpath that may meet the box, below `most` of them.
  near([x0, y0, x1, y1], most, visit) {
    this.mark++;
    for (let i = this.index(x0); i <= this.index(x1); i++) {
      for (let at = this.first[i]; at < this.first[i + 1]; at++) {
        const k = this.all[at];
        if (k >= most) break;
        if (this.seen[k] === this.mark) continue;
        this.seen[k] = this.mark;
        const s = this.track.stepOf[k], x = this.track.x, y = this.track.y;
        if (Math.max(y[s], y[s - 1]) < y0 || Math.min(y[s], y[s - 1]) > y1) continue;
        if (Math.max(x[s], x[s - 1]) < x0 || Math.min(x[s], x[s - 1]) > x1) continue;
        visit(k, x[s - 1], y[s - 1], x[s], y[s]);
      }
    }
  }
}

// What of the first `done` toolpaths is inside the body at (x, y): {depth, toolpaths}.
function hindering(nozzle, strips, x, y, done) {
  const found = { depth: 0, toolpaths: [] };
  const top = strips.track.box[3] - y;
  if (!nozzle || top <= 0) return found;
  const reach = halfWidth(nozzle, top);
  strips.near([x - reach, y, x + reach, y + top], done, (k, x0, y0, x1, y1) => {
    let depth = 0;
    const pieces = 8; // the deepest point of a straight line in a convex body is near one of these
    for (let i = 0; i <= pieces; i++) depth = Math.max(depth, depthInside(nozzle, x0 + (x1 - x0) * i / pieces - x, y0 + (y1 - y0) * i / pieces - y));
    if (depth > 1e-3) { found.toolpaths.push(k); found.depth = Math.max(found.depth, depth); }
  });
  return found;
}
