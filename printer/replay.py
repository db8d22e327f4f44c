"""What a program has told the printer up to some command: modes, position, heaters, outputs."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from dialect.commands import code_of
from printer.commands import Program
from printer.protocol import clean

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))?")
CODE = re.compile(r"([GMT])(\d+)(?:\.(\d+))?\s*(.*)", re.DOTALL)
MOTION = re.compile(r"G0*[0123](?!\d)")
HEATERS = {"M104": "M104", "M109": "M104", "M140": "M140", "M190": "M140", "M141": "M141", "M191": "M141"}
"""Commands that set a temperature, and the one that sets it without waiting."""
WAITING = {"M104": "M109", "M140": "M190", "M141": "M191"}
# Outputs: fans, valves, pins, spindle, servos. Each entry names what the last command of its kind decides.
OUTPUTS = {
    "M106": "fan", "M107": "fan", "M42": "pin", "M280": "servo", "M3": "spindle", "M4": "spindle",
    "M5": "spindle", "M126": "valve 1", "M127": "valve 1", "M128": "valve 2", "M129": "valve 2",
    "G10": "retraction", "G11": "retraction",
}  # fmt: skip
OPENING = frozenset({"M3", "M4", "M42", "M106", "M126", "M128", "M280"})
SETTINGS = frozenset({"M302", "M220", "M221", "M203", "M204", "M205", "M201", "M92"})


@dataclass
class Replay:
    """The state after some commands. Lengths in mm, speeds in mm/s; ``position`` holds the axes whose
    coordinate is known."""

    unit_mm: float = 1.0
    absolute: bool = True
    absolute_e: bool = True
    feed_mm_s: float = 25.0
    position: dict[str, float] = field(default_factory=dict)
    temperatures: dict[str, str] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)
    settings: dict[str, str] = field(default_factory=dict)
    tool: str = ""
    extruding: bool = False  # the last command was a move that fed material
    retracted_mm: float = 0.0  # drawn back and not fed forward again
    shifts: int = 0  # how often G92 moved the origin of X, Y or Z

    def apply(self, command: str) -> None:
        """Take one clean command."""
        match = CODE.match(command)
        if not match:
            return
        code, rest = f"{match[1]}{int(match[2])}", match[4]
        self.extruding = False
        if code in ("G0", "G1", "G2", "G3"):
            self._move(words(rest))
        elif code in ("G20", "G21"):
            self.unit_mm = 25.4 if code == "G20" else 1.0
        elif code in ("G90", "G91"):
            self.absolute = self.absolute_e = code == "G90"
        elif code in ("M82", "M83"):
            self.absolute_e = code == "M82"
        elif code == "G28":
            named = words(rest)
            for axis in [axis for axis in "XYZ" if axis in named] or "XYZ":
                self.position[axis] = 0.0
        elif code == "G92":
            given = words(rest)
            self.shifts += any(axis in given for axis in "XYZ")
            self.position.update({a: (v or 0.0) * self.unit_mm for a, v in given.items() if a in "XYZE"})
        elif code in HEATERS:
            self.temperatures[HEATERS[code]] = rest
        elif code in OUTPUTS:
            place = words(rest).get("P") if OUTPUTS[code] in ("fan", "pin", "servo") else None
            self.outputs[f"{OUTPUTS[code]} {place}"] = command
        elif code in SETTINGS:
            self.settings[code] = command
        elif code[0] == "T":
            self.tool = code

    def _move(self, given: dict[str, float | None]) -> None:
        if feed := given.get("F"):
            self.feed_mm_s = feed * self.unit_mm / 60
        moved = False
        for axis in "XYZ":
            value = given.get(axis)
            if value is None:
                continue
            old = self.position.get(axis)
            new = value * self.unit_mm + (0.0 if self.absolute else old or 0.0)
            moved = moved or new != old
            self.position[axis] = new
        fed = 0.0
        if (value := given.get("E")) is not None:
            old = self.position.get("E", 0.0)
            fed = value * self.unit_mm - (old if self.absolute_e else 0.0)
            self.position["E"] = old + fed
        self.extruding = fed > 0 and moved
        self.retracted_mm = max(0.0, self.retracted_mm - fed)


def words(rest: str) -> dict[str, float | None]:
    """The letters of a command and their values."""
    return {letter: float(value) if value else None for letter, value in WORD.findall(rest)}


def replay(program: Program, count: int) -> Replay:
    """The state after the first ``count`` commands."""
    state = Replay()
    for command in program.commands[:count]:
        state.apply(command)
    return state


MODES = ("G20", "G21", "G90", "G91", "M82", "M83")
LOOKED_BACK = 5000


def drawn_back(commands: Sequence[str], count: int) -> float:
    """Material in mm that the first ``count`` commands have drawn back and not fed again.

    Only the last few thousand are replayed, and the modes before them: this is asked for while a user waits
    for the printer to stop. Whoever goes without extruding for longer is taken to have drawn back nothing.
    """
    state, first = Replay(), max(0, count - LOOKED_BACK)
    for command in commands[:first]:
        if command.startswith(MODES):
            state.apply(command)
    for command in commands[first:count]:
        state.apply(command)
    return state.retracted_mm


def highest(program: Program, count: int, axis: str, close_lines: Sequence[str] = ()) -> float | None:
    """The largest coordinate on ``axis`` in mm where one of the first ``count`` commands laid material.

    Behind a valve no move feeds anything: there, one lays material while the valve is not as
    ``close_lines`` leave it.
    """
    closing = Replay()
    for line in close_lines:
        closing.apply(clean(line))
    closed = closing.outputs
    state, most = Replay(outputs=dict(closed)), None
    for command in program.commands[:count]:
        before = state.position.get(axis)
        state.apply(command)
        is_open = any(state.outputs[place] != line for place, line in closed.items())
        if state.extruding or (is_open and MOTION.match(command)):
            for value in (before, state.position.get(axis)):
                if value is not None:
                    most = value if most is None else max(most, value)
    return most


def lays_nothing(program: Program, count: int, close_lines: Sequence[str] = ()) -> bool:
    """Whether the first ``count`` commands cannot lay material: they only prepare. In doubt they can: any
    output but those that ``close_lines`` turn off may be a valve, and a move behind it prints."""
    if program.toolpaths and count > program.toolpaths[0]:
        return False
    closed = {clean(line) for line in close_lines}
    state, is_open = Replay(), False
    for command in program.commands[:count]:
        state.apply(command)
        if state.extruding or (is_open and MOTION.match(command)):
            return False
        if code_of(command) in OPENING:
            is_open = command not in closed
    return True
