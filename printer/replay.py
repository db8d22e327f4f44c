"""What a program has told the printer up to some command: modes, position, heaters, outputs."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from dialect.commands import code_of
from printer.commands import Program
from printer.outputs import OPENING, Valve, outputs_of, set_by
from printer.protocol import clean

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))?")
CODE = re.compile(r"([GMT])(\d+)(?:\.(\d+))?\s*(.*)", re.DOTALL)
MOTION = re.compile(r"G0*[0123](?!\d)")
HEATERS = {"M104": "M104", "M109": "M104", "M140": "M140", "M190": "M140", "M141": "M141", "M191": "M141"}
"""Commands that set a temperature, and the one that sets it without waiting."""
WAITING = {"M104": "M109", "M140": "M190", "M141": "M191"}
ROUNDED = 6  # decimals of an origin, so that a place that keeps its name moves nothing
ORIGIN = frozenset({"M206", "M428", *(f"G{code}" for code in range(52, 60))})
"""Commands besides G92 that move the origin, by what only the printer knows or for longer than to G28."""


@dataclass
class Replay:
    """The state after some commands. Lengths in mm, speeds in mm/s; ``position`` holds the axes whose
    coordinate is known, ``outputs`` and ``settings`` what sets each of them, that of the last change last.

    ``origins`` holds the machine's coordinate of the origin of each axis that G92 moved, None where it cannot
    be known: an axis that has only homed stands where its firmware says that its endstop is.
    """

    unit_mm: float = 1.0
    absolute: bool = True
    absolute_e: bool = True
    feed_mm_s: float = 25.0
    position: dict[str, float] = field(default_factory=dict)
    temperatures: dict[str, tuple[str, str]] = field(default_factory=dict)  # heater and words, by tool
    outputs: dict[str, str] = field(default_factory=dict)
    settings: dict[str, tuple[str, ...]] = field(default_factory=dict)  # commands that begin and end in mm
    tool: str = ""
    extruding: bool = False  # the last command was a move that fed material
    retracted_mm: float = 0.0  # drawn back and not fed forward again
    shifts: int = 0  # how often the origin of X, Y or Z was moved
    origins: dict[str, float | None] = field(default_factory=dict)
    placed: set[str] = field(default_factory=set)  # axes that have moved to a coordinate since they homed
    displaced: set[str] = field(default_factory=set)  # axes whose origin is not that of G92 alone

    def apply(self, command: str) -> None:
        """Take one clean command."""
        match = CODE.match(command)
        code, rest = (f"{match[1]}{int(match[2])}", match[4]) if match else ("", "")
        if code in ("G0", "G1", "G2", "G3"):
            self.extruding = False
            self._move(words(rest))
            return
        for name, line in set_by(command).items():
            lines = (line,) if self.unit_mm == 1.0 else ("G20", line, "G21")
            _last(self.settings, name, lines)
        for name in outputs_of(command):
            _last(self.outputs, name, command)
        if not match:
            return
        self.extruding = False
        if code in ("G20", "G21"):
            self.unit_mm = 25.4 if code == "G20" else 1.0
        elif code in ("G90", "G91"):
            self.absolute = self.absolute_e = code == "G90"
        elif code in ("M82", "M83"):
            self.absolute_e = code == "M82"
        elif code == "G28":
            self._home([axis for axis in "XYZ" if axis in words(rest)] or ["X", "Y", "Z"])
        elif code == "G92":
            self._rename(words(rest), int(match[3] or 0))
        elif code in ORIGIN or (code == "G10" and "L" in words(rest)):
            self.displaced |= set(words(rest)) & set("XYZ") or set("XYZ")
            self.shifts += 1
        elif code in HEATERS:
            which = words(rest).get("T")
            _last(self.temperatures, f"{HEATERS[code]} {which}", (HEATERS[code], rest))
        elif code[0] == "T":
            self.tool = code

    def origin(self, axis: str) -> float | None:
        """The machine's coordinate in mm of what the program calls 0; None if it cannot be known."""
        return None if axis in self.displaced else self.origins.get(axis, 0.0)

    def _home(self, axes: list[str]) -> None:
        for axis in axes:
            self.position[axis] = 0.0
            self.shifts += self.origins.pop(axis, 0.0) != 0.0  # homing takes back what G92 did
            self.placed.discard(axis)

    def _rename(self, given: dict[str, float | None], subcode: int) -> None:
        """G92: the nozzle stays, and its place gets another name. Without words, or with a subcode, firmwares
        differ in what they do: then nothing is known but that it may have been done."""
        if "E" in given or not given:
            self.position["E"] = (given.get("E") or 0.0) * self.unit_mm
        for axis in [axis for axis in "XYZ" if axis in given or not given]:
            name, origin = (given.get(axis) or 0.0) * self.unit_mm, self.origin(axis)
            new = None
            if given and not subcode and origin is not None and axis in self.placed:
                new = round(origin + self.position[axis] - name, ROUNDED)
            self.shifts += new is None or new != origin
            self.origins[axis], self.position[axis] = new, name

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
            if self.absolute:
                self.placed.add(axis)
            self.position[axis] = new
        fed = 0.0
        if (value := given.get("E")) is not None:
            old = self.position.get("E", 0.0)
            fed = value * self.unit_mm - (old if self.absolute_e else 0.0)
            self.position["E"] = old + fed
        self.extruding = fed > 0 and moved
        self.retracted_mm = max(0.0, self.retracted_mm - fed)


def _last(kept: dict[str, Any], name: str, value: object) -> None:
    """Keep a value behind all others: what is set last may depend on what was set before."""
    kept.pop(name, None)
    kept[name] = value


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


def highest(
    program: Program,
    count: int,
    axis: str,
    close_lines: Sequence[str] = (),
    open_lines: Sequence[str] = (),
) -> float | None:
    """The largest coordinate on ``axis`` in mm where one of the first ``count`` commands may have laid
    material.

    Behind a valve no move feeds anything: there, one lays material while ``close_lines`` and ``open_lines``
    say that the valve is open. If nothing tells where material was laid, it may have been wherever
    the nozzle went since the first toolpath.
    """
    state, valve = Replay(), Valve(close_lines, open_lines)
    most = anywhere = None
    first = program.toolpaths[0] if program.toolpaths else 0
    for k, command in enumerate(program.commands[:count]):
        before = state.position.get(axis)
        state.apply(command)
        valve.apply(command)
        if not MOTION.match(command):
            continue
        behind = state.position.get(axis)
        if k >= first and behind is not None:
            anywhere = behind if anywhere is None else max(anywhere, behind)
        if state.extruding or valve.is_open:
            for value in (before, behind):
                if value is not None:
                    most = value if most is None else max(most, value)
    return anywhere if most is None else most


def behind_travels(
    program: Program, start: int, close_lines: Sequence[str] = (), open_lines: Sequence[str] = ()
) -> int:
    """The index behind the last move before material is laid from command ``start`` on; ``start`` itself if
    there is none, or if nothing tells."""
    state, valve, found = Replay(), Valve(close_lines, open_lines), start
    for k, command in enumerate(program.commands):
        was_open, before = valve.is_open, dict(state.position)
        state.apply(command)
        valve.apply(command)
        if k < start or not MOTION.match(command):
            continue
        moved = any(before.get(axis) != state.position.get(axis) for axis in "XYZ")
        if state.extruding or (moved and was_open):
            return found
        if moved:
            found = k + 1
    return start


def lays_nothing(
    program: Program, count: int, close_lines: Sequence[str] = (), open_lines: Sequence[str] = ()
) -> bool:
    """Whether the first ``count`` commands cannot lay material: they only prepare. In doubt they can: any
    output but those that ``close_lines`` turn off may be a valve, and a move behind it prints."""
    if program.toolpaths and count > program.toolpaths[0]:
        return False
    closed = {clean(line) for line in close_lines}
    state, valve, is_open = Replay(), Valve(close_lines, open_lines), False
    for command in program.commands[:count]:
        state.apply(command)
        valve.apply(command)
        if state.extruding or ((is_open or valve.is_open) and MOTION.match(command)):
            return False
        if code_of(command) in OPENING:
            is_open = command not in closed
    return True
