// What a program draws, as flat arrays for a painter. Loops over numbers alone: there may be 100,000 toolpaths.

// In the order of printing, five numbers for each step that draws anything: both ends in mm from the middle of the
// sheet, and half the width of its bead; negative: a travel.
class Shapes {
  constructor(track) {
    const { steps, kind, x, y, height, done, n } = track;
    this.before = new Int32Array(steps + 1); // how much is drawn before each step
    for (let s = 0, i = 0; s < steps; s++) { if (s > 0 && kind[s] <= PRIME) i++; this.before[s + 1] = i; }
    const count = this.before[steps];
    this.middle = [(track.box[0] + track.box[2]) / 2, (track.box[1] + track.box[3]) / 2];
    this.steps = new Int32Array(count);
    this.all = new Float32Array(5 * count);
    const [mx, my] = this.middle, { all } = this;
    for (let s = 1, i = 0; s < steps; s++) {
      if (kind[s] > PRIME) continue;
      this.steps[i++] = s;
      const p = 5 * i - 5;
      all[p] = x[s - 1] - mx; all[p + 1] = y[s - 1] - my;
      all[p + 2] = x[s] - mx; all[p + 3] = y[s] - my;
      all[p + 4] = kind[s] === TRAVEL ? -1 : (n ? height[Math.min(done[s], n - 1)] : 0.4) / 2;
    }
    this.track = track;
  }

  // The same of what is laid, in the order in which it can be, and how much must be laid before each: made when it
  // is first asked for.
  get free() {
    if (!this.made) {
      const { after, stepOf, n } = this.track, place = new Int32Array(n + 2);
      for (let k = 0; k < n; k++) place[after[k] + 1]++;
      for (let a = 0; a <= n; a++) place[a + 1] += place[a];
      const at = new Int32Array(n), shapes = new Float32Array(5 * n);
      for (let k = 0; k < n; k++) {
        const i = place[after[k]]++, from = 5 * this.before[stepOf[k]];
        at[i] = after[k];
        for (let c = 0; c < 5; c++) shapes[5 * i + c] = this.all[from + c];
      }
      this.made = { at, shapes };
    }
    return this.made;
  }
}
