"""Runs a sender against an emulated printer without threads, sleeps or a real clock."""

from collections.abc import Callable, Sequence

from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import Firmware
from printer.job import END_OF_LINE
from printer.report import State
from printer.sender import Sender
from printer.settings import Settings


class Bench:
    """A sender and a printer on one table. ``run`` moves bytes and the time until the job has ended."""

    def __init__(
        self,
        commands: Sequence[str],
        settings: Settings | None = None,
        faults: Faults | None = None,
        firmware: Firmware | None = None,
        before: Sequence[str] = (),
        **options: float,
    ) -> None:
        self.firmware = firmware or Firmware(Options(faults=faults or Faults(), **options))
        self.sender = Sender(commands, settings or Settings(), self.firmware.now, before)
        self.heard = b""

    def step(self) -> None:
        """Whatever happens next: bytes out, bytes in, or the time goes on."""
        printer, sender = self.firmware, self.sender
        if data := sender.take_output():
            printer.receive(data)
        self.heard += printer.read()
        if (end := END_OF_LINE.search(self.heard)) is not None:
            line, self.heard = self.heard[: end.start()], self.heard[end.end() :]
            sender.receive([line], printer.now)
            return
        to = min(sender.deadline, printer.next_event(), printer.next_output())
        printer.advance(max(to, printer.now))
        if not printer.next_output() <= printer.now:
            sender.tick(printer.now)

    def run(self, until: Callable[[], bool] = lambda: False, limit: int = 10_000_000) -> State:
        """Step until the job has ended or ``until`` says so."""
        for _ in range(limit):
            if self.sender.state.final or until():
                return self.sender.state
            self.step()
        raise AssertionError(f"no end after {limit} steps: {self.sender.state}")

    def settle(self) -> None:
        """Let the printer carry out what it has taken."""
        while (event := self.firmware.next_event()) < float("inf") and not self.firmware.idle:
            self.firmware.advance(event)
        self.firmware.advance(max(self.firmware.now, self.firmware.machine.planner.end))
