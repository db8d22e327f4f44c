"""The half of the streaming state machine that sends: what goes out, when, and how long an answer may take.

No port, no thread and no clock in here.
"""

from collections import deque
from collections.abc import Callable, Sequence

from dialect.numbers import FEED_DECIMALS
from printer.busy_times import BusyTimes
from printer.firmware_words import code_of
from printer.in_flight import OTHER_MARK, Window
from printer.marks import Marks
from printer.protocol import HELLO, frame
from printer.replay import drawn_back
from printer.report import State
from printer.resends import Resends
from printer.safety import extrusion
from printer.settings import Settings
from printer.status import PrinterStatus

# Nothing is sent before the ok of these. A line behind M410 is corrupted; behind one that waits for a
# heater or a user, lines would fill the command slots, and M108 and M112 act early only if one is free; one
# that tells a position by itself would answer a mark behind it; and the last mark, behind M400, must be the
# only one whose answer can be heard.
ALONE = frozenset({"M410", "M109", "M190", "M191", "M0", "M1", "M600", "M400", "G28", "G29"})
HEATS = frozenset({"M109", "M190", "M191", "M116", "M303"})
RECOVERY_S = 0.4  # after a resend, silence is broken sooner
HALT_S = 5.0  # for the confirmation of M112


class Outgoing:
    """What one job sends to one printer; `printer.sender.Sender` adds what the printer answers.

    ``commands`` are clean (see `printer.commands`); ``before`` are lines of our own ahead of them.
    ``now`` is any clock in seconds that never runs backwards.
    """

    def __init__(
        self, commands: Sequence[str], settings: Settings, now: float, before: Sequence[str] = ()
    ) -> None:
        self.settings, self.window = settings, Window(commands)
        self.state, self.message, self.paused = State.BOOT, "", False
        self.pending = deque(["M115", *before])  # lines of our own that go next
        self.has_before = bool(before)
        self.to_feed_mm = sum(map(extrusion, before))  # as the lines ahead of the program shall
        self.end, self.tail_given = len(commands), False
        self.resends = Resends(self.window, settings.window_lines)
        self.probe: int | None = None  # the number of the mark that was sent into a silence
        self.alone: int | None = None  # this line goes alone, until it is acknowledged
        self.drawn_back_at: Callable[[int], float] = lambda done: drawn_back(commands, done)
        self.unfed: set[int] = set()  # lines of our own that the printer was too cold to carry out
        self.heating = 0  # the last line that waits for a heater
        self.marks = Marks(self.window, settings.poll_s, now)
        self.busy_times, self.allowed_s = BusyTimes(self.window), 0.0
        self.room = 0  # free command slots, where the printer tells them
        self.output = bytearray()
        self.begun = self.progressed = now
        self.probes, self.probe_due = 0, now
        self.printer_status = PrinterStatus(now)
        self.forgot = False  # where it stands: it was reset, or must be before it answers again

    def take_output(self) -> bytes:
        """The bytes to write now; they are given once."""
        data = bytes(self.output)
        self.output.clear()
        return data

    @property
    def ahead(self) -> str:
        """The line ahead of the program that is under way; "" if there is none, or the program has begun."""
        window = self.window
        if not self.has_before or self.state is not State.RUN or window.acknowledged:
            return ""
        number = window.acked
        if number < window.top:
            return window.command(number) if window.is_own(number) else ""
        return next(iter(tuple(self.pending)), "")

    @property
    def drawn_back_mm(self) -> float:
        """How far our own lines have left the filament behind where the program has it: what those ahead of
        the program had still to feed, and what those of a stop have drawn back."""
        fed = sum(extrusion(line) for number, line in self.window.own_taken() if number not in self.unfed)
        return round(self.to_feed_mm - fed, FEED_DECIMALS)

    def tick(self, now: float) -> None:
        """Take the time: due at `deadline`, harmless earlier."""
        if self.state.final or now < self.deadline:
            return
        silence, stalled = now - self.printer_status.heard_at, now - self.progressed
        self.printer_status.silent_until(now)
        self.allowed_s = self.busy_times.at_most_s() if self.state in (State.RUN, State.STOP) else 0.0
        if self.state is State.ABORT:
            self._end(State.KILLED, "sent M112, which the printer did not confirm: switch it off")
        elif self.state is State.BOOT:
            self._greet(now)
        elif now >= self._silence_ends:
            self._fail(
                f"nothing was heard for {silence:.0f} s", "Check the power, the cable and the baud rate."
            )
        elif now >= self.progressed + self._patience:
            self._fail(
                f"no line was acknowledged for {stalled:.0f} s", "Check the printer and the baud rate."
            )
        elif self.state is State.HELLO and now >= self.probe_due:
            if self.printer_status.answered and self.window.mark != OTHER_MARK:
                self.window.use_other_mark()  # it answers, and never with temperatures
            self._greet(now)
        elif self.window.waiting and now >= self.probe_due:
            self._probe(now)
        self._fill(now)

    @property
    def deadline(self) -> float:
        """When `tick` is due."""
        if self.state is State.BOOT:
            return self.begun + self.settings.boot_wait_s
        if self.state is State.ABORT:
            return self.progressed + HALT_S
        if self.state is State.HELLO or self.window.waiting:
            return min(self.probe_due, self._silence_ends, self.progressed + self._patience)
        return self.marks.polled + self.settings.poll_s

    # Compared as they are told, so that a clock that jumps to a deadline finds it due.
    @property
    def _silence_ends(self) -> float:
        return self.printer_status.heard_at + self.settings.give_up_after_s + self.allowed_s

    @property
    def _patience(self) -> float:
        if self.state is State.HELLO:
            return self.settings.give_up_after_s
        return self.settings.stall_after_s + self.allowed_s

    def _fill(self, now: float) -> None:
        """Send as much as the window allows; notice the end."""
        if self.state not in (State.RUN, State.STOP):
            return
        window, most = self.window, self.settings.window_lines
        if self.room > most > 1:
            most = self.room
        if window.sent == window.acked:
            self._alive(now)  # an idle wire begins to wait now
        while window.sent - window.acked < most and (self.alone is None or window.sent <= self.alone):
            if window.sent == window.top and not self._assign(now):
                break
            command, data = window.next_line()
            if window.bytes and window.bytes + len(data) > self.settings.window_bytes:
                break
            if command[:2] in ("M1", "M4", "M6", "M0", "G2") and (code := code_of(command)) in ALONE:
                self.alone = window.sent
                if code in HEATS:
                    self.heating = window.sent
            if command == window.mark:
                window.await_answer(window.sent, now)
            self.output += window.send()
        if self.tail_given and not self.pending and not window.waiting:
            if window.proved < window.top:  # the answer may have been another's: ask in other words
                window.use_other_mark()
                self.pending.append(window.mark)
                self._fill(now)
                return
            self._end(State.FINISHED if self.state is State.RUN else State.STOPPED, "")

    def _assign(self, now: float) -> bool:
        """Give the next number to a line, if there is one."""
        window = self.window
        left = window.assigned < self.end
        if not self.pending and not left and not self.tail_given:
            self.pending.extend(["M400", window.mark])
            self.tail_given = True
        if self.pending:
            window.assign(self.pending.popleft())
        elif not self.tail_given and self.marks.due(now):
            self.marks.assign(now)
        elif left and not self.paused:
            window.assign()
        else:
            return False
        return True

    def _take(self, through: int, now: float) -> None:
        """The printer has taken every line up to and with ``through``."""
        self.window.take(through)
        if self.probe is not None and through >= self.probe:
            self.probe = None
        if self.alone is not None and through >= self.alone:
            self.alone = None
        self.resends.taken(through)
        self._alive(now)

    def _probe(self, now: float) -> None:
        """Break a silence: end a half line, and send a mark whose number was never used before.

        If the printer takes it, all before it was taken; if not, this brings the Resend that was lost.
        """
        self.probes += 1
        self.resends.late, self.resends.open = 0, False
        self.probe = self.window.assign(self.window.mark)
        self.window.await_answer(self.probe, now)
        data = frame(self.probe, self.window.mark)
        if self.window.sent == self.probe:
            self.window.send()
        self.output += b"\n" + data
        self.probe_due = now + self.settings.probe_after_s * (1 + self.probes) + self.busy_times.told_s()
        silence = f"no answer for {now - self.progressed:.0f} s: asking the printer"
        self.printer_status.messages.append(silence)

    def _greet(self, now: float) -> None:
        """Set the printer's counter to 0 and send line 1, a mark, whose answer tells that it worked."""
        if self.state is State.BOOT:
            self.progressed = self.printer_status.heard_at = now
            self.window.assign(self.window.mark)
        self.window.rename(1, self.window.mark)
        self.state, self.probe_due = State.HELLO, now + self.settings.probe_after_s
        self.output += b"\n" + HELLO + frame(1, self.window.mark)

    def _alive(self, now: float) -> None:
        if self.state is not State.ABORT:
            self.progressed, self.probes, self.allowed_s = now, 0, 0.0
            after = self.settings.probe_after_s
            self.probe_due = now + (min(RECOVERY_S, after) if self.resends.open else after)

    def _lose(self, what: str) -> None:
        self.forgot = True
        self._fail(what, "It has forgotten its position; nothing more was sent.")

    def _fail(self, what: str, advice: str) -> None:
        status = self.printer_status
        heard = f"The last thing heard was {status.last_words!r}" if status.last_line else "It never answered"
        if self.state in (State.BOOT, State.HELLO):
            advice += " A printer that was halted (M112, an error) answers again when it has been reset."
        self._end(State.FAILED, f"{what}. {heard}. {advice}")

    def _end(self, state: State, message: str) -> None:
        if not self.state.final:
            self.state, self.message = state, message
