"""An emulated printer behind a pseudo-terminal: a device path that any host opens like a USB port."""

import math
import os
import select
import time
import tty
from contextlib import suppress

from printer.emulator.firmware import Firmware


class PtyPrinter:
    """Serves one printer. ``path`` is what a host opens; it may come and go. POSIX only.

    With ``fast`` the time jumps whenever the printer waits for nothing but its own clock.
    """

    def __init__(self, firmware: Firmware, fast: bool = False) -> None:
        self.firmware, self.fast = firmware, fast
        self._wake_read, self._wake_write = os.pipe()
        self._origin = time.monotonic() - firmware.now
        self._open()

    def _open(self) -> None:
        # The host's end is kept open here too: else every host that leaves would hang up the line.
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.path = os.ttyname(self._theirs)

    def serve(self) -> None:
        """Serve until `stop` is called, or until the printer pulls the cable (a scripted fault)."""
        while self.firmware.connected:
            waiting = select.select([self._ours, self._wake_read], [], [], self._patience())[0]
            if self._wake_read in waiting:
                return
            if not self.fast:
                self.firmware.advance(time.monotonic() - self._origin)
            if self._ours in waiting:
                self.firmware.receive(os.read(self._ours, 4096))
            elif self.fast and (event := self._next()) < math.inf:
                self.firmware.advance(max(event, self.firmware.now))
            self._answer()
        self.hang_up()

    def stop(self) -> None:
        """Make `serve` return; for other threads."""
        with suppress(OSError):  # closed already: then it has returned
            os.write(self._wake_write, b"x")

    def hang_up(self) -> None:
        """Pull the cable: the host sees an I/O error. `plug_in` gives a new path."""
        for handle in (self._ours, self._theirs):
            os.close(handle)
        self._ours = self._theirs = -1

    def plug_in(self) -> None:
        """Connect the same printer to a new pseudo-terminal."""
        self.firmware.connected = True
        self._open()

    def close(self) -> None:
        """Give all handles back."""
        if self._ours >= 0:
            self.hang_up()
        for handle in (self._wake_read, self._wake_write):
            os.close(handle)

    def _next(self) -> float:
        return min(self.firmware.next_event(), self.firmware.next_output())

    def _patience(self) -> float | None:
        event = self._next()
        if event == math.inf:
            return None
        return 0.0 if self.fast else max(0.0, event - (time.monotonic() - self._origin))

    def _answer(self) -> None:
        data = self.firmware.read()
        while data:
            try:
                data = data[os.write(self._ours, data) :]
            except BlockingIOError:
                return  # nobody reads: as with a real cable, it is gone
