"""What a user sees of a job under way: a bar on a terminal, plain lines elsewhere. All on stderr."""

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from vslice.session import quiet, say

if TYPE_CHECKING:
    from printer import Program, Progress
    from printer.replay import Estimate

PLAIN_EVERY_S = 10.0


class Display:
    """Shows snapshots of a job: percent by estimated time, line, times, temperatures, height."""

    def __init__(self, program: "Program", estimate: "Estimate", clock_runs: bool = True) -> None:
        self.program, self.estimate = program, estimate
        self.clock_runs = clock_runs  # in a dry run there is no time to wait
        self._plain_at, self._plain_percent = -math.inf, -1

    def percent(self, progress: "Progress") -> float:
        """How much of the estimated time has passed, 0 to 100."""
        total = self.estimate.total_s
        if total <= 0:
            return 100.0 * progress.acknowledged / max(1, progress.total)
        return 100.0 * self.estimate.seconds[progress.acknowledged] / total

    def words(self, progress: "Progress") -> str:
        """Line, elapsed and remaining time, temperatures, height."""
        remaining = self.estimate.total_s - self.estimate.seconds[progress.acknowledged]
        height = self.estimate.heights_mm[progress.acknowledged]
        line = self.program.acknowledged_line(progress.acknowledged)
        last = self.program.lines[-1] if len(self.program) else 0
        parts = [f"line {line}/{last}", f"{clock(progress.elapsed_s)} elapsed", f"{clock(remaining)} left"]
        parts += [
            f"{name} {reading.actual:.0f}" + (f"/{reading.target:.0f}" if reading.target else "") + " °C"
            for name, reading in progress.temperatures.items()
        ]
        if not math.isnan(height):
            parts.append(f"height {height:.2f} mm")
        if progress.resent:
            parts.append(f"{progress.resent} resent")
        if progress.paused:
            parts.append("PAUSED, the nozzle stays on the print")
        return "  ".join(parts)

    def plain(self, progress: "Progress") -> None:
        """A line now and then, for logs."""
        for message in progress.messages:
            say(message)
        percent, now = self.percent(progress), time.monotonic()
        due = now - self._plain_at >= PLAIN_EVERY_S
        if due or (int(percent) == 100 and self._plain_percent < 100):
            self._plain_at, self._plain_percent = now, int(percent)
            say(f"{percent:3.0f} %  {progress.state.value}  {self.words(progress)}")


@contextmanager
def shown(display: Display) -> Iterator[Callable[["Progress"], None]]:
    """Call what this gives with each snapshot."""
    if quiet() or not sys.stderr.isatty():
        yield (lambda _: None) if quiet() else display.plain
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    columns = (TextColumn("{task.percentage:5.1f} %"), BarColumn(24), TextColumn("{task.description}"))
    with Bar(*columns, console=console) as bar:
        task = bar.add_task("", total=100.0)

        def show(progress: "Progress") -> None:
            for message in progress.messages:
                console.print(message, markup=False, highlight=False)
            words = display.words(progress)
            if progress.state.value != "printing":
                words = f"{progress.state.value}  {words}"
            bar.update(task, completed=display.percent(progress), description=words)

        yield show


def clock(seconds: float) -> str:
    """A duration as h:mm:ss."""
    whole = max(0, round(seconds))
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


@contextmanager
def keys(pressed: Callable[[str], None]) -> Iterator[None]:
    """Call ``pressed`` with each key, while stdin and stderr are a terminal that can tell single keys."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()) or sys.platform == "win32":
        yield
        return
    import os
    import select
    import termios
    import tty

    handle = sys.stdin.fileno()
    before = termios.tcgetattr(handle)
    wake_read, wake_write = os.pipe()

    def watch() -> None:
        while True:
            ready, _, _ = select.select([handle, wake_read], [], [])
            if wake_read in ready:
                return
            pressed(os.read(handle, 1).decode(errors="replace"))

    watcher = threading.Thread(target=watch, name="keys", daemon=True)
    try:
        tty.setcbreak(handle)
        watcher.start()
        yield
    finally:
        with suppress(OSError):
            os.write(wake_write, b"x")
        watcher.join(timeout=1)
        termios.tcsetattr(handle, termios.TCSADRAIN, before)
        os.close(wake_read)
        os.close(wake_write)
