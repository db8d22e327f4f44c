"""The emulated Marlin seen from the wire: it takes bytes and the time, and gives lines.

No thread and no clock in here: `advance` moves its time, so it runs as fast as wanted, and a test can
step it. What it answers is what a natively built Marlin (bugfix-2.1.x of 2025-02) answered.
"""

import math
import re
from collections import deque
from collections.abc import Iterator

from printer.emulator.build import Options
from printer.emulator.lines import kept
from printer.emulator.machine import Machine
from printer.emulator.odd import Wording
from printer.emulator.planner import Path
from printer.protocol import MAX_LINE, checksum

BOOT = (
    "start",
    "PowerUp",
    "Marlin bugfix-2.1.x",
    "echo: Last Updated: emulated",
    "echo:Hardcoded Default Settings Loaded",
)
NUMBER = re.compile(rb"N\s*(-?\d+)")
END_OF_LINE = re.compile(rb"[\r\n]")
EARLY = frozenset({b"M108", b"M112", b"M410"})  # obeyed before those that are queued
PAUSE_S = 10.0
LONG_BUSY_S = 20.0


class Firmware:
    """One printer. ``receive`` bytes, ``advance`` the time in s, ``read`` what it says."""

    def __init__(self, options: Options | None = None) -> None:
        self.options = options or Options()
        self._wording = Wording(self.options.odd)
        self.path = Path(self.options.keep_path)
        self.machine = Machine(
            self.say, self.path, self.options.blocks, self.options.homing_s, self.options.motion
        )
        self.machine.capabilities = {
            "EEPROM": False,
            "AUTOREPORT_TEMP": True,
            "EMERGENCY_PARSER": self.options.emergency_parser,
            "HOST_ACTION_COMMANDS": True,
            "PROMPT_SUPPORT": True,
        }
        self.now = 0.0
        self.connected = True
        self.lines = self.bytes_lost = self.refused = self.repeated = 0
        self._output: deque[tuple[float, bytes]] = deque()
        self.boot()

    # --- from outside ----------------------------------------------------------------------------------

    def boot(self) -> None:
        """Power on, or reset: only the path is remembered."""
        self._rx, self._line = bytearray(), bytearray()
        self._early = bytearray()
        self._queue: deque[tuple[int | None, str]] = deque()
        self._running: Iterator[float] | None = None
        self._wake = self._busy_at = self._report_at = math.inf
        self._extra_s, self._deaf_until = 0.0, 0.0
        self.last_number = 0
        self.halted = False
        self.machine.power_on()
        if "silent" in self.options.odd:
            self.machine.keepalive_s = 0.0
        for text in BOOT:
            self.say(text)

    def receive(self, data: bytes) -> None:
        """Bytes arrive; those that find the receive buffer full, behind full command slots, are lost."""
        data = self.options.faults.to_printer(data)
        if self.options.emergency_parser:
            self._look_for_emergency(data)
        while data and not self.halted:
            room = self.options.rx - len(self._rx)
            self._rx += data[:room]
            data = data[room:]
            self._work()
            if data and len(self._rx) >= self.options.rx:
                self.bytes_lost += len(data)
                return

    def advance(self, to: float) -> None:
        """Let the time run until ``to``, in s since power-on."""
        while (event := self.next_event()) <= to:
            self.now = self.machine.now = max(self.now, event)
            self._work()
        self.now = self.machine.now = max(self.now, to)
        self.machine.planner.advance(self.now)

    def next_event(self) -> float:
        """When something happens by itself next; infinity if it only waits for the host."""
        if self.halted:
            return math.inf
        if self.now < self._deaf_until:
            return self._deaf_until
        return min(self._wake, self._busy_at, self._report_at)

    def next_output(self) -> float:
        """When the next reply arrives at the host; infinity if there is none on its way."""
        return self._output[0][0] if self._output else math.inf

    def read(self) -> bytes:
        """The replies that have arrived by now; they are given once."""
        data = b""
        while self._output and self._output[0][0] <= self.now:
            data += self._output.popleft()[1]
        return data

    def say(self, text: str) -> None:
        """Send a line to the host."""
        for line in self._wording.lines(text):
            data = self.options.faults.to_host(line)
            if data:
                self._output.append((self.now + self.options.delay_s, data))

    @property
    def idle(self) -> bool:
        """Whether all that was taken has been carried out."""
        return not self._queue and not self._rx and self.machine.planner.end <= self.now

    # --- reception -------------------------------------------------------------------------------------

    def _work(self) -> None:
        """Read lines and carry out commands, as far as it goes at this moment."""
        if self.halted or self.now < self._deaf_until:
            return
        while self._read_line() or self._run():
            pass
        if self.now >= self._busy_at:
            if self.machine.busy_words:
                self.say(f"echo:busy: {self.machine.busy_words}")
            self._busy_at = self.now + (self.machine.keepalive_s or math.inf)
        if self.now >= self._report_at:
            self.say(f" {self.machine.temperatures()}")
            self._report_at = self.now + self.machine.report_s

    def _read_line(self) -> bool:
        """Take one line out of the receive buffer, if a command slot is free. Marlin reads no further."""
        if (
            not self._rx
            or len(self._queue) >= self.options.slots
            or self.halted
            or self.now < self._deaf_until
        ):
            return False
        match = END_OF_LINE.search(bytes(self._rx))
        if match is None:
            self._line += self._rx[: 4 * MAX_LINE - len(self._line)]
            self._rx.clear()
            return False
        end = match.start()
        line = bytes(self._line + self._rx[:end])
        del self._rx[: end + 1]
        self._line.clear()
        self._accept(kept(line))
        return True

    def _accept(self, line: bytes) -> None:
        number: int | None = None
        if line.startswith(b"N"):
            resets = b"M110" in line
            again = line.find(b"N", 4) if resets else -1
            match = NUMBER.match(line, max(again, 0))
            number = int(match[1]) if match else 0
            if number != self.last_number + 1 and not resets:
                if number in (self.last_number - 1, self.last_number):
                    self.repeated += 1  # it believes that its request crossed the line on the way
                    return
                return self._refuse("Line Number is not Last Line Number+1")
            content, star, check = line.rpartition(b"*")
            if not star:
                return self._refuse("No Checksum with line number")
            if not check.strip().isdigit() or int(check) != checksum(content):
                return self._refuse("checksum mismatch")
            if not resets and self._accident(number):
                return
            self.last_number = number
            line = NUMBER.sub(b"", line, count=1)
        elif not self.options.emergency_parser and line[:4] in EARLY:
            self._emergency(line[:4])
        text = line.rpartition(b"*")[0] if b"*" in line else line
        if text.strip() and not self.halted:
            self._queue.append((number, text.decode(errors="replace").strip()))

    def _refuse(self, why: str, wanted: int | None = None) -> None:
        self.refused += 1
        self.say(f"Error:{why}, Last Line: {self.last_number}")
        self._rx.clear()
        self.say(f"Resend: {self.last_number + 1 if wanted is None else wanted}")
        self.say("ok")

    def _accident(self, number: int) -> bool:
        """Let a scripted fault happen at this line; whether the line is lost by it."""
        kind = self.options.faults.at_line(number)
        match kind:
            case "resend":
                self._refuse("checksum mismatch")
            case "resend-of-unknown-line":
                self._refuse("checksum mismatch", wanted=number + 1000)
            case "reset":
                self.machine.planner.advance(self.now)
                self.boot()
            case "kill":
                self.say("Error:Heating failed, system stopped! Heater_ID: 0")
                self._kill()
            case "silence":
                self._deaf_until = math.inf
            case "pause":
                self._deaf_until = self.now + PAUSE_S
                return False
            case "disconnect":
                self.connected = False
            case "garbage":
                self._output.append((self.now, b"\xff\xfe\x80\x00 garb\xc3\n\xf0\x28\n"))
                return False
            case "long-busy":
                self._extra_s = LONG_BUSY_S
                return False
        return kind is not None

    def _look_for_emergency(self, data: bytes) -> None:
        self._early += data
        *lines, self._early = self._early.split(b"\n")
        for line in lines:
            word = bytes(NUMBER.sub(b"", line, count=1).strip()[:4])
            if word in EARLY:
                self._emergency(word)

    def _emergency(self, word: bytes) -> None:
        if word == b"M112":
            self.say("echo:M112 Shutdown")
            self._kill()
        elif word == b"M410":
            self.machine.quickstop()
        else:
            self.machine.go_on = True
            self._wake = min(self._wake, self.now) if self._running else math.inf

    def _kill(self) -> None:
        self.say("Error:Printer halted. kill() called!")
        self.machine.planner.advance(self.now)
        self.machine.planner.drop()
        self.machine.hotend.aim(0, self.now)
        self.machine.bed.aim(0, self.now)
        self._queue.clear()
        self.halted = True

    # --- execution -------------------------------------------------------------------------------------

    def _run(self) -> bool:
        """Go on with the command under way, or begin the next; whether one ended."""
        if self.halted or self.now < self._deaf_until or not self._queue:
            return False
        number, text = self._queue[0]
        if self._running is None:
            self.lines += 1
            self._running = self._steps(text)
            self._wake = self.now
            self._busy_at = self.now + (self.machine.keepalive_s or math.inf)
        if self._wake > self.now:
            return False
        self.machine.planner.advance(self.now)
        self._wake = next(self._running, -1.0)
        if self.halted:
            return False
        if self._wake >= 0:
            return self._wake <= self.now
        self.say(self._ok(number, text))
        self._queue.popleft()
        self._running, self._wake, self._busy_at = None, math.inf, math.inf
        if self.machine.report_s and self._report_at == math.inf:
            self._report_at = self.now + self.machine.report_s
        elif not self.machine.report_s:
            self._report_at = math.inf
        return True

    def _steps(self, text: str) -> Iterator[float]:
        if text.startswith("M112"):  # numbered, so it had to wait for its turn
            self._emergency(b"M112")
            return
        yield from self.machine.run(text)
        if self._extra_s:
            self._extra_s = 0.0
            yield self.now + LONG_BUSY_S
        if self.options.command_s:
            yield self.now + self.options.command_s

    def _ok(self, number: int | None, text: str) -> str:
        if text.startswith("M105"):
            return f"ok {self.machine.temperatures()}"
        if not self.options.advanced_ok:
            return "ok"
        told = "" if number is None else f" N{number}"
        planned = self.options.blocks - 1 - len(self.machine.planner.blocks)
        return f"ok{told} P{planned} B{self.options.slots - len(self._queue)}"
