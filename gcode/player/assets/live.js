// A job under way, as the server that sent this page tells it. Asking is all that it does, unless a token came
// in the address: then it may pause, go on and stop.

const ASK_EVERY_MS = 500;

class Live {
  constructor(root, follow) {
    this.bar = root.querySelector("#live");
    this.words = root.querySelector("#live-state");
    this.following = root.querySelector("#follow");
    this.follow = follow;
    this.token = new URLSearchParams(location.hash.slice(1)).get("token") || "";
    this.bar.hidden = false;
    for (const button of this.bar.querySelectorAll("[data-wish]")) {
      button.hidden = !this.token;
      button.addEventListener("click", () => this.wish(button.dataset.wish));
    }
    this.ask();
  }

  async ask() {
    try {
      const answer = await fetch("state", { cache: "no-store" });
      if (!answer.ok) throw new Error(String(answer.status));
      this.take(await answer.json());
    } catch {
      this.words.textContent = "No answer: the job has ended, or its computer is elsewhere. The page plays on by itself.";
      this.bar.dataset.state = "gone";
      if (++this.failures > 10) return;
    }
    setTimeout(() => this.ask(), document.hidden ? 4 * ASK_EVERY_MS : ASK_EVERY_MS);
  }

  failures = 0;

  take(state) {
    this.failures = 0;
    this.bar.dataset.state = state.paused ? "paused" : state.state;
    const heat = Object.entries(state.temperatures || {}).map(([name, [actual, target]]) => `${name} ${actual.toFixed(0)}${target ? `/${target.toFixed(0)}` : ""} °C`);
    this.words.textContent = [state.paused ? "paused" : state.state, `line ${state.line}`, `${clock(state.elapsed_s)} elapsed`, ...heat].join(", ");
    if (this.following.checked) this.follow(state.line);
  }

  async wish(what) {
    if (what === "stop" && !confirm("Stop the job? The queue ends, and the nozzle leaves the print.")) return;
    const answer = await fetch(what, { method: "POST", headers: { "X-Token": this.token } }).catch(() => null);
    if (!answer?.ok) this.words.textContent = "Not taken: is the token that of this job?";
  }
}
