// A program as flat arrays: unpacked, summed up, and asked where it is at a time.

const TRAVEL = 0, TOOLPATH = 1, PRIME = 2, STANDS = 3, JUMP = 4;

async function inflate(text) {
  const raw = atob(text.trim());
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Differences, their lowest bytes first, as gcode/player/packing.py writes them.
function unpack(header, bytes) {
  const arrays = {};
  let at = 0;
  for (const { name, n, bytes: width } of header.arrays) {
    if (width === 1) {
      arrays[name] = bytes.subarray(at, at + n);
    } else {
      const values = new Int32Array(n);
      for (let k = 0, sum = 0; k < n; k++) {
        const a = at + k;
        sum = (sum + (bytes[a] | (bytes[a + n] << 8) | (bytes[a + 2 * n] << 16) | (bytes[a + 3 * n] << 24))) | 0;
        values[k] = sum;
      }
      arrays[name] = values;
    }
    at += n * width;
  }
  return arrays;
}

// How many numbers of a rising array are at most `value`.
function upTo(array, value) {
  let low = 0, high = array.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (array[middle] <= value) low = middle + 1; else high = middle;
  }
  return low;
}

class Track {
  constructor(header, bytes) {
    const raw = unpack(header, bytes), units = header.units;
    const scaled = (name) => {
      const counts = raw[name], unit = units[name], values = new Float64Array(counts.length);
      for (let k = 0; k < counts.length; k++) values[k] = counts[k] * unit;
      return values;
    };
    this.header = header;
    this.name = header.name;
    this.x = scaled("x"); this.y = scaled("y"); this.end = scaled("time");
    this.volume = scaled("volume"); this.speed = scaled("speed"); this.height = scaled("height");
    this.kind = raw.kind; this.line = raw.line; this.tool = raw.tool;
    this.hangs = raw.hangs; this.join = raw.join; this.after = raw.after; this.tile = raw.tile;
    this.steps = this.kind.length;
    this.n = this.height.length; // of all that is laid: toolpaths, and the joins between them
    this.total = this.steps ? this.end[this.steps - 1] : 0;
    this.sum();
    this.findings = header.findings.map(([line, kind, message]) => ({ line, kind, message, step: this.stepOfLine(line) }));
  }

  // What the figures need at every step, and where each toolpath is among the steps.
  sum() {
    const { steps, kind, x, y } = this;
    this.stepOf = new Int32Array(this.n);
    this.number = new Int32Array(this.n + 1);   // toolpaths among the first so many that are laid
    for (let k = 0; k < this.n; k++) this.number[k + 1] = this.number[k] + 1 - this.join[k];
    this.toolpaths = this.number[this.n];
    this.place = new Int32Array(this.toolpaths); // of each toolpath among all that is laid
    for (let k = 0; k < this.n; k++) if (!this.join[k]) this.place[this.number[k]] = k;
    this.done = new Int32Array(steps + 1);      // how much is laid before each step
    this.printed = new Float64Array(steps + 1); // length of the toolpaths of it
    this.joined = new Float64Array(steps + 1);  // and of the joins
    this.travelled = new Float64Array(steps + 1);
    const last = kind.lastIndexOf(TOOLPATH);
    let n = 0, printed = 0, joined = 0, travelled = 0;
    for (let s = 0; s < steps; s++) {
      if (s > 0 && kind[s] <= PRIME) {
        const length = Math.hypot(x[s] - x[s - 1], y[s] - y[s - 1]);
        if (kind[s] === TOOLPATH && this.join[n]) joined += length;
        else if (kind[s] === TOOLPATH) printed += length;
        else if (n > 0 && s < last) travelled += length; // what comes before and after is none of the print
      }
      if (kind[s] === TOOLPATH) this.stepOf[n++] = s;
      this.done[s + 1] = n; this.printed[s + 1] = printed; this.joined[s + 1] = joined; this.travelled[s + 1] = travelled;
    }
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let k = 0; k < n; k++) {
      for (const s of [this.stepOf[k] - 1, this.stepOf[k]]) {
        if (s < 0) continue;
        this.box[0] = Math.min(this.box[0], x[s]); this.box[1] = Math.min(this.box[1], y[s]);
        this.box[2] = Math.max(this.box[2], x[s]); this.box[3] = Math.max(this.box[3], y[s]);
      }
    }
    if (!n) this.box = [0, 0, 1, 1];
  }

  // [x0, y0, x1, y1] of the k-th that is laid.
  ends(k) {
    const s = this.stepOf[k];
    return [this.x[s - 1], this.y[s - 1], this.x[s], this.y[s]];
  }

  // Whether a step lays a toolpath, and no join.
  lays(step) { return step < this.steps && this.kind[step] === TOOLPATH && !this.join[this.done[step]]; }

  // The toolpath of a number from 1 on that a step lays, or the last one before it.
  numberAt(step) { return this.number[this.done[Math.min(step, this.steps)]] + (this.lays(step) ? 1 : 0); }

  // When the toolpath of a number from 0 on begins.
  beginOf(number) { return this.begin(this.stepOf[this.place[Math.max(0, Math.min(this.toolpaths - 1, number))]]); }

  begin(step) { return step > 0 ? this.end[step - 1] : 0; }

  stepOfLine(line) {
    if (!line) return -1;
    return Math.min(this.steps - 1, Math.max(0, upTo(this.line, line - 1)));
  }

  // The step under way at a time, how much of it is over, and where the nozzle is.
  at(time) {
    const step = upTo(this.end, time);
    if (step >= this.steps) {
      return { step: this.steps, part: 0, x: this.x[this.steps - 1] || 0, y: this.y[this.steps - 1] || 0 };
    }
    const begin = this.begin(step), part = (time - begin) / Math.max(this.end[step] - begin, 1e-12);
    const from = Math.max(step - 1, 0), jumps = this.kind[step] === JUMP;
    return {
      step, part,
      x: jumps ? this.x[from] : this.x[from] + part * (this.x[step] - this.x[from]),
      y: jumps ? this.y[from] : this.y[from] + part * (this.y[step] - this.y[from]),
    };
  }

  value(sums, { step, part }) {
    if (step >= this.steps) return sums[this.steps];
    return sums[step] + part * (sums[step + 1] - sums[step]);
  }

  lengthAt(time) { return this.value(this.printed, this.at(time)); }

  volumeAt({ step, part }) {
    const before = step > 0 ? this.volume[step - 1] : 0;
    return step >= this.steps ? before : before + part * (this.volume[step] - before);
  }

  // The earliest time at which so much has been printed.
  timeOfLength(length) {
    const sums = this.printed;
    if (length >= sums[this.steps]) return this.steps ? this.end[Math.max(0, this.stepOf[this.n - 1] ?? 0)] : 0;
    const step = Math.max(0, upTo(sums, length) - 1), grows = sums[step + 1] - sums[step];
    return this.begin(step) + (grows > 0 ? (length - sums[step]) / grows : 0) * (this.end[step] - this.begin(step));
  }
}
