"""Numbered lines: what each number means for ever, and which of them are under way.

A *number* names one line on the wire and never changes its meaning, so that a printer that takes every
number once, in order, prints every line once, whatever is lost, repeated or mistaken on the way::

    1 <= acked <= sent <= top
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


class Window:
    """The numbers of one job. ``commands`` are the program's, clean."""

    def __init__(self, commands: Sequence[str]) -> None:
        self.commands = commands
        self.acked = self.sent = self.top = 1
        self.bytes = 0  # in flight
        self.marks: deque[int] = deque()  # in flight and MARK
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
        return self.acked - 1 - bisect_left(self._own_numbers, self.acked)

    def command(self, number: int) -> str:
        """The line that ``number`` means."""
        own = self._own.get(number)
        return self.commands[number - 1 - bisect_left(self._own_numbers, number)] if own is None else own

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
        if command == MARK:
            self.marks.append(self.sent)
        self._sizes.append(len(data))
        self.bytes += len(data)
        self.sent += 1
        return data

    def take(self, through: int) -> None:
        """The printer has taken every line up to and with ``through``."""
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
