// The scrubber, with a mark for each finding of the check, and the list of them.

const LISTED = 200;

class Timeline {
  constructor(root, panes, jump) {
    this.slider = root.querySelector("#scrubber");
    this.marks = root.querySelector("#marks");
    this.list = root.querySelector("#findings ol");
    this.head = root.querySelector("#findings summary");
    this.box = root.querySelector("#findings");
    this.panes = panes; this.jump = jump;
    new ResizeObserver(() => this.paint()).observe(this.marks);
    this.marks.addEventListener("click", (event) => {
      const { left, width } = this.marks.getBoundingClientRect();
      const wanted = (event.clientX - left) / width * this.total;
      const near = this.stops.reduce((best, stop) => Math.abs(stop.time - wanted) < Math.abs(best.time - wanted) ? stop : best, { time: Infinity });
      this.jump(Math.abs(near.time - wanted) < this.total * 8 / width ? near.time : wanted);
    });
  }

  // stops: {time, text, fault} in order of time; total: the length of the scrubber, both in its unit.
  load(stops, total, inAll) {
    this.stops = stops; this.total = Math.max(total, 1e-9);
    this.slider.max = this.total; // as exact as times are
    this.box.hidden = inAll === 0;
    const count = inAll === 1 ? "1 finding" : `${inAll} findings`;
    this.head.textContent = `${count} of the check` + (inAll > Math.min(LISTED, stops.length) ? `, the first ${Math.min(LISTED, stops.length)} here` : "");
    this.list.replaceChildren(...stops.slice(0, LISTED).map((stop) => {
      const item = document.createElement("li"), button = document.createElement("button");
      button.type = "button";
      button.textContent = stop.text;
      button.addEventListener("click", () => this.jump(stop.time));
      item.append(button);
      return item;
    }));
    this.paint();
  }

  paint() {
    const { clientWidth: width, clientHeight: height } = this.marks, ratio = Math.min(2, devicePixelRatio || 1);
    if (!width || !this.stops) return;
    this.marks.width = width * ratio; this.marks.height = height * ratio;
    const ctx = this.marks.getContext("2d");
    ctx.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--fault");
    for (const stop of this.stops) ctx.fillRect(Math.min(width - 2, stop.time / this.total * width) * ratio, 0, 2 * ratio, height * ratio);
  }

  // The stop after, or before, a time; null where there is none.
  next(time, back) {
    const eps = 1e-6;
    return back ? this.stops.findLast((stop) => stop.time < time - eps) ?? null : this.stops.find((stop) => stop.time > time + eps) ?? null;
  }
}
