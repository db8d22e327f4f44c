"""Numbered lines: what each number means for ever, and which of them are in flight.

A *number* names one line on the wire and never changes its meaning, so that a printer that takes every
number once, in order, prints every line once, whatever is lost, repeated or mistaken on the way::

    1 <= proved <= acked <= sent <= top
    [1, proved)     taken beyond doubt: a mark was answered; never sent again
    [proved, acked) taken by the count of oks, which may be mistaken
    [acked, sent)   in flight: sent, and not acknowledged yet
    [sent, top)     to be sent again, after a Resend
    top             the next number that gets a meaning: a line of the program, or one of our own
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence

from printer.protocol import frame

MARK = "M105"
"""Its answer, ``ok T:..``, is unlike every other ok, so it tells exactly which lines were taken."""

FORGOTTEN_S = 60.0
"""Age of a mark after which its answer is no longer to be expected."""

OTHER_MARK = "M114"
"""The mark for a printer without sensors, or one that puts temperatures behind every ok: it answers with a
position."""


class Window:
    """The numbers of one job. ``commands`` are the program's, clean."""

    def __init__(self, commands: Sequence[str]) -> None:
        self.commands = commands
        self.proved = self.acked = self.sent = self.top = 1
        self.bytes = 0  # in flight
        self.mark = MARK
        self.marks: deque[int] = deque()  # numbers of the marks in flight
        self._unanswered: deque[tuple[int, float]] = deque()  # marks and probes, and when they went
        self.resent = 0
        self._furthest = 1  # one more than the highest number that was ever sent
        self._sizes: deque[int] = deque()  # bytes of each line in flight
        self._framed: tuple[int, str, bytes] = (0, "", b"")  # the line at ``sent``, until it is sent
        self._own: dict[int, str] = {}  # numbers that carry no line of the program
        self._own_numbers: list[int] = []  # the same, ascending

    @property
    def lines(self) -> int:
        """Lines in flight."""
        return self.sent - self.acked

    @property
    def waiting(self) -> bool:
        """Whether some number has a meaning that the printer has not taken yet."""
        return self.acked < self.top

    @property
    def assigned(self) -> int:
        """Commands of the program that have a number."""
        return self.top - 1 - len(self._own)

    @property
    def acknowledged(self) -> int:
        """Commands of the program that the printer has taken."""
        return self.index(self.acked)

    def command(self, number: int) -> str:
        """The line that ``number`` means."""
        own = self._own.get(number)
        return self.commands[self.index(number)] if own is None else own

    def assign(self, own: str | None = None) -> int:
        """Give the number ``top`` to a line of our own, or to the program's next; return the number."""
        number = self.top
        if own is not None:
            self._own[number] = own
            self._own_numbers.append(number)
        self.top += 1
        return number

    def next_line(self) -> tuple[str, bytes]:
        """The line at ``sent``, bare and framed."""
        number, command, data = self._framed
        if number != self.sent:
            command = self.command(self.sent)
            data = frame(self.sent, command)
            self._framed = (self.sent, command, data)
        return command, data

    def send(self) -> bytes:
        """The line at ``sent`` is under way; gives it, framed."""
        command, data = self.next_line()
        if self.sent < self._furthest:
            self.resent += 1
        else:
            self._furthest = self.sent + 1
        if command == self.mark:
            self.marks.append(self.sent)
        self._sizes.append(len(data))
        self.bytes += len(data)
        self.sent += 1
        return data

    def use_other_mark(self) -> None:
        """The answers to M105 tell nothing here: those that are in flight are lines like any other."""
        self.mark = OTHER_MARK
        self.marks.clear()
        self._unanswered.clear()

    def rename(self, number: int, own: str) -> None:
        """Let a line of our own that the printer has not taken mean something else."""
        self._own[number] = own
        self._framed = (0, "", b"")

    def prove(self, through: int) -> None:
        """The printer has taken every line up to and with ``through``, beyond doubt."""
        self.take(through)
        self.proved = max(self.proved, through + 1)

    def await_answer(self, mark: int, now: float) -> None:
        """A mark, or a probe, is on its way to the printer."""
        self._unanswered.append((mark, now))

    def prove_answered(self, now: float) -> None:
        """An answer to a mark was heard. It is a proof if it can be that of one mark alone, and if it is not
        a doubled one, so that the count of oks agrees."""
        while self._unanswered and now - self._unanswered[0][1] > FORGOTTEN_S:
            self._unanswered.popleft()  # its answer was lost
        if not self._unanswered:
            return
        mark, _ = self._unanswered.popleft()
        if not self._unanswered and mark <= self.acked:
            self.proved = max(self.proved, mark + 1)

    def is_own(self, number: int) -> bool:
        """Whether ``number`` carries a line of our own."""
        return number in self._own

    def own_taken(self) -> list[tuple[int, str]]:
        """The lines of our own that the printer has taken, with their numbers."""
        return [(number, line) for number, line in self._own.items() if number < self.acked]

    def index(self, number: int) -> int:
        """How many commands of the program have a number below ``number``."""
        return number - 1 - bisect_left(self._own_numbers, number)

    def take(self, through: int) -> None:
        """The printer has taken every line up to and with ``through``, by the count of its oks."""
        while self._sizes and self.acked <= through:
            self.bytes -= self._sizes.popleft()
            self.acked += 1
        if self.acked <= through:
            self.acked = through + 1
        if self.sent < self.acked:
            self.sent = self.acked
        while self.marks and self.marks[0] <= through:
            self.marks.popleft()

    def rewind(self, number: int) -> None:
        """Send everything from ``number`` again; what is before it has arrived."""
        while self._sizes and self.sent > number:
            self.bytes -= self._sizes.pop()
            self.sent -= 1
        while self.marks and self.marks[-1] >= number:
            self.marks.pop()
        if self.sent != number:  # an ok was counted too often, or an earlier Resend was a damaged one
            self.acked = self.sent = number
            self.bytes = 0
            self._sizes.clear()
            self.marks.clear()
