"""Runs the state machine of `printer.sender` on a real port: one thread that reads and answers."""

import re
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import serial

from dialect.commands import code_of
from printer.busy_times import durations
from printer.commands import Program, make_program, read_program
from printer.errors import PrinterError, StreamError
from printer.journal import Journal
from printer.ports import READ_TIMEOUT_S, Port, open_port, port_lock
from printer.protocol import fault_of
from printer.replay import drawn_back, lays_nothing
from printer.report import Progress, Report, State
from printer.safety import extrusion
from printer.sender import Sender
from printer.settings import Settings

LINES_PER_RECORD = 100
"""Acknowledged lines after which the journal is told, at the latest: well within ``LINES_PER_SYNC``, by which
a resumed job takes it to be behind the printer, as the thread that writes may have to wait for a processor.
"""
PROGRESS_S = 0.2
END_OF_LINE = re.compile(rb"[\r\n]+")
LONGEST_REPLY = 4096  # bytes without a newline are no reply of a printer: a wrong baud rate, noise


class Job:
    """A program on its way to a printer.

    `run` blocks until the end; `pause`, `cancel` and `abort` may be called meanwhile by other threads and
    by signal handlers. ``start_at`` is the index of the first command, for a resumed job; ``before`` are
    commands ahead of it. ``on_progress`` is called in the thread of `run`, a few times a second.
    """

    def __init__(
        self,
        program: Program,
        port: str | Port,
        settings: Settings | None = None,
        *,
        on_progress: Callable[[Progress], None] | None = None,
        journal: Journal | None = None,
        start_at: int = 0,
        before: Sequence[str] = (),
    ) -> None:
        self.program, self.port_given = program, port
        self.settings = settings or Settings()
        self.on_progress, self.journal = on_progress, journal
        self.start_at, self.before = start_at, tuple(before)
        for command in self.before:
            if fault := fault_of(command, 9_999_999):
                raise PrinterError(f"{command!r}: {fault}.")
        self._changed = threading.Event()
        self._sender: Sender | None = None
        self._wishes: list[str] = []
        self._failure: BaseException | None = None

    # --- from other threads ------------------------------------------------------------------------

    def pause(self, paused: bool = True) -> None:
        """Feed no more lines, or go on."""
        self._wish("pause" if paused else "resume")

    def cancel(self) -> None:
        """A controlled stop."""
        self._wish("cancel")

    def abort(self) -> None:
        """M112, at once."""
        self._wish("abort")

    @property
    def paused(self) -> bool:
        """Whether the job is paused, by the user or by the printer."""
        return self._sender is not None and self._sender.paused

    def _wish(self, what: str) -> None:
        # No lock here: a signal handler may interrupt the very thread that holds it.
        self._wishes.append(what)
        cancel_read = getattr(self._port, "cancel_read", None) if self._sender else None
        if cancel_read:
            cancel_read()

    # --- the job -----------------------------------------------------------------------------------

    def run(self) -> Report:
        """Stream the program; returns when it has been carried out, or stopped on request.

        Raises:
            PortError: if the port cannot be opened.
            StreamError: if the job failed; its ``report`` says how far it came.
        """
        with ExitStack() as stack:
            if isinstance(self.port_given, str):
                stack.enter_context(port_lock(self.port_given))
                self._port = open_port(self.port_given, self.settings.baud)
                stack.callback(self._port.close)
            else:
                self._port = self.port_given
            if self.journal is not None:
                self.journal.ready(
                    self.program.acknowledged_line(self.start_at),
                    sum(map(extrusion, self.before)),
                    homes=any(code_of(line) == "G28" for line in self.before),
                )
            clock = getattr(self._port, "clock", time.monotonic)
            commands = self.program.commands[self.start_at :] if self.start_at else self.program.commands
            self._sender = sender = Sender(commands, self.settings, clock(), self.before)
            sender.drawn_back_at = lambda done: drawn_back(self.program.commands, self.start_at + done)
            reader = threading.Thread(target=self._serve, args=(sender, clock), name="printer", daemon=True)
            reader.start()
            sender.busy_times.blocks_s = durations(commands)  # the printer boots meanwhile
            try:
                self._watch(sender, reader, clock)
            except BaseException:
                self._leave(reader)
                raise
            if self._failure is not None:
                raise self._failure
            report = self._report(sender, clock())
            if self.journal is not None:
                self.journal.close_job(
                    self._acknowledged_line(sender),
                    report.state.value,
                    report.refused,
                    drawn_back_mm=sender.drawn_back_mm,
                    nothing_laid=report.state is not State.FINISHED and self._has_laid_nothing(sender),
                    lost=sender.forgot,
                )
            if report.state is State.FAILED:
                line = self._acknowledged_line(sender)
                far = f" Acknowledged up to line {line} ({report.acknowledged} of {report.total} commands)."
                message = report.message + (far if report.total else "")  # a greeting sends no program
                raise StreamError(f"{self.program.name}: {message}", report)
            return report

    def _leave(self, reader: threading.Thread) -> None:
        """The caller's thread was interrupted, or its callback failed: stop in a controlled way."""
        self._wish("cancel")
        try:
            reader.join()
        except KeyboardInterrupt:
            self._wish("abort")
            reader.join(timeout=10)

    def _serve(self, sender: Sender, clock: Callable[[], float]) -> None:
        """The reader thread: every byte in and out of the port passes here."""
        try:
            self._serve_until_end(sender, clock)
        except (serial.SerialException, OSError) as error:
            sender.lost(str(error))  # pyserial or the system: the cable was pulled
        except BaseException as error:  # noqa: BLE001 - carried over to the thread of run(), and raised there
            self._failure = error
            sender.lost(f"a defect: {error!r}")
        self._changed.set()

    def _serve_until_end(self, sender: Sender, clock: Callable[[], float]) -> None:
        port, rest, announced, tick_at = self._port, b"", 0, 0.0
        while not sender.state.final:
            if self._wishes:
                self._grant(sender, clock())
            if data := sender.take_output():
                port.write(data)
            received = port.read(port.in_waiting or 1)
            now = clock()
            if received:
                *lines, rest = END_OF_LINE.split(rest + received)
                if len(rest) > LONGEST_REPLY:
                    lines, rest = [*lines, rest], b""
                sender.receive(lines, now)
            if now >= tick_at or not received:
                sender.tick(now)
                tick_at = now + READ_TIMEOUT_S
            if sender.window.acked - announced >= LINES_PER_RECORD:
                announced = sender.window.acked
                self._changed.set()  # the journal wants to know
        if data := sender.take_output():
            port.write(data)

    def _grant(self, sender: Sender, now: float) -> None:
        while self._wishes:
            match self._wishes.pop(0):
                case "abort":
                    sender.abort(now)
                case "cancel":
                    sender.cancel(now)
                case wish:
                    sender.pause(wish == "pause")

    def _watch(self, sender: Sender, reader: threading.Thread, clock: Callable[[], float]) -> None:
        """Journal and display, in the caller's thread: neither ever holds up the wire."""
        while reader.is_alive():
            self._changed.wait(PROGRESS_S)
            self._changed.clear()
            if self.journal is not None:
                self.journal.acknowledge(self._acknowledged_line(sender))
            self._tell(sender, clock())
        self._tell(sender, clock())

    def _acknowledged_line(self, sender: Sender) -> int:
        return self.program.acknowledged_line(self.start_at + sender.window.acknowledged)

    def _has_laid_nothing(self, sender: Sender) -> bool:
        """Whether no line that was handed over, acknowledged or not, can have laid any material."""
        sent, safety = sender.window.assigned, self.settings.safety
        return not self.before and lays_nothing(self.program, sent, safety.close_lines, safety.open_lines)

    def _tell(self, sender: Sender, now: float) -> None:
        if self.on_progress is None:
            return
        told = sender.printer_status.messages
        messages = [told.popleft() for _ in range(len(told))]
        self.on_progress(
            Progress(
                sender.state,
                self.start_at + sender.window.acknowledged,
                len(self.program),
                sender.window.resent,
                now - sender.begun,
                sender.paused,
                sender.printer_status.temperatures,
                tuple(messages),
                sender.ahead,
            )
        )

    def _report(self, sender: Sender, now: float) -> Report:
        return Report(
            sender.state,
            self.start_at + sender.window.assigned,
            self.start_at + sender.window.acknowledged,
            len(self.program),
            sender.window.resent,
            now - sender.begun,
            sender.printer_status.longest_silence,
            sender.message,
            tuple(sender.printer_status.warnings),
            sender.printer_status.rebooted,
            sender.printer_status.position,
            dict(sender.printer_status.capabilities),
            tuple(sender.printer_status.refused),
            tuple(sender.printer_status.unknown),
        )


def stream(
    program: Program | Path | str | Sequence[str],
    port: str | Port,
    settings: Settings | None = None,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    journal: Journal | None = None,
) -> Report:
    """Send a program (a path, its lines, or a `Program`) to a printer and wait until it is printed.

    ``port`` is a URL that pyserial opens, or an open port with a read timeout.

    Raises:
        ProtocolError: if the program holds a line that Marlin cannot take; nothing was sent then.
        PortError: if the port cannot be opened.
        StreamError: if the job failed.
    """
    if isinstance(program, str | Path):
        program = read_program(Path(program))
    elif not isinstance(program, Program):
        program = make_program(program)
    return Job(program, port, settings, on_progress=on_progress, journal=journal).run()
