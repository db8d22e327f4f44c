"""``marlin://``: an emulated Marlin as a pyserial port.

``marlin://?clock=fast&seed=3&corrupt=3e-4&fault=resend@20`` opens a printer of its own;
``marlin://NAME?..`` names one, which stays switched on when the port is closed, so that the next port of
that name finds it as it was. Options are the fields of `printer.emulator.firmware.Options` and of
`printer.emulator.faults.Faults`, ``fault=KIND@LINE``, ``odd=WAY`` (both repeatable,
``odd`` of `printer.emulator.odd.ODD`) and ``clock``:

real   time passes as outside
fast   whenever the host waits, the time jumps to what happens next; `Serial.clock` tells it
"""

import dataclasses
import threading
import time
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from serial.serialutil import PortNotOpenError, SerialBase, SerialException

from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import Firmware
from printer.emulator.odd import ODD
from printer.errors import OptionError

LIMITS: dict[str, tuple[float, float]] = {
    "seed": (0, 2**64 - 1),
    "slots": (1, 10_000),
    "rx": (1, 1_000_000),
    "blocks": (1, 10_000),
    "command_s": (0, 3600),
    "delay_s": (0, 3600),
    "homing_s": (0, 3600),
}
"""Least and greatest value of an option that is a number; all others are probabilities."""

PAIRS = (("corrupt", "drop"), ("reply_corrupt", "reply_drop"), ("ok_drop", "ok_duplicate"))
"""Probabilities that exclude each other: together they are one at most."""

TRUTH = {"0": False, "1": True, "false": False, "true": True}

POWERED: dict[str, Firmware] = {}
"""The named printers that are switched on in this process."""


def printer_from_url(url: str) -> tuple[Firmware, str]:
    """The printer that a URL describes, and its clock: "real" or "fast".

    Raises:
        OptionError: for an option that does not exist or a value that it cannot have.
    """
    parts = urlsplit(url)
    if parts.fragment:
        raise OptionError(f"{url}: '#{parts.fragment}' is no option. See 'vslice emulate --help'.")
    options, faults, clock = Options(), Faults(), "real"
    given: dict[str, Any] = {}
    odd: set[str] = set()
    for key, value in parse_qsl(parts.query):
        if key == "clock" and value in ("real", "fast"):
            clock = value
        elif key == "fault":
            faults.script(value)
        elif key == "odd":
            if value not in ODD:
                raise OptionError(f"marlin://: odd={value[:40]!r} must be one of {', '.join(ODD)}.")
            odd.add(value)
        elif key in given:
            raise OptionError(f"marlin://: {key} is given twice.")
        else:
            given[key] = value
    faults = _filled(faults, given)
    options = dataclasses.replace(_filled(options, given), faults=faults, odd=frozenset(odd))
    for one, other in PAIRS:
        if (both := getattr(faults, one) + getattr(faults, other)) > 1:
            raise OptionError(f"marlin://: {one} and {other} come to {both:g}; together they may be 1.")
    if given:
        raise OptionError(f"{url}: unknown option {', '.join(given)}. See 'vslice emulate --help'.")
    name = parts.netloc
    if name and name in POWERED:
        return POWERED[name], clock
    firmware = Firmware(options)
    if name:
        POWERED[name] = firmware
    return firmware, clock


def _filled(record: Any, given: dict[str, str]) -> Any:
    """``record`` with the fields that ``given`` names; they are taken out of ``given``."""
    values: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        current = getattr(record, field.name)
        if field.name in given and isinstance(current, int | float):
            text = given.pop(field.name)
            kind = type(current).__name__
            try:
                if isinstance(current, bool):
                    values[field.name] = TRUTH[text]
                elif "_" in text:  # Python would read it as a number
                    raise ValueError
                else:
                    values[field.name] = type(current)(text)
            except (ValueError, KeyError) as error:
                wanted = {"bool": "0 or 1", "int": "a whole number", "float": "a number"}[kind]
                raise OptionError(f"marlin://: {field.name}={text[:40]!r} must be {wanted}.") from error
            low, high = LIMITS.get(field.name, (0, 1))
            if not low <= values[field.name] <= high:  # no comparison holds for NaN
                raise OptionError(
                    f"marlin://: {field.name}={text[:40]} must lie between {low} and {high:.20g}."
                )
    return dataclasses.replace(record, **values)


class Serial(SerialBase):
    """An emulated printer behind the interface of a serial port. ``firmware`` is the printer itself."""

    BAUDRATES = (9600, 19200, 38400, 57600, 115200, 250000, 500000, 1000000)

    def __init__(
        self, *args: Any, firmware: Firmware | None = None, fast: bool = False, **kwargs: Any
    ) -> None:
        self._given = firmware
        self._fast = fast
        self._changed = threading.Condition()
        self._canceled = False
        super().__init__(*args, **kwargs)

    def open(self) -> None:
        """Switch the printer on, or connect to the one of that name.

        Raises:
            SerialException: if the URL is not understood, or the port is open already.
        """
        if self.is_open:
            raise SerialException("Port is already open.")
        try:
            firmware, clock = printer_from_url(self.portstr or "marlin://")
        except OptionError as error:
            raise SerialException(str(error)) from error
        if self._given is None:
            self.firmware, self._fast = firmware, clock == "fast"
        else:
            self.firmware = self._given
        self.firmware.connected = True
        self._origin = time.monotonic() - self.firmware.now
        self._buffer = bytearray()
        self.is_open = True

    def close(self) -> None:
        """Pull the plug of the cable; the printer stays on."""
        with self._changed:
            self.is_open = False
            self._changed.notify_all()

    def clock(self) -> float:
        """The printer's time in s: what a sender shall measure its timeouts with."""
        return self.firmware.now if self._fast else time.monotonic()

    def _reconfigure_port(self) -> None:
        """A printer without a wire has no baud rate."""

    def _update_dtr_state(self) -> None:
        """The emulated board does not reset on DTR."""

    def _update_rts_state(self) -> None:
        """Nothing listens to RTS."""

    def _check(self) -> None:
        if not self.is_open:
            raise PortNotOpenError()
        if not self.firmware.connected:
            raise SerialException("the cable was pulled (a scripted fault)")

    def _pull(self) -> None:
        if not self._fast:
            self.firmware.advance(time.monotonic() - self._origin)
        self._buffer += self.firmware.read()

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""
        with self._changed:
            self._check()
            self._pull()
            return len(self._buffer)

    def write(self, data: Any, /) -> int:
        """Send bytes to the printer."""
        with self._changed:
            self._check()
            self._pull()
            raw = bytes(data)
            self.firmware.receive(raw)
            self._changed.notify_all()
            return len(raw)

    def read(self, size: int = 1, /) -> bytes:
        """Up to ``size`` bytes: waits for the first until the timeout, and gives what is there then.

        (Other ports wait until all ``size`` have come; a sender asks for what is waiting anyway.)
        """
        with self._changed:
            self._check()
            self._pull()
            now = self.firmware.now
            until = now + self.timeout if self.timeout is not None else float("inf")
            while not self._buffer and not self._canceled and self.firmware.now < until:
                self._wait(until)
                self._check()
                self._pull()
            self._canceled = False
            data = bytes(self._buffer[:size])
            del self._buffer[: len(data)]
            return data

    def _wait(self, until: float) -> None:
        """Let time pass until something may have happened, at the latest at ``until``."""
        firmware = self.firmware
        target = min(until, firmware.next_event(), firmware.next_output())
        if self._fast and target != float("inf"):
            firmware.advance(max(target, firmware.now))
        else:
            delay = target - (time.monotonic() - self._origin)
            self._changed.wait(None if target == float("inf") else max(0.0, delay))

    def cancel_read(self) -> None:
        """Make a `read` that waits return."""
        with self._changed:
            self._canceled = True
            self._changed.notify_all()

    def flush(self) -> None:
        """All bytes have arrived already."""

    def reset_input_buffer(self) -> None:
        """Forget what was not read."""
        with self._changed:
            self._pull()
            self._buffer.clear()

    def reset_output_buffer(self) -> None:
        """Nothing waits to be sent."""
