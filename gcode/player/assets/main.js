// Puts the page together: one clock, one or two programs, keys and buttons.

const SPEEDS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const $ = (selector) => document.querySelector(selector);

class Player {
  constructor(told) {
    this.told = told;
    this.nozzle = { halfWidth, hindering, outline, depthInside };
    this.options = { colour: "order", travels: true, ghosts: true, next: false, labels: true, nozzle: true, hanging: false, faults: true, plain: location.hash.includes("plain"), webgl: location.hash.includes("webgl") };
    this.time = 0; this.playing = false; this.speed = 1; this.by = "time";
    this.frames = 0; this.dirty = true; this.told_at = 0;
  }

  async start() {
    this.tracks = [];
    for (let k = 0; k < this.told.tracks.length; k++) {
      const node = $(`#data-${k}`);
      this.tracks.push(new Track(this.told.tracks[k], await inflate(node.textContent)));
      node.remove();
    }
    const both = this.tracks.length > 1;
    document.body.classList.toggle("two", both);
    const mould = $("#pane"), hall = $("#panes");
    const shown = both ? [0, this.tracks.length - 1] : [0];
    this.panes = shown.map((which, k) => {
      hall.append(mould.content.cloneNode(true));
      const root = hall.lastElementChild;
      const pane = new Pane(root, this.options, { redraw: () => this.redraw(), picked: (at, n) => this.picked(at, n) });
      this.chooser(root, pane, which);
      return pane;
    });
    this.timeline = new Timeline(document, this.panes, (time) => this.seek(time));
    this.panes.forEach((pane, k) => { pane.resize(); pane.show(this.tracks[shown[k]]); });
    $("#by").hidden = !both;
    $("[data-option=nozzle]").closest("label").hidden = false;
    for (const option of $("#colour").options) option.hidden = !this.tracks.some((t) => COLOURS[option.value].possible?.(t) ?? true);
    this.changed();
    this.speed = SPEEDS.reduce((best, s) => Math.abs(Math.log(this.total / s / 60)) < Math.abs(Math.log(this.total / best / 60)) ? s : best, 1);
    $("#speed").value = String(this.speed);
    this.listen();
    this.style();
    if (this.told.live) this.live = new Live(document, (line) => this.followed(line));
    document.body.dataset.ready = "yes";
    this.redraw();
    this.announce();
  }

  // Where there are more than two programs, any two of them can be looked at.
  chooser(root, pane, k) {
    const choice = root.querySelector("select");
    choice.hidden = this.tracks.length < 3;
    choice.append(...this.tracks.map((track, i) => new Option(track.name, String(i), i === k, i === k)));
    choice.addEventListener("change", () => { pane.show(this.tracks[+choice.value]); pane.recolour(); this.changed(); this.redraw(); });
  }

  // The clock runs in the time of the first program where both are in step by length, else in that of the longer.
  get total() {
    return this.by === "length" ? this.panes[0].track.total : Math.max(...this.panes.map((pane) => pane.track.total));
  }

  timeOf(pane, time = this.time) {
    if (this.by === "length" && pane !== this.panes[0]) {
      const first = this.panes[0].track;
      return time >= first.total ? pane.track.total : pane.track.timeOfLength(first.lengthAt(time));
    }
    return Math.min(time, pane.track.total);
  }

  // The time of the clock at which a program is at a time of its own.
  clockOf(pane, time) {
    return this.by === "length" && pane !== this.panes[0] ? this.panes[0].track.timeOfLength(pane.track.lengthAt(time)) : time;
  }

  changed() {
    const stops = [];
    let inAll = 0;
    for (const pane of this.panes) {
      inAll += pane.track.header.findings_in_all;
      for (const found of pane.track.findings) {
        const where = found.line ? `line ${found.line}: ` : "";
        const time = found.step < 0 ? 0 : this.clockOf(pane, pane.track.begin(found.step));
        stops.push({ time, text: `${this.panes.length > 1 ? `${pane.track.name}, ` : ""}${where}${found.kind}: ${found.message}` });
      }
    }
    stops.sort((a, b) => a.time - b.time);
    this.timeline.load(stops, this.total, inAll);
    for (const id of ["#fault-back", "#fault-next"]) $(id).hidden = !stops.length;
    $("#verdict").textContent = this.verdict();
    const [low, high] = COLOURS[this.options.colour].legend(this.panes[0].track);
    $("#low").textContent = low; $("#high").textContent = high;
    $("#ramp").className = COLOURS[this.options.colour].hues ? "hues" : high ? "ramp" : "none";
    this.seek(Math.min(this.time, this.total));
  }

  verdict() {
    if (this.panes.length < 2) return "";
    const [a, b] = this.panes.map((pane) => pane.track), difference = b.total - a.total;
    if (Math.abs(difference) < 0.05) return `${a.name} and ${b.name} take the same time, ${clock(a.total)}.`;
    const [slow, quick] = difference > 0 ? [b, a] : [a, b];
    const by = Math.abs(difference), words = by < 100 ? `${by.toFixed(1)} s` : clock(by);
    return `${slow.name} needs ${words} longer than ${quick.name} (${(100 * by / quick.total).toFixed(0)} %): ` +
      `its travel is ${slow.travelled.at(-1).toFixed(1)} mm, that of the other ${quick.travelled.at(-1).toFixed(1)} mm.`;
  }

  seek(time) {
    this.time = Math.max(0, Math.min(this.total, time));
    this.redraw();
    if (!this.playing) this.announce();
  }

  picked(pane, k) {
    this.pause();
    this.seek(this.clockOf(pane, pane.track.begin(pane.track.stepOf[k])) + 1e-6);
  }

  // To the begin of a toolpath, so many away from the one under way or last laid.
  step(count) {
    this.pause();
    const pane = this.panes[0], track = pane.track;
    if (!track.toolpaths) return;
    const { step, part } = track.at(this.timeOf(pane)), laying = track.lays(step), next = track.numberAt(step) - (laying ? 1 : 0);
    const wanted = count > 0 ? next + count - (laying ? 0 : 1) : next + count + (laying && part > 0.002 ? 1 : 0);
    if (wanted >= track.toolpaths) return this.seek(this.total);
    this.seek(this.clockOf(pane, track.beginOf(wanted)) + 1e-6);
  }

  goTo(text) {
    const pane = this.panes[0], track = pane.track, line = /^l/i.test(text), number = parseInt(text.replace(/\D/g, ""), 10);
    if (!number) return;
    this.pause();
    const time = line ? track.begin(track.stepOfLine(number)) : track.beginOf(number - 1);
    this.seek(this.clockOf(pane, time) + 1e-6);
  }

  followed(line) {
    const track = this.panes[0].track;
    if (line > 0) this.seek(track.begin(Math.min(track.steps, upTo(track.line, line))));
  }

  play() {
    if (this.time >= this.total) this.time = 0;
    this.playing = true; this.last = 0;
    if (this.live) this.live.following.checked = false;
    this.pressed();
    const run = this.run = {}; // of two runs, as after a quick pause, the older ends
    requestAnimationFrame((now) => this.frame(now, run));
  }

  pause() { if (this.playing) { this.playing = false; this.pressed(); this.redraw(); this.announce(); } }

  pressed() {
    const button = $("#play");
    button.textContent = this.playing ? "❚❚" : "▶";
    button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  frame(now, run) {
    if (!this.playing || run !== this.run) return;
    if (this.last) this.time = Math.min(this.total, this.time + (now - this.last) / 1000 * this.speed);
    this.last = now;
    this.paint(now);
    if (this.time >= this.total) return this.pause();
    requestAnimationFrame((next) => this.frame(next, run));
  }

  redraw() {
    if (this.playing || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => { this.waiting = false; this.told_at = -Infinity; this.paint(now); });
  }

  paint(now) {
    if (!this.look) return;
    this.frames++;
    for (const pane of this.panes) pane.draw(this.timeOf(pane), this.look);
    if (now - this.told_at < 100) return; // text costs more than the picture
    this.told_at = now;
    for (const pane of this.panes) pane.tell();
    const slider = this.timeline.slider;
    slider.value = String(this.time);
    slider.setAttribute("aria-valuetext", `${clock(this.time)} of ${clock(this.total)}, toolpath ${this.panes[0].toolpath} of ${this.panes[0].track.toolpaths}`);
    $("#clock").textContent = `${clock(this.time)} / ${clock(this.total)}`;
  }

  // Whether all that was asked for is drawn.
  get whole() { return !this.waiting && this.panes.every((pane) => pane.whole && !pane.stale); }

  // For screen readers, when something has come to rest and not with every frame.
  announce() {
    clearTimeout(this.saying);
    this.saying = setTimeout(() => { if (!this.playing && this.panes.every((p) => p.at)) $("#said").textContent = this.panes.map((p) => p.summary()).join(". "); }, 300);
  }

  style() {
    const read = getComputedStyle(document.documentElement), of = (name) => read.getPropertyValue(name).trim();
    const part = (name) => { const hex = of(name); return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255); };
    const { ghosts, next, travels } = this.options;
    this.look = {
      ground: part("--ground"), ghost: [...part("--ghost"), 1], ghosts: ghosts || next, free: next ? [...part("--free"), 1] : null, travels,
      colours: Object.fromEntries(["ink", "halo", "line", "travel", "nozzle", "fault"].map((name) => [name, of(`--${name}`)])),
    };
    for (const pane of this.panes) pane.stale = true;
    this.timeline.paint();
    this.redraw();
  }

  theme() {
    const dark = document.documentElement.dataset.theme ? document.documentElement.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    document.documentElement.dataset.theme = dark ? "light" : "dark";
    this.style();
  }

  fault(back) {
    const stop = this.timeline.next(this.time, back);
    if (stop) { this.pause(); this.seek(stop.time); }
  }

  faster(by) {
    const k = SPEEDS.indexOf(this.speed) + by;
    if (SPEEDS[k]) { this.speed = SPEEDS[k]; $("#speed").value = String(this.speed); }
  }

  each(what) { for (const pane of this.panes) what(pane); }

  listen() {
    const click = (id, what) => $(id).addEventListener("click", what);
    click("#play", () => this.playing ? this.pause() : this.play());
    click("#first", () => { this.pause(); this.seek(0); });
    click("#last", () => { this.pause(); this.seek(this.total); });
    click("#back", () => this.step(-1));
    click("#forth", () => this.step(1));
    click("#fit", () => this.each((pane) => pane.fit()));
    click("#in", () => this.each((pane) => pane.zoom(1.4)));
    click("#out", () => this.each((pane) => pane.zoom(1 / 1.4)));
    click("#theme", () => this.theme());
    click("#help", () => $("#keys").showModal());
    click("#fault-back", () => this.fault(true));
    click("#fault-next", () => this.fault(false));
    $("#speed").addEventListener("change", (event) => { this.speed = +event.target.value; });
    $("#scrubber").addEventListener("input", (event) => { this.pause(); this.seek(+event.target.value); });
    $("#goto").addEventListener("submit", (event) => { event.preventDefault(); this.goTo($("#number").value); });
    $("#colour").addEventListener("change", (event) => { this.options.colour = event.target.value; this.each((pane) => pane.recolour()); this.changed(); });
    $("#by").querySelector("select").addEventListener("change", (event) => {
      const time = this.timeOf(this.panes[0]);
      this.by = event.target.value; this.time = time; this.changed();
    });
    for (const box of document.querySelectorAll("[data-option]")) {
      box.checked = this.options[box.dataset.option];
      box.addEventListener("change", () => {
        this.options[box.dataset.option] = box.checked;
        if (box.dataset.option === "hanging" || box.dataset.option === "faults") this.each((pane) => pane.recolour());
        this.style();
      });
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.style());
    document.addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => { if (this.live) location.reload(); });
  }

  key(event) {
    const node = event.target, typing = /^(SELECT|TEXTAREA)$/.test(node.tagName) || (node.tagName === "INPUT" && node.type === "text");
    if (typing || event.ctrlKey || event.metaKey || event.altKey || $("#keys").open) return;
    if (event.key === " " && /^(BUTTON|SUMMARY)$/.test(node.tagName) || event.key === " " && node.type === "checkbox") return;
    const far = 40, pan = (dx, dy) => this.each((pane) => pane.pan(dx, dy));
    const keys = {
      " ": () => this.playing ? this.pause() : this.play(),
      k: () => this.playing ? this.pause() : this.play(),
      ArrowRight: () => event.shiftKey ? pan(-far, 0) : this.step(1),
      ArrowLeft: () => event.shiftKey ? pan(far, 0) : this.step(-1),
      ArrowUp: () => event.shiftKey ? pan(0, far) : this.faster(1),
      ArrowDown: () => event.shiftKey ? pan(0, -far) : this.faster(-1),
      PageDown: () => this.step(10),
      PageUp: () => this.step(-10),
      Home: () => { this.pause(); this.seek(0); },
      End: () => { this.pause(); this.seek(this.total); },
      "+": () => this.each((pane) => pane.zoom(1.4)),
      "=": () => this.each((pane) => pane.zoom(1.4)),
      "-": () => this.each((pane) => pane.zoom(1 / 1.4)),
      f: () => this.each((pane) => pane.fit()),
      0: () => this.each((pane) => pane.fit()),
      v: () => this.fault(false),
      V: () => this.fault(true),
      d: () => this.theme(),
      g: () => $("#number").focus(),
      "?": () => $("#keys").showModal(),
    };
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  }
}

const player = new Player(JSON.parse($("#header").textContent));
window.player = player; // for whoever looks from the console, as the tests do
player.start().catch((error) => {
  $("#broken").hidden = false;
  $("#broken").textContent = `This page cannot be shown here: ${error.message}. It needs a browser of 2023 or later.`;
  throw error;
});
