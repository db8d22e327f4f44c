"""The language between a host and Marlin: numbered lines out, replies in. Pure functions, no I/O.

The facts come from a natively built Marlin (bugfix-2.1.x of 2025-02); docs/streaming.md lists them.
"""

import re
from dataclasses import dataclass
from typing import TypeAlias

from dialect import reader
from dialect.errors import ReadError
from dialect.line_limits import MAX_LINE, fault_of, unescaped
from dialect.reader import checksum
from printer.errors import ProtocolError
from printer.firmware_words import FATAL, RESET, START

__all__ = ["MAX_LINE", "checksum", "clean", "fault_of", "frame", "parse_reply", "unescaped"]

HELLO = b"N0 M110 N0*125\n"
"""Sets the line counter to 0; Marlin obeys it on reception, before the lines that it has queued."""

# --- out: from a line of a program to a line on the wire ---------------------------------------------


def clean(line: str) -> str:
    """A single line as Marlin wants it; "" for one that holds no command, for Marlin answers it with nothing.

    Raises:
        ProtocolError: if it is no command.
    """
    try:
        return reader.clean(line)
    except ReadError as error:
        raise ProtocolError(f"{line[:40]!a}: {error}") from None


def frame(number: int, command: str) -> bytes:
    """The bytes that carry ``command`` as line ``number``: ``N3 G1 X5*46`` and a newline.

    The checksum is over what Marlin keeps, which is the line without its escapes.
    """
    line = b"N%d %s" % (number, command.encode())
    return b"%s*%d\n" % (line, checksum(unescaped(line) if b"\\" in line else line))


# --- in: from bytes of the printer to a value --------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Ok:
    """The printer took one command. ``number``, ``planner``, ``buffer`` are N, P and B of ADVANCED_OK:
    the line, the free planner blocks and the free command slots. ``readings`` are those of M105, ``axes``
    those of M114, which some firmwares put behind the ok."""

    number: int | None = None
    planner: int | None = None
    buffer: int | None = None
    readings: "dict[str, Reading] | None" = None
    axes: dict[str, float] | None = None


@dataclass(frozen=True, slots=True)
class Reading:
    """One heater in degrees Celsius: where it is and where it shall be (None if not told)."""

    actual: float
    target: float | None = None


@dataclass(frozen=True, slots=True)
class Resend:
    """The printer wants everything from line ``number`` again; None if the number is unreadable."""

    number: int | None


@dataclass(frozen=True, slots=True)
class Error:
    """An ``Error:`` line. ``resend`` is true if it only announces a Resend, with ``last`` the last line that
    the printer took, if it says so; ``fatal`` if the firmware has halted."""

    text: str
    resend: bool
    last: int | None = None
    fatal: bool = False


@dataclass(frozen=True, slots=True)
class Busy:
    """A sign of life during a long command; it acknowledges nothing."""

    text: str


@dataclass(frozen=True, slots=True)
class Temperature:
    """A report of heaters without an ok. ``waiting`` is true inside M109 or M190."""

    readings: dict[str, Reading]
    waiting: bool


@dataclass(frozen=True, slots=True)
class Action:
    """A request to the host: ``//action:name argument``."""

    name: str
    argument: str


@dataclass(frozen=True, slots=True)
class Start:
    """The printer has just booted, and knows neither its position nor its line counter. ``clear`` is false
    where it was only glued to something else, or said in other words than ``start``."""

    clear: bool = True


@dataclass(frozen=True, slots=True)
class Position:
    """The planned position in mm, of M114 or after homing."""

    axes: dict[str, float]


@dataclass(frozen=True, slots=True)
class Capability:
    """One ``Cap:NAME:0|1`` line of M115."""

    name: str
    enabled: bool


@dataclass(frozen=True, slots=True)
class Other:
    """Anything else: an echo, a boot message, garbage."""

    text: str


Reply: TypeAlias = Ok | Resend | Error | Busy | Temperature | Action | Start | Position | Capability | Other

PLAIN_OK = Ok()
OK = re.compile(r"ok(?=$|[\s:])(.*)", re.DOTALL | re.IGNORECASE)
ADVANCED = re.compile(r"\b([NPB])(\d{1,9})\b")
RESEND = re.compile(r"(?:resend|rs)\s*:?\s*(?:N\s*:?\s*)?(-?\d{1,10})?(?![\d.])", re.IGNORECASE)
HEATER = re.compile(r"\b(T\d?|B|C|P|R)\s*:\s*(-?\d{1,5}(?:\.\d*)?)(?:\s*/\s*(-?\d{1,5}(?:\.\d*)?))?")
TEMPERATURE = re.compile(r"\s*(?:T\d?|B|C)\s*:\s*-?\d")
POSITION = re.compile(r"\s*(?:C:\s*)?X:\s*-?\d+(?:\.\d*)?\s+Y:")
AXIS = re.compile(r"\b([XYZEABCUVW]):\s*(-?\d{1,9}(?:\.\d{0,30})?)")
BUSY = re.compile(r"(?:echo:\s*)?busy\b:?")
CAPABILITY = re.compile(r"Cap:(\w+):([01])")
ACTION = re.compile(r"//\s*action:\s*(\S+)\s*(.*)", re.DOTALL)
LAST_LINE = re.compile(r"last line\s*:\s*(\d{1,10})(?!\d)", re.IGNORECASE)
LINE_ERROR = re.compile(r"checksum|line number|last line|expected line", re.IGNORECASE)


def parse_reply(line: bytes) -> Reply:
    """What one line of the printer means. Total: any bytes give a value, and never an exception.

    Bytes that are not UTF-8 are replaced, as boot messages and noisy cables bring them.
    """
    if line in (b"ok\n", b"ok\r\n", b"ok"):
        return PLAIN_OK  # nearly every line is this one
    text = line.decode(errors="replace").strip("\r\n\0")
    if START.search(text) or RESET.match(text.strip()):
        return Start(text == "start")
    text = text.rstrip(" ")
    if match := OK.match(text):
        return _ok(match[1])
    low = text.lower()
    if low.startswith(("resend", "rs ")) and (match := RESEND.match(text)):
        return Resend(int(match[1]) if match[1] else None)
    if low.startswith(("error:", "!!")):
        words = text if low.startswith("!!") else text.split(":", 1)[1].strip()
        if LINE_ERROR.search(words):
            last = LAST_LINE.search(words)
            return Error(words, resend=True, last=int(last[1]) if last else None)
        return Error(words, resend=False, fatal=low.startswith("!!") or bool(FATAL.search(words)))
    if match := BUSY.match(low):
        return Busy(text[match.end() :].strip())
    if match := ACTION.match(text):
        return Action(match[1].lower(), match[2])
    return _report(text)


def _ok(rest: str) -> Ok:
    if not rest.strip():
        return PLAIN_OK
    head, colon, _ = rest.partition(":")
    told = {letter: int(digits) for letter, digits in ADVANCED.findall(head)}
    axes = _axes(rest) if colon and POSITION.search(rest) else None
    readings = _readings(rest) if colon and not axes else None
    return Ok(told.get("N"), told.get("P"), told.get("B"), readings or None, axes)


def _report(text: str) -> Reply:
    if TEMPERATURE.match(text):
        return Temperature(_readings(text), waiting="W:" in text)
    if POSITION.match(text):
        return Position(_axes(text))
    if match := CAPABILITY.match(text):
        return Capability(match[1], match[2] == "1")
    return Other(text)


def _axes(text: str) -> dict[str, float]:
    return {axis: float(value) for axis, value in AXIS.findall(text.split("Count")[0])}


def _readings(text: str) -> dict[str, Reading]:
    return {
        name: Reading(float(actual), float(target) if target else None)
        for name, actual, target in HEATER.findall(text)
    }
