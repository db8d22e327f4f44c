"""What was asked of a printer by hand, and what it has answered: which commands are still outstanding."""

import threading
import time

from printer.protocol import Busy, Error, Ok, Temperature, parse_reply

SILENCE_S = 6.0
"""Three times the interval at which a busy printer says so: behind that, an answer is not to be expected."""

MOST_LINES = 4
MOST_BYTES = 127
"""What a printer keeps without losing any: its command slots and its receive buffer."""

UNANSWERED = ("M112", "M108", "M410", "M876")
"""Obeyed on reception where the firmware can: whether an ok follows is its own affair."""


class Conversation:
    """Counts commands and oks. `sent` in one thread, `heard` in another; `wait` in the first."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: list[str] = []  # without an ok so far, the oldest first
        self._alive_at = time.monotonic()
        self.ended = False  # the printer has halted, or the connection is broken

    def sent(self, command: str) -> None:
        """A command goes to the printer now."""
        with self._changed:
            if not self._waiting:
                self._alive_at = time.monotonic()
            if not command.startswith(UNANSWERED):
                self._waiting.append(command)

    def heard(self, line: bytes) -> None:
        """The printer said something."""
        reply = parse_reply(line)
        with self._changed:
            if isinstance(reply, Ok):
                del self._waiting[:1]
            if isinstance(reply, Ok | Busy) or (isinstance(reply, Temperature) and reply.waiting):
                self._alive_at = time.monotonic()  # a report that comes by itself is no sign of progress
            if isinstance(reply, Error) and reply.fatal:
                self.ended = True
            self._changed.notify_all()

    def end(self) -> None:
        """Nothing more will be heard."""
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def wait(self, room_for: str | None = None) -> list[str]:
        """Wait until all is answered, or there is room for one more command; what is outstanding still.

        Ends too when the printer has been silent for so long that no answer is to be expected.
        """
        with self._changed:
            while self._waiting and not self.ended and not self._has(room_for):
                left_s = self._alive_at + SILENCE_S - time.monotonic()
                if left_s <= 0:
                    break
                self._changed.wait(left_s)
            return [] if self._has(room_for) else list(self._waiting)

    def _has(self, room_for: str | None) -> bool:
        if room_for is None:
            return not self._waiting
        size = sum(len(command.encode(errors="replace")) + 1 for command in (*self._waiting, room_for))
        return not self._waiting or (len(self._waiting) < MOST_LINES and size <= MOST_BYTES)
