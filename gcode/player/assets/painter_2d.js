// The same pictures where there is no WebGL2: slower with many toolpaths, and no worse to look at.

class PlainPainter {
  constructor(canvas) { this.canvas = canvas; this.ctx = canvas.getContext("2d", { alpha: false }); this.drawn = 0; this.freed = 0; }

  load(origin, shapes, colours, free) {
    this.origin = origin; this.shapes = shapes; this.free = free;
    this.count = shapes.length / 5;
    this.recolour(colours);
  }

  recolour(colours) { this.colours = colours; }

  // Neighbours of one colour and width are one path: many short paths are slow.
  range(shapes, from, to, override, travels) {
    const { ctx, view, colours } = this;
    const [ox, oy] = this.origin;
    let style = "", width = -1;
    ctx.lineCap = "round";
    for (let i = from; i < to; i++) {
      const half = shapes[5 * i + 4];
      if (half < 0 && !travels) continue;
      const own = override || `rgb(${colours[4 * i]} ${colours[4 * i + 1]} ${colours[4 * i + 2]})`;
      const wide = half < 0 ? 1 : Math.max(1, 2 * half * view.scale);
      if (own !== style || wide !== width) {
        if (width > 0) ctx.stroke();
        ctx.beginPath();
        ctx.strokeStyle = style = own;
        ctx.lineWidth = width = wide;
      }
      ctx.moveTo(...view.px(shapes[5 * i] + ox, shapes[5 * i + 1] + oy));
      ctx.lineTo(...view.px(shapes[5 * i + 2] + ox, shapes[5 * i + 3] + oy));
    }
    if (width > 0) ctx.stroke();
  }

  frame(view) {
    const ratio = this.canvas.width / view.width;
    this.view = view;
    this.ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  redraw(view, drawn, freed, style) {
    this.frame(view);
    this.ctx.fillStyle = css(style.ground);
    this.ctx.fillRect(0, 0, view.width, view.height);
    if (style.ghosts) this.range(this.shapes, drawn, this.count, css(style.ghost), false);
    if (style.free) this.range(this.free, 0, freed, css(style.free), false);
    this.range(this.shapes, 0, drawn, null, style.travels);
    this.drawn = drawn; this.freed = freed;
  }

  advance(view, drawn, freed, style) {
    this.frame(view);
    if (style.free) this.range(this.free, this.freed, freed, css(style.free), false);
    this.range(this.shapes, this.drawn, drawn, null, style.travels);
    this.drawn = drawn; this.freed = freed;
  }
}

const css = ([r, g, b]) => `rgb(${Math.round(255 * r)} ${Math.round(255 * g)} ${Math.round(255 * b)})`;
