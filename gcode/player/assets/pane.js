// One program on the page: its picture, its figures, and what fingers and mice do to it.

const STANDING = ["travelling", "printing", "filling the nozzle", "standing", "on its way, not followed"];

// Three digits, and what is less than a nanolitre as none.
const volumeWords = (ul) => `${ul >= 100 ? ul.toFixed(0) : ul < 0.1 ? ul.toFixed(3) : ul.toPrecision(3)} µL`;

class Pane {
  constructor(root, options, told) {
    this.root = root; this.options = options; this.told = told;
    this.view = new View();
    this.stage = root.querySelector(".stage");
    [this.canvas, this.labels, this.top] = root.querySelectorAll("canvas");
    this.painter = (options.plain ? null : GlPainter.open(this.canvas, options.webgl)) || new PlainPainter(this.canvas);
    this.painter.onrestored = () => { this.stale = true; this.told.redraw(); };
    this.figures = Object.fromEntries([...root.querySelectorAll("[data-figure]")].map((node) => [node.dataset.figure, node]));
    this.pointers = new Map();
    this.stale = true;
    this.time = 0;
    this.listen();
    new ResizeObserver(() => this.resize()).observe(this.stage);
  }

  show(track) {
    this.track = track;
    this.nozzle = track.header.nozzle;
    this.shapes = new Shapes(track);
    this.strips = new Strips(track);
    this.bytes = coloursOf(track, this.shapes.steps, this.options.colour, this.options);
    this.painter.load(this.shapes, this.bytes);
    this.root.querySelector("h2").textContent = track.name;
    this.root.querySelector(".body").hidden = !this.nozzle;
    this.root.querySelector(".joins").hidden = track.toolpaths === track.n;
    this.fit();
  }

  // Width of the bead of a step in the plane of the sheet, in mm.
  width(step) {
    const track = this.track;
    return track.n ? track.height[Math.min(track.done[step], track.n - 1)] : 0.4;
  }

  colourOf(step) {
    const i = 4 * this.shapes.before[step];
    return `rgb(${this.bytes[i]} ${this.bytes[i + 1]} ${this.bytes[i + 2]})`;
  }

  recolour() {
    const choice = COLOURS[this.options.colour].possible?.(this.track) === false ? "order" : this.options.colour;
    this.bytes = coloursOf(this.track, this.shapes.steps, choice, this.options);
    this.painter.recolour(this.bytes);
    this.stale = true;
  }

  fit() { this.view.fit(this.track.box); this.fitted = true; this.stale = true; this.told.redraw(); }

  zoom(factor, x, y) { this.view.zoom(factor, x, y); this.fitted = false; this.stale = true; this.told.redraw(); }

  pan(dx, dy) { this.view.pan(dx, dy); this.fitted = false; this.stale = true; this.told.redraw(); }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width || !height) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.view.width = width; this.view.height = height;
    for (const canvas of [this.canvas, this.labels, this.top]) { canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); }
    for (const canvas of [this.labels, this.top]) canvas.getContext("2d").setTransform(canvas.width / width, 0, 0, canvas.height / height, 0, 0);
    if (this.fitted !== false && this.track) this.fit();
    this.stale = true;
    this.told.redraw();
  }

  // Show the moment; the print is drawn anew only where it shrank or the view changed, and in several frames where it
  // is large: `whole` says whether all of it is there.
  draw(time, style) {
    if (!this.track || this.view.width <= 1) return;
    const { track } = this, at = track.at(time);
    this.time = time;
    const drawn = this.shapes.before[at.step], freed = style.free ? upTo(this.shapes.free.at, track.done[at.step]) : 0;
    this.whole = this.painter.draw(this.view, { drawn, freed }, style, this.stale);
    if (this.stale) this.labelled = drawLabels(this.labels.getContext("2d"), this, style.colours);
    this.stale = false;
    if (!this.whole) this.told.redraw();
    this.pressed = drawMoment(this.top.getContext("2d"), this, at, style.colours);
    this.at = at;
  }

  get toolpath() {
    return this.at ? this.track.numberAt(this.at.step) : 0;
  }

  tell() {
    const { track, at, figures, nozzle } = this;
    if (!at) return;
    const last = Math.min(at.step, track.steps - 1), kind = track.kind[last];
    const put = (name, text) => { if (figures[name] && figures[name].textContent !== text) figures[name].textContent = text; };
    put("toolpath", `${this.toolpath} of ${track.toolpaths}`);
    put("line", track.steps ? String(track.line[last]) : "");
    put("time", `${clock(this.time)} of ${clock(track.total)}`);
    put("doing", at.step >= track.steps ? "finished" : kind === TOOLPATH && !track.lays(last) ? "going on to the next toolpath" : STANDING[kind]);
    put("printed", `${track.value(track.printed, at).toFixed(1)} mm`);
    put("joins", `${track.done[Math.min(at.step, track.steps)] - track.number[track.done[Math.min(at.step, track.steps)]]}, ${track.value(track.joined, at).toFixed(1)} mm`);
    put("travel", `${track.value(track.travelled, at).toFixed(1)} mm`);
    put("material", volumeWords(track.volumeAt(at)));
    put("place", `${at.x.toFixed(2)}, ${at.y.toFixed(2)} mm`);
    const allowed = nozzle?.press_mm;
    put("body", nozzle
      ? `${this.pressed.depth.toFixed(2)} mm deep, ${this.pressed.toolpaths.length} ${this.pressed.toolpaths.length === 1 ? "line" : "lines"}${allowed === null ? "" : `; ${allowed} mm allowed`}`
      : "a point");
  }

  summary() {
    const track = this.track;
    return `${track.name}: toolpath ${this.toolpath} of ${track.toolpaths}, ${clock(this.time)} of ${clock(track.total)}, ` +
      `G-code line ${track.line[Math.min(this.at.step, track.steps - 1)] ?? 0}`;
  }

  // The toolpath nearest to a place of the picture, at most `reach` pixels away; -1 for none.
  pick(px, py, reach = 10) {
    const [x, y] = this.view.mm(px, py), r = reach / this.view.scale;
    let best = -1, nearest = r;
    this.strips.near([x - r, y - r, x + r, y + r], this.track.n, (k, x0, y0, x1, y1) => {
      const dx = x1 - x0, dy = y1 - y0, part = Math.max(0, Math.min(1, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy || 1)));
      const distance = Math.hypot(x0 + part * dx - x, y0 + part * dy - y);
      if (distance < nearest) { nearest = distance; best = k; }
    });
    return best;
  }

  listen() {
    const stage = this.stage, where = (event) => {
      const box = stage.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    stage.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...where(event));
    }, { passive: false });
    stage.addEventListener("pointerdown", (event) => {
      stage.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, where(event));
      if (this.pointers.size === 1) this.moved = 0;
    });
    stage.addEventListener("pointermove", (event) => {
      const before = this.pointers.get(event.pointerId);
      if (!before) return;
      const now = where(event);
      if (this.pointers.size === 1) {
        this.moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
        if (this.moved > 4) this.pan(now[0] - before[0], now[1] - before[1]);
      } else {
        this.moved = Infinity;
        const [id] = [...this.pointers.keys()].filter((key) => key !== event.pointerId), other = this.pointers.get(id);
        const apart = (p) => Math.max(8, Math.hypot(p[0] - other[0], p[1] - other[1]));
        this.zoom(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
        this.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
      }
      this.pointers.set(event.pointerId, now);
    });
    const end = (event) => {
      if (!this.pointers.delete(event.pointerId) || this.pointers.size || event.type === "pointercancel" || this.moved > 4) return;
      const k = this.pick(...where(event), event.pointerType === "touch" ? 18 : 10);
      if (k >= 0) this.told.picked(this, k);
    };
    stage.addEventListener("pointerup", end);
    stage.addEventListener("pointercancel", end);
    stage.addEventListener("dblclick", () => this.fit());
  }
}
