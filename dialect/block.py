"""A line as grbl reads it: a block of words, of which several may be commands, or none where the last
move goes on. It becomes commands of one each, in the order in which grbl obeys them.

Source: grbl's gcode.c, ``gc_execute_line``: a block has at most one command of each modal group, and is
obeyed in the order of RS274/NGC: speeds, spindle, coolant, dwell, plane, units, offsets, distance mode, move.
"""

import re

from dialect.errors import ReadError
from dialect.words import NUMBER

SYSTEM = re.compile(r"\$(?:H|X|SLP|[0-9]+=.*|[A-Z#$]?)\Z")
_WORD = re.compile(rf"([A-Z])[ \t]*({NUMBER})[ \t]*")
_MOTION = frozenset({"G0", "G1", "G2", "G3", "G38.2", "G38.3", "G38.4", "G38.5", "G80"})
_WITH_AXES = frozenset({"G10", "G28", "G30", "G43.1", "G92"})
_ORDER = (
    ("G93", "G94"),
    ("M3", "M4", "M5"),
    ("M7", "M8", "M9"),
    ("G4",),
    ("G17", "G18", "G19"),
    ("G20", "G21"),
    ("G40", "G43.1", "G49"),
    ("G54", "G55", "G56", "G57", "G58", "G59"),
    ("G61",),
    ("G90", "G91"),
    ("G91.1",),
    ("G53",),
    ("G10", "G28", "G28.1", "G30", "G30.1", "G92", "G92.1"),
    tuple(sorted(_MOTION)),
    ("M0", "M1", "M2", "M30"),
)
_PLACE = {code: k for k, group in enumerate(_ORDER) for code in group}


def commands_of(text: str, motion: str) -> tuple[list[str], str]:
    """The commands of a line without comments, and the move that a line of axes alone now goes on with.

    The axis that feeds, A, is written as E, as in the programs of other firmwares.

    Args:
        motion: what goes on: "G0" at first.

    Raises:
        ReadError: it is no block that grbl would obey.
    """
    upper = text.upper().strip()
    if upper.startswith("$"):
        if SYSTEM.match(upper):
            return [upper], motion
        raise ReadError(f"{upper[:20]!a} is no command of grbl")
    codes, words = _parts(upper)
    for group in _ORDER:
        twice = [code for code in codes if code in group]
        if len(twice) > 1:
            raise ReadError(f"{twice[0]} and {twice[1]} in one line exclude each other (grbl: error 21)")
    moving = next((code for code in codes if code in _MOTION), None)
    taken = next((code for code in codes if code in _WITH_AXES), None)
    axes = words.keys() & set("XYZEIJKR")
    if moving is None and taken is None and axes:
        codes.append(motion)
        moving = motion
    if moving is not None and taken is not None and axes:
        raise ReadError(f"{taken} and {moving} both want the axes of the line (grbl: error 24)")
    if not codes and words.keys() == {"F"}:
        codes.append(moving := motion)
    done = []
    for code in sorted(codes, key=lambda code: _PLACE.get(code, len(_ORDER))):
        mine = _mine(code, moving, taken, words)
        done.append(" ".join((code, *(letter + words[letter] for letter in mine))))
    return done, moving or motion


def _parts(upper: str) -> tuple[list[str], dict[str, str]]:
    """The codes of a block, and its other words."""
    codes: list[str] = []
    words: dict[str, str] = {}
    place = 0
    while place < len(upper):
        word = _WORD.match(upper, place)
        if word is None:
            raise ReadError(f"{upper[place : place + 20]!a} is no word of a letter and a number")
        place = word.end()
        letter, number = word[1], word[2]
        if letter in "GM":
            whole, _, part = number.lstrip("+").partition(".")
            codes.append(letter + str(int(whole)) + (f".{part.rstrip('0')}" if part.rstrip("0") else ""))
            continue
        if letter == "E":
            raise ReadError("grbl has no axis E; its feed is A")
        letter = "E" if letter == "A" else letter
        if letter in words:
            raise ReadError(f"{letter} stands twice in the line (grbl: error 25)")
        words[letter] = number
    return codes, words


def _mine(code: str, moving: str | None, taken: str | None, words: dict[str, str]) -> list[str]:
    """Which words of a block a command takes."""
    dwells = code == "G4"
    if dwells:
        return [letter for letter in words if letter == "P"]
    if code in ("M3", "M4"):
        return [letter for letter in words if letter == "S"]
    if code == (moving if taken is None else taken):
        return [letter for letter in words if letter not in "SPTN" or (code == "G10" and letter == "P")]
    return []
