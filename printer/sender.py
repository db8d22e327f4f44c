"""The streaming state machine: replies and time in, bytes out. No port, no thread and no clock in here.

Counting oks only bounds what is in flight. An ok can be lost, doubled, or belong to a damaged line that
the printer took for an unknown command; a mark (see `printer.window`) among the lines sets the count
right again, and the last one proves that all has arrived.
"""

from collections import deque
from collections.abc import Iterable, Sequence

from printer.heard import Heard
from printer.protocol import (
    HELLO,
    PLAIN_OK,
    Action,
    Busy,
    Error,
    Ok,
    Other,
    Reply,
    Resend,
    Start,
    Temperature,
    frame,
    parse_reply,
)
from printer.report import State
from printer.safety import leave
from printer.settings import Settings
from printer.window import MARK, Window

# Nothing is sent before the ok of these. A line behind M410 is corrupted; behind one that waits for a
# heater or a user, lines would fill the command slots, and M108 and M112 act early only if one is free.
ALONE = frozenset({"M410", "M109", "M190", "M191", "M0", "M1", "M600"})
REPEATS = 25  # requests for one line, or for impossible ones, after which the job fails
FAR = 100  # lines behind the acknowledged one; a Resend from further back is obeyed when it is repeated


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
        self.probe: int | None = None  # the number of the mark that was sent into a silence
        self.swallow = False  # the next plain ok belongs to a Resend
        self.alone: int | None = None  # this line goes alone, until it is acknowledged
        self.asked, self.late, self.repeats = 0, 0, 0  # the last Resend, its echoes to come, its count
        self.doubted = 0  # a Resend that was not believed when it came first
        self.room = 0  # free command slots, where the printer tells them
        self.output = bytearray()
        self.begun = self.progressed = self.polled = now
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
        window = self.window
        if reply is not PLAIN_OK:
            self.heard.note(reply)
        match reply:
            case Ok(readings=readings) if self.state is State.HELLO:
                if readings is not None:  # the first mark: the printer counts from 0 now
                    self.state = State.RUN
                    self._take(1, now)
            case Ok(number, _, buffer, readings):
                if readings is not None:
                    if number is not None and number < window.sent:
                        self._take(number, now)
                    elif self.probe is not None or window.marks:
                        self._take(window.marks[0] if self.probe is None else self.probe, now)
                elif number is not None and number < window.sent:
                    self.room, self.swallow = buffer or 0, False
                    self._take(number, now)
                elif self.swallow:
                    self.swallow = False
                elif window.lines and not (window.marks and window.marks[0] == window.acked):
                    self._take(window.acked, now)  # else it is one ok too many
            case Resend(number):
                self._rewind(number, now)
            case Error(resend=True):
                self.swallow = True
            case Error(text) if self.state is State.ABORT:
                self._end(State.KILLED, f"halted with M112; the printer confirms: {text}")
            case Error(text):
                self._fail(f"the printer stopped, in its own words: {text}", "Find the cause, then reset it.")
            case Start() if self.state in (State.BOOT, State.HELLO):
                self._greet(now)
            case Start():
                self._fail("the printer was reset in the middle of the job", "It has forgotten its position.")
            case Busy() | Temperature(waiting=True):
                self._alive(now)
            case Action(name):
                self._obey(name, now)
            case Other(text):
                self.heard.remark(text)

    def tick(self, now: float) -> None:
        """Take the time: due at `deadline`, harmless earlier."""
        if self.state.final or now < self.deadline:
            return
        settings, silence, stalled = self.settings, now - self.heard.at, now - self.progressed
        self.heard.silent_until(now)
        if self.state is State.ABORT:
            self._end(State.KILLED, "halted with M112; the printer did not confirm it: switch it off")
        elif self.state is State.BOOT:
            self._greet(now)
        elif silence >= settings.give_up_after_s:
            self._fail(
                f"nothing was heard for {silence:.0f} s", "Check the power, the cable and the baud rate."
            )
        elif stalled >= self._patience:
            self._fail(
                f"no line was acknowledged for {stalled:.0f} s", "Check the printer and the baud rate."
            )
        elif self.state is State.HELLO:
            self._greet(now)
        elif self.window.waiting:
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
            self.swallow = True
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
            return self.progressed + self.settings.probe_after_s
        if self.state is State.HELLO or self.window.waiting:
            silence_ends = self.heard.at + self.settings.give_up_after_s
            return min(self.probe_due, silence_ends, self.progressed + self._patience)
        return self.polled + self.settings.poll_s

    @property
    def _patience(self) -> float:
        return self.settings.give_up_after_s if self.state is State.HELLO else self.settings.stall_after_s

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
            if command[0] == "M" and command.split(maxsplit=1)[0] in ALONE:
                self.alone = window.sent
            self.output += window.send()
        if self.tail_given and not self.pending and not window.waiting:
            self._end(State.FINISHED if self.state is State.RUN else State.STOPPED, "")

    def _assign(self, now: float) -> bool:
        """Give the next number to a line, if there is one."""
        window = self.window
        left = window.assigned < self.end
        if not self.pending and not left and not self.tail_given:
            self.pending.extend(["M400", MARK])
            self.tail_given = True
        if self.pending:
            window.assign(self.pending.popleft())
        elif now - self.polled >= self.settings.poll_s and not window.marks and not self.tail_given:
            self.polled = now
            window.assign(MARK)
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
        if through >= self.asked:
            self.repeats = 0
        self._alive(now)

    def _rewind(self, number: int | None, now: float) -> None:
        """Resend: act once, and send the line alone until the printer has taken it."""
        self.swallow = True
        if self.state is State.HELLO:
            self._greet(now)
        if self.state not in (State.RUN, State.STOP):
            return
        if number is not None and number == self.asked and self.late > 0:
            self.late -= 1  # the echo of a line that was under way when we acted
            return
        self.repeats += 1
        if self.repeats > REPEATS:
            self._fail(
                f"the printer asked {REPEATS} times in vain for a line, at last for {number} of "
                f"{self.window.top - 1} that were sent",
                "Something damages each copy of that line: check the cable, the baud rate and the firmware.",
            )
        elif number is not None and self._is_plausible(number):
            if self.probe is not None:
                self.window.take(number - 1)  # after a silence, no ok of those is to be expected
            self.asked, self.late, self.probe = number, max(0, self.window.sent - number - 1), None
            self.window.rewind(number)
            self.alone = number
            self.polled = now - self.settings.poll_s  # a mark soon: the count of oks is in doubt
            self._alive(now)
        # else the number was damaged: its next repeat, or the probe, brings the true one

    def _is_plausible(self, number: int) -> bool:
        """Whether a Resend may be believed: a lost digit must not send half the job again."""
        if not 1 <= number <= self.window.top:
            return False
        believed = number >= self.window.acked - FAR or number == self.doubted
        self.doubted = number
        return believed

    def _probe(self, now: float) -> None:
        """Break a silence: end a half line, and send a mark whose number was never used before.

        If the printer takes it, all before it was taken; if not, this brings the Resend that was lost.
        """
        self.probes += 1
        self.late = 0
        self.probe = self.window.assign(MARK)
        data = frame(self.probe, MARK)
        if self.window.sent == self.probe:
            self.window.send()
        self.output += b"\n" + data
        self.probe_due = now + self.settings.probe_after_s * (1 + self.probes)
        self.heard.messages.append(f"no answer for {now - self.progressed:.0f} s: asking the printer")

    def _greet(self, now: float) -> None:
        """Set the printer's counter to 0 and send line 1, a mark, whose answer tells that it worked."""
        if self.state is State.BOOT:
            self.progressed = self.heard.at = now
            self.window.assign(MARK)
        self.state, self.probe_due = State.HELLO, now + self.settings.probe_after_s
        self.output += b"\n" + HELLO + frame(1, MARK)

    def _obey(self, name: str, now: float) -> None:
        """Host actions; any other is only shown."""
        if name in ("pause", "paused", "resume", "resumed"):
            self.paused = name.startswith("pause")
        elif name == "cancel":
            self.cancel(now)

    def _alive(self, now: float) -> None:
        self.progressed, self.probes = now, 0
        self.probe_due = now + self.settings.probe_after_s

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
