"""The streaming state machine: replies and time in, bytes out. No port, no thread and no clock in here.

Counting oks only bounds what is in flight. An ok can be lost, doubled, or belong to a damaged line that
the printer took for an unknown command; a mark (see `printer.in_flight`) among the lines sets the count
right again, and the last one proves that all has arrived.
"""

from collections import deque
from collections.abc import Iterable

from printer.firmware_words import NO_SENSOR, PREVENTED, code_of
from printer.in_flight import OTHER_MARK
from printer.outgoing import RECOVERY_S, Outgoing
from printer.protocol import (
    PLAIN_OK,
    Action,
    Busy,
    Error,
    Ok,
    Other,
    Position,
    Reply,
    Resend,
    Start,
    Temperature,
    parse_reply,
)
from printer.refusals import refusal
from printer.report import State
from printer.resends import REPEATS, Verdict
from printer.safety import extrusion, leave

MOST_PROBES = 2  # while a heater is waited for: lines behind it fill the command slots


class Sender(Outgoing):
    """One job on one printer. Feed it with `receive` and `tick`, write what `take_output` gives.

    Arguments as those of `Outgoing`.
    """

    # --- what the printer says ---------------------------------------------------------------------

    def receive(self, lines: Iterable[bytes], now: float) -> None:
        """Take what the printer said, line by line, and then send what fits."""
        for line in lines:
            if not self.state.final:
                self.printer_status.line(line, now)
                self._react(parse_reply(line), now)
        self._fill(now)

    def _react(self, reply: Reply, now: float) -> None:
        if reply is not PLAIN_OK:
            self.printer_status.note(reply)
        match reply:
            case Ok():
                self._ok(reply, now)
            case Resend(number):
                self._resend(number, now)
            case Error(resend=True, last=last):
                self.resends.announced(last)
            case Error():
                self._error(reply, now)
            case Start(clear) if self.state in (State.BOOT, State.HELLO):
                if clear:
                    self._greet(now)
            case Start():
                self._lose("the printer was reset in the middle of the job")
            case Position() if self.window.mark == OTHER_MARK:
                self._answered(now)
                self.resends.swallow = True  # its ok comes behind it
            case Busy() | Temperature(waiting=True):
                self._alive(now)
            case Temperature() if self.heating >= self.window.proved:
                self._warming(now)
            case Action(name):
                self._obey(name, now)
            case Other(text):
                if not self._refused(text):
                    self.printer_status.remark(text)

    def _ok(self, reply: Ok, now: float) -> None:
        window = self.window
        self.printer_status.answered = True
        if reply is not PLAIN_OK and self.marks.is_answer(reply, self._mark_is_under_way):
            self._answered(now, reply.number)
        elif self.state is State.HELLO:
            return  # that of M110; the mark behind it tells that both have arrived
        elif reply.number is not None and reply.number < window.sent:
            self.room, self.resends.swallow = reply.buffer or 0, False
            if reply.number == window.acked:  # as expected, so no digit of it is damaged
                window.prove(reply.number)
            self._take(reply.number, now)
        elif self.resends.ok():
            return
        elif window.lines and not (window.marks and window.marks[0] == window.acked):
            self._take(window.acked, now)  # else it is one ok too many

    @property
    def _mark_is_under_way(self) -> bool:
        return self.state is State.HELLO or bool(self.window.marks) or self.probe is not None

    def _answered(self, now: float, number: int | None = None) -> None:
        """A mark was answered: everything up to it has been taken."""
        window = self.window
        if self.state is State.HELLO:
            self.state, number = State.RUN, 1  # the printer counts from 0 now
            window.prove(1)
        elif number is None or number >= window.sent:
            if self.probe is None and not window.marks:
                return  # a position that nobody asked for
            window.prove_answered(now)
            self.resends.missed()
            number = window.marks[0] if self.probe is None else self.probe
        else:  # the answer names its line (ADVANCED_OK)
            window.prove_answered(now)
            if number == window.acked:
                window.prove(number)
        self._take(number, now)

    def _resend(self, number: int | None, now: float) -> None:
        """The printer asks for a line: act once, and send the line alone until the printer has taken it."""
        if self.state is State.HELLO:
            self._greet(now)
        if self.state not in (State.RUN, State.STOP):
            return
        window = self.window
        match self.resends.judge(number):
            case Verdict.LOST:
                self._lose(
                    f"the printer asks for line {number}, although it has taken {window.proved - 1}: it was "
                    "reset, or has lost count"
                )
            case Verdict.GIVE_UP:
                self._fail(
                    f"the printer asked {REPEATS} times in vain for a line, at last for {number} of "
                    f"{window.top - 1} that were sent",
                    "Something damages each copy of it: check the cable, the baud rate and the firmware.",
                )
            case Verdict.OBEY if number is not None:
                if self.probe is not None:
                    window.take(number - 1)  # after a silence, no ok of those is to be expected
                self.resends.obeyed(number)
                self.probe = None
                window.rewind(number)
                self.alone = number
                self.marks.soon(now)
                self._alive(now)
            case Verdict.IGNORE if window.waiting and self.probe is None:
                self.probe_due = min(self.probe_due, now + RECOVERY_S)

    def _warming(self, now: float) -> None:
        """Heaters are reported while one is waited for. Firmwares differ in how they do that, and it may be
        an automatic report behind which the wait was lost: so ask, but not without end."""
        self.progressed = now
        if self.probes >= MOST_PROBES:
            self.probe_due = now + self.settings.probe_after_s

    def _error(self, error: Error, now: float) -> None:
        """An error that asks for nothing: the end if the firmware has halted, else a matter of record."""
        if self.state is State.ABORT:
            if error.fatal:
                self._end(State.KILLED, f"halted with M112; the printer confirms: {error.text}")
        elif error.fatal:
            # Klipper says !! of a single command too, and then knows where it is.
            found = refusal(error.text, self.window)
            self.forgot = found is None or found.lost
            self._fail(
                f"the printer stopped, in its own words: {error.text}", "Find the cause, then reset it."
            )
        elif NO_SENSOR.search(error.text):
            if self.window.mark != OTHER_MARK:
                self.window.use_other_mark()
                self.printer_status.warn("it has no temperature sensor: temperatures are unknown")
                if self.state is State.HELLO:
                    self.resends.swallow = False
                    self._greet(now)
        elif not self._refused(error.text):
            self.printer_status.warn(f"Error: {error.text}")

    def _refused(self, text: str) -> bool:
        """Whether the firmware says that it has not done something; what the print needs ends the job."""
        found = refusal(text, self.window)
        if found is None:
            return False
        if self.state is State.STOP and PREVENTED.search(text) and self._stop_was_cold():
            return True
        self.printer_status.refuse(text)
        self.forgot = self.forgot or found.lost
        if found.unknown and found.unknown not in self.printer_status.unknown:
            self.printer_status.unknown.append(found.unknown)
        elsewhere = found.unknown and self.settings.emulated  # a printer of another firmware may know it
        if found.fatal and not elsewhere and self.state is not State.STOP:
            self._fail(found.what, found.advice)
        return True

    def _stop_was_cold(self) -> bool:
        """Whether the material that was not moved is what this stop draws back. Behind a cold nozzle nothing
        flows, so nothing is amiss; but it is not drawn back either."""
        window = self.window
        in_flight = range(window.acked, window.sent)
        own = [n for n in in_flight if window.is_own(n) and n not in self.unfed]
        cold = [n for n in own if extrusion(line := window.command(n)) or code_of(line) == "G10"]
        self.unfed.update(cold[:1])
        return bool(cold)

    def _obey(self, name: str, now: float) -> None:
        """Host actions; any other is only shown."""
        if name in ("pause", "paused", "resume", "resumed"):
            self.paused = name.startswith("pause")
        elif name == "cancel":
            self.cancel(now)

    # --- what others may ask for -------------------------------------------------------------------

    def pause(self, paused: bool = True) -> None:
        """Feed no more lines of the program, or go on; the printer still executes what it has taken."""
        self.paused = paused

    def cancel(self, now: float) -> None:
        """A controlled stop: no more of the program; let the queue end, then leave the print safely."""
        if self.state is State.RUN:
            self.state, self.end = State.STOP, self.window.assigned
            drawn_back_mm = self._drawn_back_mm()
            self.pending = deque(["M400", *leave(self.settings.safety, drawn_back_mm)])
            self.tail_given = False
            self.output += b"M108\n"  # ends a wait for a heater or a user; its ok acknowledges nothing else
            self.resends.swallow = True
            self._fill(now)
        elif self.state in (State.BOOT, State.HELLO):
            self._end(State.STOPPED, "stopped before the first line")

    def _drawn_back_mm(self) -> float:
        """Material that will be drawn back when all that has a number is carried out: by the program, or by
        an earlier stop that the lines ahead of the program do not get to make good."""
        owed_mm = sum(map(extrusion, self.pending))
        return max(0.0, self.drawn_back_at(self.window.assigned) + owed_mm)

    def abort(self, now: float) -> None:
        """M112, at once and without a number; nothing else follows."""
        if not self.state.final:
            self.forgot = True
            self.state, self.output, self.progressed = State.ABORT, bytearray(b"\nM112\n"), now

    def lost(self, reason: str) -> None:
        """The port is gone."""
        self._fail(f"the connection broke: {reason}", "Check the cable; the heaters may still be on.")
