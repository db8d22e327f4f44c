"""Text becomes moves: reads what ``emit`` writes and what other programs write, independent of both."""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from gcode.errors import ParseError
from gcode.moves import Kind, Move

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
NUMBERED = re.compile(r"\s*N\s*(\d+)(.*?)(?:\*\s*(\d+)\s*)?$", re.IGNORECASE | re.DOTALL)
EXTENDED = re.compile(r"[A-Z]{2}\w*(\s|$)")  # a macro of a host or another firmware
PARENTHESES = re.compile(r"\([^)]*\)")
INCH_MM = 25.4
MAX_LINE = 100_000
DEFAULT_SPEED_MM_S = math.nan
UNKNOWN_MOTION = {"G2", "G3", "G5"}
"""Curves, which would need a chord tolerance of their own."""


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


def parse(lines: Iterable[str], *, plane: str = "XZ") -> Iterator[Move]:
    """Read G-code, line by line.

    Understood are G0, G1, G4, G10, G11, G20, G21, G28, G90, G91, G92, M82, M83, comments with ``;`` and in
    parentheses, line numbers with checksums, small letters, and words without blanks between them. Any
    other command becomes a ``COMMAND`` with its text. After homing, an axis has no known position.

    Args:
        plane: "XZ" or "YZ", which axes ``x_mm`` and ``y_mm`` of the moves are.

    Raises:
        ParseError: a word that is no number, a checksum that does not fit, a curve (G2, G3, G5).
    """
    machine = _Machine()
    horizontal, across = ("X", "Y") if plane == "XZ" else ("Y", "X")
    for number, raw in enumerate(lines, 1):
        text, comment = _split(raw, number)
        at = machine.position
        here = (at[horizontal], at["Z"], at[across])
        if comment is not None:
            yield Move(Kind.COMMENT, *here, text=comment, line=number)
        if not text:
            continue
        code, words = _words(text, number)
        move = _motion(machine, code, words, number)
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
                line=number,
                rapid=code == "G0",
            )
        elif code == "G4":
            seconds = words.get("P", 0.0) / 1000 + words.get("S", 0.0)
            yield Move(Kind.DWELL, *here, seconds=seconds, line=number)
        elif code in ("G10", "G11") and not {"P", "L"} & words.keys():
            kind = Kind.FIRMWARE_RETRACT if code == "G10" else Kind.FIRMWARE_PRIME
            yield Move(kind, *here, line=number)
        elif not _mode(machine, code, words) or code in ("G28", "G92"):
            here = (at[horizontal], at["Z"], at[across])
            yield Move(Kind.COMMAND, *here, text=text, line=number)


def read_moves(path: Path, *, plane: str = "XZ") -> list[Move]:
    """The moves of a G-code file; see ``parse``.

    Raises:
        ParseError: the file cannot be read, or holds what is no G-code of the kind that is read here.
    """
    try:
        text = path.read_text("utf-8", errors="replace")  # comments may be in any encoding
    except FileNotFoundError:
        raise ParseError(f"{path}: there is no such file") from None
    except IsADirectoryError:
        raise ParseError(f"{path}: is a folder; name a G-code file") from None
    except OSError as error:
        raise ParseError(f"{path}: cannot be read: {error.strerror}") from None
    if text.lstrip().startswith("{"):
        raise ParseError(f"{path}: is JSON, perhaps a grid, and no G-code")
    try:
        return list(parse(text.split("\n"), plane=plane))
    except ParseError as error:
        raise ParseError(f"{path}: {error}") from None


def _split(raw: str, number: int) -> tuple[str, str | None]:
    """The command of a line without number and checksum, in capitals, and its comment."""
    if len(raw) > MAX_LINE or "\0" in raw:
        raise ParseError(
            f"line {number}: this is no line of G-code, it is binary or has {len(raw)} characters"
        )
    command, semicolon, comment = raw.rstrip("\r\n").partition(";")
    numbered = NUMBERED.match(command)
    if numbered:
        said, rest, checksum = numbered.groups()
        if checksum is not None:
            found = 0
            for byte in command[: command.rindex("*")].lstrip().encode():
                found ^= byte
            if found != int(checksum):
                raise ParseError(
                    f"line {number}: N{said} has checksum {checksum}, but its text gives {found}"
                )
        command = rest
    if "(" in command:
        command = PARENTHESES.sub(" ", command)
    return command.strip().upper(), comment if semicolon else None


def _words(text: str, number: int) -> tuple[str, dict[str, float]]:
    """The code of a command, such as G1, and the numbers of its other words."""
    first = WORD.match(text)
    if first is None and EXTENDED.match(text):
        return text.split(maxsplit=1)[0], {}
    if first is None:
        raise ParseError(f"line {number}: {text[:40]!a} is no G-code command")
    code = first[1] + first[2].lstrip("0").rstrip(".") if first[2].strip("0") else first[1] + "0"
    if code[0] != "G":
        return code, {}  # other commands may carry free text
    words: dict[str, float] = {}
    place = first.end()
    while place < len(text):
        word = WORD.match(text, place)
        if word is None:
            if text[place].isspace():
                place += 1
                continue
            bare = text[place].isalpha() and code == "G28"  # G28 X names an axis without a number
            if not bare:
                raise ParseError(
                    f"line {number}: '{text[place : place + 20]}' is no word of a letter and a number"
                )
            words[text[place]] = 0.0
            place += 1
            continue
        words[word[1]] = float(word[2])
        place = word.end()
    return code, words


def _motion(machine: _Machine, code: str, words: dict[str, float], number: int) -> tuple[Kind, float] | None:
    """Carry out G0 and G1: what kind of move it was, and the feed; None for other codes."""
    if code in UNKNOWN_MOTION:
        raise ParseError(
            f"line {number}: {code} draws a curve, which is not read here; have it written as lines"
        )
    if code not in ("G0", "G1"):
        return None
    if "F" in words:
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
