"""The streaming state machine: replies and time in, bytes out. No port, no thread and no clock in here.

Counting oks only bounds what is in flight. An ok can be lost, doubled, or belong to a damaged line that
the printer took for an unknown command; a mark (see `printer.window`) among the lines sets the count
right again, and the last one proves that all has arrived.
"""

from collections import deque
from collections.abc import Iterable, Sequence

from printer.heard import Heard
from printer.marks import Marks
from printer.protocol import (
    HELLO,
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
    frame,
    parse_reply,
)
from printer.refusals import refusal
from printer.report import State
from printer.resends import REPEATS, Resends, Verdict
from printer.safety import leave
from printer.settings import Settings
from printer.waits import Waits
from printer.window import OTHER_MARK, Window
from printer.words import NO_SENSOR, code_of

# Nothing is sent before the ok of these. A line behind M410 is corrupted; behind one that waits for a
# heater or a user, lines would fill the command slots, and M108 and M112 act early only if one is free; one
# that tells a position by itself would answer a mark behind it; and the last mark, behind M400, must be the
# only one whose answer can be heard.
ALONE = frozenset({"M410", "M109", "M190", "M191", "M0", "M1", "M600", "M400", "G28", "G29"})
HEATS = frozenset({"M109", "M190", "M191", "M116", "M303"})
RECOVERY_S = 0.4  # after a resend, silence is broken sooner
HALT_S = 5.0  # for the confirmation of M112
MOST_PROBES = 2  # while a heater is waited for: lines behind it fill the command slots


class Sender:
    """One job on one printer. Feed it with `receive` and `tick`, write what `take_output` gives.

    ``commands`` are clean (see `printer.program`); ``before`` are lines of our own ahead of them.
    ``now`` is any clock in seconds that never runs backwards.
    """

    def __init__(
        self, commands: Sequence[str], settings: Settings, now: float, before: Sequence[str] = ()
    ) -> None:
        self.settings, self.window = settings, Window(commands)
        self.state, self.message, self.paused = State.BOOT, "", False
        self.pending = deque(["M115", *before])  # lines of our own that go next
        self.end, self.tail_given = len(commands), False
        self.resends = Resends(self.window, settings.window_lines)
        self.probe: int | None = None  # the number of the mark that was sent into a silence
        self.alone: int | None = None  # this line goes alone, until it is acknowledged
        self.heating = 0  # the last line that waits for a heater
        self.marks = Marks(self.window, settings.poll_s, now)
        self.waits, self.allowed_s = Waits(self.window), 0.0
        self.room = 0  # free command slots, where the printer tells them
        self.output = bytearray()
        self.begun = self.progressed = now
        self.probes, self.probe_due = 0, now
        self.heard = Heard(now)

    # --- the transitions ---------------------------------------------------------------------------

    def receive(self, lines: Iterable[bytes], now: float) -> None:
        """Take what the printer said, line by line, and then send what fits."""
        for line in lines:
            if not self.state.final:
                self.heard.line(line, now)
                self._react(parse_reply(line), now)
        self._fill(now)

    def _react(self, reply: Reply, now: float) -> None:
        if reply is not PLAIN_OK:
            self.heard.note(reply)
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
                    self.heard.remark(text)

    def _warming(self, now: float) -> None:
        """Heaters are reported while one is waited for. Firmwares differ in how they do that, and it may be
        an automatic report behind which the wait was lost: so ask, but not without end."""
        self.progressed = now
        if self.probes >= MOST_PROBES:
            self.probe_due = now + self.settings.probe_after_s

    def _ok(self, reply: Ok, now: float) -> None:
        window = self.window
        self.heard.answered = True
        expected = self.state is State.HELLO or bool(window.marks) or self.probe is not None
        if self.marks.is_answer(reply, expected):
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
        self._take(number, now)

    def _error(self, error: Error, now: float) -> None:
        """An error that asks for nothing: the end if the firmware has halted, else a matter of record."""
        if self.state is State.ABORT:
            if error.fatal:
                self._end(State.KILLED, f"halted with M112; the printer confirms: {error.text}")
        elif error.fatal:
            self._fail(
                f"the printer stopped, in its own words: {error.text}", "Find the cause, then reset it."
            )
        elif NO_SENSOR.search(error.text):
            if self.window.mark != OTHER_MARK:
                self.window.use_other_mark()
                self.heard.warn("it has no temperature sensor: temperatures are unknown")
                if self.state is State.HELLO:
                    self.resends.swallow = False
                    self._greet(now)
        elif not self._refused(error.text):
            self.heard.warn(f"Error: {error.text}")

    def _refused(self, text: str) -> bool:
        """Whether the firmware says that it has not done something; what the print needs ends the job."""
        found = refusal(text, self.window)
        if found is None:
            return False
        self.heard.refuse(text)
        if found.fatal and self.state is not State.STOP:
            self._fail(found.what, found.advice)
        return True

    def tick(self, now: float) -> None:
        """Take the time: due at `deadline`, harmless earlier."""
        if self.state.final or now < self.deadline:
            return
        silence, stalled = now - self.heard.at, now - self.progressed
        self.heard.silent_until(now)
        self.allowed_s = self.waits.at_most_s() if self.state in (State.RUN, State.STOP) else 0.0
        if self.state is State.ABORT:
            self._end(State.KILLED, "sent M112, which the printer did not confirm: switch it off")
        elif self.state is State.BOOT:
            self._greet(now)
        elif silence >= self.settings.give_up_after_s + self.allowed_s:
            self._fail(
                f"nothing was heard for {silence:.0f} s", "Check the power, the cable and the baud rate."
            )
        elif stalled >= self._patience:
            self._fail(
                f"no line was acknowledged for {stalled:.0f} s", "Check the printer and the baud rate."
            )
        elif self.state is State.HELLO and now >= self.probe_due:
            if self.heard.answered and self.window.mark != OTHER_MARK:
                self.window.use_other_mark()  # it answers, and never with temperatures
            self._greet(now)
        elif self.window.waiting and now >= self.probe_due:
            self._probe(now)
        self._fill(now)

    # --- what others may ask for -------------------------------------------------------------------

    def pause(self, paused: bool = True) -> None:
        """Feed no more lines of the program, or go on; the printer still executes what it has taken."""
        self.paused = paused

    def cancel(self, now: float) -> None:
        """A controlled stop: no more of the program; let the queue end, then leave the print safely."""
        if self.state is State.RUN:
            self.state, self.end = State.STOP, self.window.assigned
            self.pending, self.tail_given = deque(["M400", *leave(self.settings.safety)]), False
            self.output += b"M108\n"  # ends a wait for a heater or a user; its ok acknowledges nothing else
            self.resends.swallow = True
            self._fill(now)
        elif self.state in (State.BOOT, State.HELLO):
            self._end(State.STOPPED, "stopped before the first line")

    def abort(self, now: float) -> None:
        """M112, at once and without a number; nothing else follows."""
        if not self.state.final:
            self.state, self.output, self.progressed = State.ABORT, bytearray(b"\nM112\n"), now

    def lost(self, reason: str) -> None:
        """The port is gone."""
        self._fail(f"the connection broke: {reason}", "Check the cable; the heaters may still be on.")

    def take_output(self) -> bytes:
        """The bytes to write now; they are given once."""
        data = bytes(self.output)
        self.output.clear()
        return data

    @property
    def deadline(self) -> float:
        """When `tick` is due."""
        if self.state is State.BOOT:
            return self.begun + self.settings.boot_wait_s
        if self.state is State.ABORT:
            return self.progressed + HALT_S
        if self.state is State.HELLO or self.window.waiting:
            silence_ends = self.heard.at + self.settings.give_up_after_s + self.allowed_s
            return min(self.probe_due, silence_ends, self.progressed + self._patience)
        return self.marks.polled + self.settings.poll_s

    @property
    def _patience(self) -> float:
        if self.state is State.HELLO:
            return self.settings.give_up_after_s
        return self.settings.stall_after_s + self.allowed_s

    # --- steps -------------------------------------------------------------------------------------

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
        self.probe_due = now + self.settings.probe_after_s * (1 + self.probes) + self.waits.told_s()
        self.heard.messages.append(f"no answer for {now - self.progressed:.0f} s: asking the printer")

    def _greet(self, now: float) -> None:
        """Set the printer's counter to 0 and send line 1, a mark, whose answer tells that it worked."""
        if self.state is State.BOOT:
            self.progressed = self.heard.at = now
            self.window.assign(self.window.mark)
        self.window.rename(1, self.window.mark)
        self.state, self.probe_due = State.HELLO, now + self.settings.probe_after_s
        self.output += b"\n" + HELLO + frame(1, self.window.mark)

    def _obey(self, name: str, now: float) -> None:
        """Host actions; any other is only shown."""
        if name in ("pause", "paused", "resume", "resumed"):
            self.paused = name.startswith("pause")
        elif name == "cancel":
            self.cancel(now)

    def _alive(self, now: float) -> None:
        if self.state is not State.ABORT:
            self.progressed, self.probes, self.allowed_s = now, 0, 0.0
            after = self.settings.probe_after_s
            self.probe_due = now + (min(RECOVERY_S, after) if self.resends.open else after)

    def _lose(self, what: str) -> None:
        self._fail(what, "It has forgotten its position; nothing more was sent.")

    def _fail(self, what: str, advice: str) -> None:
        heard = (
            f"The last thing heard was {self.heard.last_words!r}" if self.heard.last else "It never answered"
        )
        if self.state in (State.BOOT, State.HELLO):
            advice += " A printer that was halted (M112, an error) answers again when it has been reset."
        self._end(State.FAILED, f"{what}. {heard}. {advice}")

    def _end(self, state: State, message: str) -> None:
        if not self.state.final:
            self.state, self.message = state, message
