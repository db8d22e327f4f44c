"""What to make of a request for a line: obey it, wait for a clearer one, or see that the printer is lost."""

from enum import Enum

from printer.in_flight import Window

REPEATS = 25
"""Requests for one line, or for impossible ones, after which the job fails."""

FAR = 16
"""Lines beyond the window by which a count of oks is never mistaken: a printer that holds more of them has
lost some, and asks."""


class Verdict(Enum):
    """What a request for a line means."""

    OBEY = "send everything from it again"
    IGNORE = "an echo, or damaged: its next repeat, or the probe, brings the true one"
    LOST = "it has forgotten where it was"
    GIVE_UP = "it asks in vain"


class Resends:
    """The requests of one job.

    A request is never obeyed if the printer has taken that line beyond doubt: a printer that was reset asks
    for line 1, and everything would be printed again. One that is damaged looks the same, so it takes two
    of them, or the error before it that names the same line, to end a job.
    """

    def __init__(self, window: Window, window_lines: int) -> None:
        self.window, self._far = window, FAR + window_lines
        self.swallow = False  # the next plain ok belongs to a request, and acknowledges nothing
        self.asked, self.late, self.repeats = 0, 0, 0  # the last one obeyed, its echoes to come, their count
        self.open = False  # the line asked for has not been taken yet
        self._doubted: int | None = None  # one that was not believed when it came first
        self._last: int | None = None  # what the error before it named as the last line taken
        self._ok_follows = True  # whether this firmware says ok behind a request
        self._swallowed = False  # an ok was taken for that of the last request

    def announced(self, last: int | None) -> None:
        """An error says that a request comes."""
        self._last, self.swallow = last, self._ok_follows

    def ok(self) -> bool:
        """A plain ok came; whether it belongs to a request."""
        if not self.swallow:
            return False
        self.swallow, self._swallowed = False, True
        return True

    def taken(self, through: int) -> None:
        """The printer has taken all lines up to and with ``through``."""
        if through >= self.asked:
            self.repeats, self.open = 0, False

    def missed(self) -> None:
        """All before some later line was taken. If the ok of the line asked for was not counted by then, it
        went for one of the request, which on this printer has none."""
        if self._swallowed and self.window.acked == self.asked:
            self._ok_follows = self.swallow = False

    def judge(self, number: int | None) -> Verdict:
        """A request for line ``number`` came (None: unreadable)."""
        window, last = self.window, self._last
        self._last = None
        if number is not None and number == self.asked + 1:
            self.missed()
        self.swallow, self._swallowed = self._ok_follows, False
        if number is not None and number == self.asked and self.late > 0:
            self.late -= 1  # the echo of a line that was under way when we acted
            return Verdict.IGNORE
        self.repeats += 1
        if self.repeats > REPEATS:
            return Verdict.GIVE_UP
        if number is None or not 1 <= number <= window.top:
            return Verdict.IGNORE
        if number < max(window.proved, window.acked - self._far):
            sure = number in (self._doubted, None if last is None else last + 1)
            self._doubted = number
            return Verdict.LOST if sure else Verdict.IGNORE
        self._doubted = None
        return Verdict.OBEY

    def obeyed(self, number: int) -> None:
        """Everything from ``number`` goes again; the lines that are under way will ask for it too."""
        self.open = True
        self.asked, self.late = number, max(0, self.window.sent - number - 1)
