// From millimetres of the sheet to pixels of a picture, y up, and back.

class View {
  constructor() { this.cx = 0; this.cy = 0; this.scale = 1; this.width = 1; this.height = 1; }

  px(x, y) { return [this.width / 2 + (x - this.cx) * this.scale, this.height / 2 - (y - this.cy) * this.scale]; }

  mm(px, py) { return [this.cx + (px - this.width / 2) / this.scale, this.cy - (py - this.height / 2) / this.scale]; }

  // All of a box [x0, y0, x1, y1], with room above it for the nozzle.
  fit([x0, y0, x1, y1]) {
    const w = Math.max(x1 - x0, 1e-3), h = Math.max(y1 - y0, 1e-3);
    this.scale = Math.min((this.width - 24) / w, (this.height - 56) / h);
    if (!(this.scale > 0)) this.scale = 1;
    this.cx = (x0 + x1) / 2;
    this.cy = (y0 + y1) / 2 + 10 / this.scale;
  }

  // The point under (px, py) stays where it is.
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.mm(px, py);
    this.scale = Math.min(1e5, Math.max(1e-2, this.scale * factor));
    this.cx = x - (px - this.width / 2) / this.scale;
    this.cy = y + (py - this.height / 2) / this.scale;
  }

  pan(dx, dy) { this.cx -= dx / this.scale; this.cy += dy / this.scale; }

  // [x0, y0, x1, y1] that is seen.
  get box() {
    const [x0, y0] = this.mm(0, this.height), [x1, y1] = this.mm(this.width, 0);
    return [x0, y0, x1, y1];
  }
}
