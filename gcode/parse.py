"""Text becomes moves: reads what ``emit`` writes and what other programs write, independent of both."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from dialect.commands import code_of
from dialect.errors import ReadError
from dialect.flavor import MARLIN, Flavor
from dialect.reader import read
from dialect.source import Source, load
from gcode.errors import ParseError
from gcode.moves import Kind, Move

INCH_MM = 25.4
DEFAULT_SPEED_MM_S = math.nan
MOTION = {"G0", "G1"}
FOLLOWED = MOTION | {"G4", "G20", "G21", "G28", "G90", "G91", "G92", "M82", "M83"}
FOLLOWED_WORDS = frozenset("XYZEF")
CURVES = frozenset({"G2", "G3", "G5"})
"""Their way is not followed, but where they end is."""

ELSEWHERE = frozenset(
    {"G12", "G26", "G27", "G30", "G32", "G33", "G34", "G35", "G38", "G61", "M48", "M125", "M600"}
    | {"M701", "M702"}
)
"""Moves of the firmware's own: where the nozzle is afterwards is not known here."""


@dataclass
class _Machine:
    """What a controller remembers between lines."""

    position: dict[str, float] = field(default_factory=lambda: dict.fromkeys("XYZ", math.nan))
    offset: dict[str, float] = field(default_factory=lambda: dict.fromkeys("XYZ", 0.0))
    e: float = 0.0
    absolute: bool = True
    absolute_e: bool = True
    unit: float = 1.0
    speed_mm_s: float = DEFAULT_SPEED_MM_S


def parse(
    lines: Iterable[str], *, plane: str = "XZ", name: str = "", flavor: Flavor = MARLIN
) -> Iterator[Move]:
    """Follow G-code, line by line, as ``dialect.reader`` reads it.

    Followed are G0, G1, G4, G10, G11, G20, G21, G28, G90, G91, G92, M82 and M83. Any other command becomes
    a ``COMMAND`` with its text, and so do all that set a mode. A move with words that are not followed, such
    as those of a further axis, has its text, and so has one that is relative to a place that is not known.
    After homing, an axis has no known position, and after what moves in a way of the firmware's own, none
    has.

    Args:
        plane: "XZ" or "YZ", which axes ``x_mm`` and ``y_mm`` of the moves are.
        name: of the program, for messages.
        flavor: the firmware that it is for.

    Raises:
        ParseError: a line that is refused by the reader.
    """
    try:
        yield from _follow(lines, plane, name, flavor)
    except ReadError as error:
        raise ParseError(str(error)) from None


def _follow(lines: Iterable[str], plane: str, name: str, flavor: Flavor) -> Iterator[Move]:
    machine = _Machine()
    horizontal, across = ("X", "Y") if plane == "XZ" else ("Y", "X")
    elsewhere = ELSEWHERE if flavor.homing == "G28" else ELSEWHERE | {"G28"}
    for number, text, comment in read(lines, name, flavor):
        at = machine.position
        here = (at[horizontal], at["Z"], at[across])
        if comment is not None:
            yield Move(Kind.COMMENT, *here, text=comment, line=number)
        if not text:
            continue
        code = code_of(text)
        if code == flavor.homing:
            code = "G28"
        base = code.partition(".")[0]
        words = _values(text) if code in FOLLOWED and not text.startswith("$") else {}
        if base in CURVES:
            _motion(machine, "G1", {w: v for w, v in _values(text).items() if w in FOLLOWED_WORDS})
        elif base in elsewhere:
            machine.position.update(dict.fromkeys("XYZ", math.nan))
        odd = text if code in MOTION and (words.keys() - FOLLOWED_WORDS or words.get("F", 1.0) <= 0) else ""
        if code in MOTION and _goes_blind(machine, words):
            odd = text
        move = _motion(machine, code, words)
        if move is not None:
            kind, e = move
            at = machine.position
            yield Move(
                kind,
                at[horizontal],
                at["Z"],
                at[across],
                e,
                machine.speed_mm_s,
                text=odd,
                line=number,
                rapid=code == "G0",
            )
        elif code == "G4":
            seconds = flavor.dwell_s(words)
            odd = "" if words and words.keys() <= flavor.dwell_words else text
            yield Move(Kind.DWELL, *here, seconds=seconds, text=odd, line=number)
        elif text in ("G10", "G11") and flavor.firmware_retraction:
            kind = Kind.FIRMWARE_RETRACT if code == "G10" else Kind.FIRMWARE_PRIME
            yield Move(kind, *here, line=number)
        elif not _mode(machine, code, words) or code not in MOTION or odd:
            here = (at[horizontal], at["Z"], at[across])
            yield Move(Kind.COMMAND, *here, text=text, line=number)


def moves_unseen(command: str) -> bool:
    """Whether a clean command moves the nozzle, or may do so, in a way that is not followed here."""
    code = code_of(command)
    base = code.partition(".")[0]
    if base in MOTION:  # with a further axis, or in a form that is not known
        return code != base or bool(_values(command).keys() - FOLLOWED_WORDS)
    return base in CURVES or base in ELSEWHERE or base in ("G28", "G29") or not base[1:].isdigit()


def read_moves(source: Source | Path, *, plane: str = "XZ", flavor: Flavor = MARLIN) -> list[Move]:
    """The moves of a G-code file; see ``parse``.

    Raises:
        ParseError: the file cannot be read, or holds what its firmware could not be sent.
    """
    try:
        source = load(source) if isinstance(source, Path) else source
    except ReadError as error:
        raise ParseError(str(error)) from None
    return list(parse(source.lines, plane=plane, name=source.name, flavor=flavor))


def _values(command: str) -> dict[str, float]:
    """The words of a clean command of the kind that is followed; 0 for a bare letter, as in G28 X."""
    return {word[0]: float(word[1:] or 0.0) for word in command.split(" ")[1:]}


def _motion(machine: _Machine, code: str, words: dict[str, float]) -> tuple[Kind, float] | None:
    """Carry out G0 and G1: what kind of move it was, and the feed; None for other codes."""
    if code not in MOTION:
        return None
    if words.get("F", 0.0) > 0:  # Marlin takes no other
        machine.speed_mm_s = words["F"] * machine.unit / 60
    moved = False
    for axis in "XYZ":
        if axis not in words:
            continue
        value = words[axis] * machine.unit
        before = machine.position[axis]
        machine.position[axis] = value + (machine.offset[axis] if machine.absolute else before)
        moved = moved or machine.position[axis] != before
    e = 0.0
    if "E" in words:
        value = words["E"] * machine.unit
        e = value - machine.e if machine.absolute_e else value
        machine.e += e
    if not moved:
        return (Kind.FEED, e) if e else None
    return (Kind.EXTRUDE, e) if e > 0 else (Kind.TRAVEL, e)


def _goes_blind(machine: _Machine, words: dict[str, float]) -> bool:
    """Whether a relative move starts where an axis has no known position, other than upwards."""
    if machine.absolute:
        return False
    steps = {axis: words.get(axis, 0.0) for axis in "XYZ"}
    return any(
        step != 0 and math.isnan(machine.position[axis]) and not (axis == "Z" and step > 0)
        for axis, step in steps.items()
    )


def _mode(machine: _Machine, code: str, words: dict[str, float]) -> bool:
    """Carry out a command that moves nothing; whether it was one."""
    match code:
        case "G0" | "G1":
            pass
        case "G20" | "G21":
            machine.unit = INCH_MM if code == "G20" else 1.0
        case "G90" | "G91":
            machine.absolute = machine.absolute_e = code == "G90"
        case "M82" | "M83":
            machine.absolute_e = code == "M82"
        case "G28":
            for axis in [a for a in "XYZ" if a in words] or "XYZ":
                machine.position[axis] = math.nan
                machine.offset[axis] = 0.0
        case "G92":
            for axis in [a for a in "XYZ" if a in words] or ("XYZ" if not words else ""):
                # What the program will call this place; the place itself is not moved.
                machine.offset[axis] = machine.position[axis] - words.get(axis, 0.0) * machine.unit
                if math.isnan(machine.position[axis]):
                    machine.position[axis] = words.get(axis, 0.0) * machine.unit
                    machine.offset[axis] = 0.0
            if "E" in words or not words:
                machine.e = words.get("E", 0.0) * machine.unit
        case _:
            return False
    return True
