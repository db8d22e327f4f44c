"""Fans, valves, pins and tunings that a program sets: which of them a command decides, and how it leaves it.

Firmwares spell one thing in many ways (``M106 P0`` and ``M106``, ``M107`` and ``M106 S0``); here each has one
name, so that what is restored, or known to be open, does not hang on the spelling.
"""

import re
from collections.abc import Sequence

from dialect.commands import code_of
from dialect.words import values_of
from printer.protocol import clean

# Each output is decided by the last command of its kind; M9 decides both kinds of coolant.
NAMES = {
    "M106": "fan", "M107": "fan", "M42": "pin", "M280": "servo", "M282": "servo",
    "M3": "spindle", "M4": "spindle", "M5": "spindle", "M7": "mist", "M8": "flood", "M9": "mist flood",
    "M10": "vacuum", "M11": "vacuum", "M126": "valve 1", "M127": "valve 1", "M128": "valve 2",
    "M129": "valve 2", "G10": "retraction", "G11": "retraction",
}  # fmt: skip
NUMBERED = frozenset({"fan", "pin", "servo"})
"""Outputs of which P tells which one."""
OPENING = frozenset({"M3", "M4", "M7", "M8", "M10", "M42", "M106", "M126", "M128", "M280"})
NO_VALVE = re.compile(r"G0*[0-4](?!\d)|G(?:20|21|90|91|92)(?!\d)|M(?:82|83|105|114|117|118|400)(?!\d)|T\d")
"""Moves, dwells, modes, waits and questions: a block that works a valve may hold them, but they work none."""

SETTINGS = frozenset(
    f"M{code}"
    for code in (92, 200, 201, 203, 204, 205, 207, 208, 209, 211, 218, 220, 221, 302, 566, 572, 900)
)
MACRO_SETTINGS = frozenset({"SET_PRESSURE_ADVANCE", "SET_VELOCITY_LIMIT", "SET_RETRACTION"})
WHICH = {"M204": "", "M205": "", "M572": "D"}
"""The word that tells which tool or drive a setting is for: T, but for these."""


def outputs_of(command: str) -> tuple[str, ...]:
    """The outputs that a clean command decides."""
    names = NAMES.get(code_of(command), "")
    if names == "retraction" and set(values_of(command)) & set("LP"):
        return ()  # G10 sets an offset or a tool's temperature then
    if names in NUMBERED:
        return (f"{names} {values_of(command).get('P') or 0:g}",)
    return (names,) if names.startswith("valve") else tuple(names.split())


def level(command: str) -> str:
    """How a command leaves its output: equal for what means the same."""
    code, words = code_of(command), values_of(command)
    if code in ("M106", "M107"):
        speed = 0.0 if code == "M107" else words.get("S", 255.0)
        return f"{speed or 0.0:g}"
    words.pop("P", None)
    return f"{code} {sorted((letter, value or 0.0) for letter, value in words.items())}"


def set_by(command: str) -> dict[str, str]:
    """Each setting that a clean command changes, by name, and the command that changes it alone.

    Firmwares keep what a command does not name: ``M203 Y7`` leaves the X of an earlier one.
    """
    code, _, rest = command.partition(" ")
    if code in MACRO_SETTINGS:
        names = " ".join(sorted(part.partition("=")[0].upper() for part in rest.split()))
        return {f"{code} {names}": command}
    if code not in SETTINGS:
        return {}
    words = re.findall(r"([A-Z])\s*([-+]?[\d.]*)", rest)
    which = WHICH.get(code, "T")
    tool = next((f" {letter}{number}" for letter, number in words if letter == which), "")
    return {
        f"{code} {letter}{tool}": f"{code} {letter}{number}{tool}"
        for letter, number in words
        if letter != which
    }


class Valve:
    """Whether material may flow behind the valve of a profile: by its outputs, and by the lines, macros
    among them, that open and close it. It counts as closed until a command is seen that works it."""

    def __init__(self, close_lines: Sequence[str] = (), open_lines: Sequence[str] = ()) -> None:
        opening, closing = _work(open_lines), _work(close_lines)
        self._closed = {name: level(line) for line in closing for name in outputs_of(line)}
        self._levels = dict(self._closed)
        self._opening = {line for line in opening if line not in closing and not outputs_of(line)}
        self._closing = {line for line in closing if line not in opening and not outputs_of(line)}
        # An output that the profile opens and does not close by name is shut by whatever else sets it.
        self._opened = {
            name: level(line) for line in opening for name in outputs_of(line) if name not in self._closed
        }
        self._flows: dict[str, bool] = {}
        self._is_open = False

    def apply(self, command: str) -> None:
        """Take one clean command."""
        if command in self._opening or command in self._closing:
            self._is_open = command in self._opening
            self._flows = {} if not self._is_open else self._flows
        for name in outputs_of(command):
            if name in self._closed:
                self._levels[name] = level(command)
            elif name in self._opened:
                self._flows[name] = level(command) == self._opened[name]

    @property
    def is_open(self) -> bool:
        """Whether a move may lay material now."""
        return self._is_open or any(self._flows.values()) or self._levels != self._closed


def _work(lines: Sequence[str]) -> list[str]:
    """The lines of a block that can work a valve."""
    return [line for line in map(clean, lines) if line and not NO_VALVE.match(line)]
