"""When to send a mark, and which reply is the answer to one."""

from printer.in_flight import OTHER_MARK, Window
from printer.protocol import Ok

EVERY = 64  # lines without a mark, at the most
UNASKED = 2  # oks with temperatures that nobody asked for, after which they are oks like any other


class Marks:
    """The marks among the lines of ``window``; one is due every ``poll_s`` seconds."""

    def __init__(self, window: Window, poll_s: float, now: float) -> None:
        self.window, self.poll_s, self.polled = window, poll_s, now
        self._last = 0  # the number of the last one
        self._unasked = 0  # oks with temperatures while none was in flight

    def soon(self, now: float) -> None:
        """The count of oks is in doubt."""
        self.polled = now - self.poll_s

    def due(self, now: float) -> bool:
        """Now and then, and before more lines than a mistaken count may span."""
        late = now - self.polled >= self.poll_s or self.window.top - self._last >= EVERY
        return late and not self.window.marks

    def assign(self, now: float) -> int:
        """Give the next number to a mark."""
        self.polled = now
        self._last = self.window.assign(self.window.mark)
        return self._last

    def is_answer(self, reply: Ok, expected: bool) -> bool:
        """Whether an ok can only be that of a mark; ``expected`` says that one is under way.

        A printer that puts temperatures behind every ok is found out, and asked for its position instead.
        """
        if self.window.mark == OTHER_MARK:
            return reply.axes is not None
        if reply.readings is None or expected:
            return reply.readings is not None
        self._unasked += 1
        if self._unasked >= UNASKED:
            self.window.use_other_mark()
        return False
