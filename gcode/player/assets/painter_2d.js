// The same pictures without WebGL, or where the browser would only pretend to have it: drawn by a processor, this
// takes half the work, and is no worse to look at.

const SLICE = 24_000; // beads drawn in a frame: more would hold up what the user does
const RIM_FROM_PX = 4, CORE = 0.62; // so wide beads have a rim, and their middle is so much of them

class PlainPainter {
  constructor(canvas) {
    this.canvas = canvas; this.ctx = canvas.getContext("2d", { alpha: false });
    this.back = document.createElement("canvas");
    this.behind = this.back.getContext("2d", { alpha: false });
    this.shown = null; this.job = null; this.asked = false;
  }

  load(shapes, colours) {
    this.shapes = shapes;
    this.count = shapes.all.length / 5;
    this.widest = shapes.track.height.reduce((most, height) => Math.max(most, height), 0.4);
    this.shown = this.job = null;
    this.recolour(colours);
  }

  recolour(colours) { this.tints = new Uint32Array(colours.buffer); this.asked = true; }

  // Bring the picture on towards what is wanted, a slice of it; whether that is all. What must be drawn anew
  // grows behind the picture that is shown, which is moved meanwhile as the view was.
  draw(view, want, style, stale) {
    this.asked ||= stale;
    const size = this.job || this.shown;
    if (size && (size.width !== this.canvas.width || size.height !== this.canvas.height)) { this.shown = this.job = null; }
    if (!this.job && (this.asked || !this.shown || want.drawn < this.shown.drawn)) this.begin(view, want, style);
    const { job, shown } = this;
    if (!job) {
      this.advance(this.ctx, shown, want, SLICE);
    } else if (this.advance(job.ctx, job, job.want, SLICE)) {
      if (job.ctx === this.behind) {
        this.ctx.setTransform(1, 0, 0, 1, 0, 0);
        this.ctx.drawImage(this.back, 0, 0);
        this.frame(this.ctx, job.view);
      }
      this.shown = job; this.job = null;
    }
    this.place(view);
    return !this.job && !this.asked && this.shown.drawn === want.drawn && this.shown.freed === want.freed;
  }

  begin(view, want, style) {
    const { width, height } = this.canvas;
    // Where nothing is shown, or its size is another, all can see it grow.
    const ctx = this.shown ? this.behind : this.ctx;
    if (ctx === this.behind) { this.back.width = width; this.back.height = height; }
    this.asked = false;
    this.job = { view: Object.assign(new View(), view), want, style, ctx, width, height, drawn: 0, freed: 0, ghost: style.ghosts ? want.drawn : this.count };
    this.frame(ctx, this.job.view);
    ctx.fillStyle = css(style.ground);
    ctx.fillRect(0, 0, view.width, view.height);
  }

  // What is shown was drawn in an older view: where that lies in this one.
  place(view) {
    const old = this.shown && !(this.job && this.job.ctx === this.ctx) ? this.shown.view : view;
    const [x, y] = view.px(old.cx, old.cy), factor = view.scale / old.scale;
    const moved = old.cx === view.cx && old.cy === view.cy && factor === 1 ? "" : `translate(${x - view.width / 2}px, ${y - view.height / 2}px) scale(${factor})`;
    if (this.canvas.style.transform !== moved) this.canvas.style.transform = moved;
  }

  frame(ctx, view) {
    const ratio = this.canvas.width / view.width;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.lineCap = "round";
    ctx.tint = ctx.wide = null; // what strokes have been set to: asking the canvas itself takes longer
  }

  // Ghosts, then what can be next, then what is printed, at most `room` of all; whether all of it is there.
  advance(ctx, at, want, room) {
    const { style, view } = at;
    if (at.ghost < this.count) {
      const to = Math.min(this.count, at.ghost + 4 * room); // in one colour: quicker
      this.even(ctx, view, this.shapes.all, at.ghost, to, css(style.ghost));
      room -= (to - at.ghost) >> 2; at.ghost = to;
      if (at.ghost < this.count) return false;
    }
    if (style.free && at.freed < want.freed) this.even(ctx, view, this.shapes.free.shapes, at.freed, want.freed, css(style.free));
    at.freed = want.freed;
    const to = Math.min(want.drawn, at.drawn + Math.max(0, room));
    this.each(ctx, view, at.drawn, to, style.travels);
    at.drawn = to;
    return to === want.drawn;
  }

  // Where the middle of the sheet is in a view, and which coordinates about it are off the picture, `wide` apart.
  seen(view, wide) {
    const [mx, my] = this.shapes.middle, { scale } = view;
    const x = view.width / 2 + (mx - view.cx) * scale, y = view.height / 2 - (my - view.cy) * scale;
    return { x, y, left: (-wide - x) / scale, right: (view.width + wide - x) / scale, low: (y - view.height - wide) / scale, high: (y + wide) / scale };
  }

  // Beads of one colour: neighbours of one width are one path, since many short paths are slow.
  even(ctx, view, shapes, from, to, colour) {
    const { scale } = view, { x, y, left, right, low, high } = this.seen(view, this.widest * scale);
    let width = -1;
    ctx.tint = ctx.wide = null;
    ctx.strokeStyle = colour;
    for (let p = 5 * from; p < 5 * to; p += 5) {
      const half = shapes[p + 4], x0 = shapes[p], y0 = shapes[p + 1], x1 = shapes[p + 2], y1 = shapes[p + 3];
      if (half < 0 || (x0 < left && x1 < left) || (x0 > right && x1 > right) || (y0 < low && y1 < low) || (y0 > high && y1 > high)) continue;
      const wide = Math.max(1, 2 * half * scale);
      if (wide !== width) {
        if (width > 0) ctx.stroke();
        ctx.beginPath();
        ctx.lineWidth = width = wide;
      }
      ctx.moveTo(x + x0 * scale, y - y0 * scale);
      ctx.lineTo(x + x1 * scale, y - y1 * scale);
    }
    if (width > 0) ctx.stroke();
  }

  // What is printed, each by itself, so that it looks the same whenever it was drawn. Wide beads have a darker rim.
  each(ctx, view, from, to, travels) {
    const { scale } = view, shapes = this.shapes.all, { tints } = this;
    const { x, y, left, right, low, high } = this.seen(view, this.widest * scale);
    for (let i = from, p = 5 * from; i < to; i++, p += 5) {
      const half = shapes[p + 4], x0 = shapes[p], y0 = shapes[p + 1], x1 = shapes[p + 2], y1 = shapes[p + 3];
      if ((half < 0 && !travels) || (x0 < left && x1 < left) || (x0 > right && x1 > right) || (y0 < low && y1 < low) || (y0 > high && y1 > high)) continue;
      const wide = half < 0 ? 1 : Math.max(1, 2 * half * scale);
      ctx.beginPath();
      ctx.moveTo(x + x0 * scale, y - y0 * scale);
      ctx.lineTo(x + x1 * scale, y - y1 * scale);
      if (wide > RIM_FROM_PX) this.stroke(ctx, tintOf(tints[i], 1), wide);
      this.stroke(ctx, tintOf(tints[i], 0), wide > RIM_FROM_PX ? wide * CORE : wide);
    }
  }

  stroke(ctx, colour, width) {
    if (ctx.tint !== colour) ctx.strokeStyle = ctx.tint = colour;
    if (ctx.wide !== width) ctx.lineWidth = ctx.wide = width;
    ctx.stroke();
  }
}

const css = ([r, g, b]) => `rgb(${Math.round(255 * r)} ${Math.round(255 * g)} ${Math.round(255 * b)})`;

const tintNames = [new Map(), new Map()];

// The words for four bytes r, g, b, a read as one number; or, of a rim, for a darker shade of it.
function tintOf(tint, rim) {
  let words = tintNames[rim].get(tint);
  if (!words) {
    const part = rim ? 0.74 : 1, [r, g, b] = new Uint8Array(Uint32Array.of(tint).buffer);
    tintNames[rim].set(tint, words = `rgb(${Math.round(part * r)} ${Math.round(part * g)} ${Math.round(part * b)})`);
  }
  return words;
}
