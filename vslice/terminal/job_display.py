"""What a user sees of a job under way: a bar on a terminal, plain lines elsewhere. All on stderr."""

import math
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from vslice.terminal.session import quiet, say

if TYPE_CHECKING:
    from printer import Program, Progress
    from vslice.terminal.timeline import Timeline

PLAIN_EVERY_S = 10.0
NEAR_C = 1.0  # a heater this near to where it shall be is there
HEATING = re.compile(r"M1(?:09|90|91)(?!\d)")
HOMING = re.compile(r"G28(?!\d)")
FOLLOWS = ("printing", "finished")  # states in which the nozzle is where the program has it
HEATERS = {"T": "nozzle", "B": "bed", "C": "chamber"}


def _waits(command: str) -> bool:
    """Whether a clean command waits for a heater."""
    return command.startswith("M1") and HEATING.match(command) is not None


class Display:
    """Shows snapshots of a job: percent by estimated time, line, times, temperatures, height.

    Heating is told apart: it moves neither the percent nor what is left, for no estimate knows how long it
    takes. Without a ``timeline`` the percent is of commands, and what is left is unknown.
    The height is the program's, so it is shown only while the nozzle follows the program.
    """

    def __init__(self, program: "Program", timeline: "Timeline | None") -> None:
        self.program, self.timeline = program, timeline
        commands = program.commands
        self.last_wait = next((k for k in range(len(commands) - 1, -1, -1) if _waits(commands[k])), -1)
        self.heating_s = 0.0  # so far
        self._seen_s = 0.0
        self._plain_at, self._plain_percent = -math.inf, -1
        self._plain_doing = ""

    def percent(self, progress: "Progress") -> float:
        """How much of the estimated time has passed, 0 to 100."""
        if self.timeline is None or self.timeline.total_s <= 0:
            return 100.0 * progress.acknowledged / max(1, progress.total)
        return 100.0 * (self.timeline.seconds[progress.acknowledged] / self.timeline.total_s)

    def heating(self, progress: "Progress") -> str:
        """What is being heated and how far it is, as "bed 43/60 °C"; "" if the job does not wait for heat."""
        done = progress.acknowledged
        command = progress.ahead or (self.program.commands[done] if done < len(self.program) else "")
        if progress.state.value != "printing" or not _waits(command):
            return ""
        readings = progress.temperatures.items()
        cold = [
            f"{HEATERS.get(name, name)} {reading.actual:.0f}/{reading.target:.0f} °C"
            for name, reading in readings
            if reading.target and abs(reading.target - reading.actual) > NEAR_C
        ]
        return ", ".join(cold)

    def watch(self, progress: "Progress") -> None:
        """Take the time of heating; with each snapshot, once."""
        if self.heating(progress):
            self.heating_s += max(0.0, progress.elapsed_s - self._seen_s)
        self._seen_s = progress.elapsed_s

    @staticmethod
    def state(progress: "Progress") -> str:
        """What the job does: printing, or on its way back to where a resumed job goes on."""
        if not progress.ahead:
            return progress.state.value
        if HOMING.match(progress.ahead):
            return "resuming: homing"
        return f"resuming: {'heating' if _waits(progress.ahead) else 'on the way back'}"

    def words(self, progress: "Progress") -> str:
        """Line, elapsed and remaining time, heating, temperatures, height."""
        done = progress.acknowledged
        line = self.program.acknowledged_line(done)
        last = self.program.lines[-1] if len(self.program) else 0
        heating = self.heating(progress)
        parts = [f"heating {heating}, {clock(self.heating_s)} so far"] if heating else []
        parts += [f"line {line}/{last}", f"{clock(progress.elapsed_s)} elapsed{self._of_it_heating(heating)}"]
        height = math.nan
        if self.timeline is not None:
            if progress.state.value in FOLLOWS and not progress.ahead:
                height = self.timeline.heights_mm[done]
            left = clock(self.timeline.total_s - self.timeline.seconds[done])
            parts.append(f"{left} left" + (", heating apart" if heating or done <= self.last_wait else ""))
        if not heating:
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

    def _of_it_heating(self, heating: str) -> str:
        return f", {clock(self.heating_s)} of it heating" if self.heating_s >= 1 and not heating else ""

    def plain(self, progress: "Progress") -> None:
        """A line now and then, for logs."""
        for message in progress.messages:
            say(message)
        self.watch(progress)
        percent, now = self.percent(progress), time.monotonic()
        doing = "heating" if self.heating(progress) else self.state(progress) if progress.ahead else ""
        due = now - self._plain_at >= PLAIN_EVERY_S or doing != self._plain_doing
        self._plain_doing = doing
        if due or (int(percent) == 100 and self._plain_percent < 100):
            self._plain_at, self._plain_percent = now, int(percent)
            say(f"{percent:3.0f} %  {self.state(progress)}  {self.words(progress)}")


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
            display.watch(progress)
            words = display.words(progress)
            if display.state(progress) != "printing":
                words = f"{display.state(progress)}  {words}"
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
