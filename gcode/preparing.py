"""Which commands may stand before the first extrusion and behind the last one.

What prepares, asks, tells, or ends may. Everything else may change what the machine makes of the moves, in
a way that a replay cannot know: steps, currents, motors, tools, sensors, other programs. It is a list of
what is known to be harmless, so that a command that nobody thought of is named.
"""

import re

from dialect.commands import code_of
from dialect.flavor import GRBL, MARLIN, Flavor
from dialect.words import values_of


def _codes(letter: str, text: str) -> set[str]:
    return {f"{letter}{number}" for number in text.split()}


HARMLESS = frozenset(
    # Moves and modes that are followed; homing, levelling, wiping and parking, behind which the
    # position counts as unknown.
    _codes("G", "0 1 4 10 11 12 20 21 27 28 29 30 32 33 34 35 60 80 90 91 92")
    # Waits for people, motors, the card, the clock, power, answers, messages, reports.
    | _codes("M", "0 1 5 9 17 20 21 22 27 31 36 73 75 76 77 78 80 82 83 105 113 114 115 117 118 119")
    | _codes("M", "122 123 150 154 155 250 255 256 355 400 401 402 412 413 414 420 486 501 503 504")
    | _codes("M", "710 860 861 862 863 864 865 866 867 868 869 876")
    | {"T0"}
)

HARMLESS_TO_GRBL = _codes("G", "17 40 49 54 61 94") | {"$H"}
"""Homing, and how a program without curves is read anyway."""

MACROS = frozenset({
    "START_PRINT", "PRINT_START", "END_PRINT", "PRINT_END", "BED_MESH_CALIBRATE", "BED_MESH_PROFILE",
    "BED_MESH_CLEAR", "RESPOND", "QUAD_GANTRY_LEVEL", "Z_TILT_ADJUST", "SCREWS_TILT_CALCULATE",
    "CLEAR_PAUSE", "STATUS", "GET_POSITION", "SET_PRINT_STATS_INFO",
    "SET_DISPLAY_TEXT", "EXCLUDE_OBJECT_DEFINE", "EXCLUDE_OBJECT_START", "EXCLUDE_OBJECT_END",
})  # fmt: skip
"""Klipper's own that prepare or end, and the names that start and end blocks have by custom."""

ENDING = frozenset({"M2", "M18", "M30", "M81", "M84", "TURN_OFF_HEATERS"})
"""Motors, power and heaters off, the end of a program: before a print they lose the position or the heat that
it needs."""

START_MACROS = frozenset({"START_PRINT", "PRINT_START"})
"""By custom they heat, home and fill the nozzle, in a way that only the printer knows."""


ASKS_HOST = "asks the host for an action"


def asks_host(message: str) -> bool:
    """Whether a message to the host is one that hosts obey: ``//action:cancel`` and its like.

    Firmwares drop quotation marks and backslashes before they send it.
    """
    return "action:" in re.sub(r"[\\\"'\s]", "", message.lower())


def why_not(text: str, behind: bool, flavor: Flavor = MARLIN) -> str | None:
    """Why a command may not stand before the print, or ``behind`` it; None if it may."""
    code = code_of(text)
    if code in ENDING:
        return None if behind else "switches off what the print needs"
    base = code.partition(".")[0]
    words = values_of(text)
    if code in ("M118", "RESPOND") and asks_host(text):
        return ASKS_HOST
    if code in MACROS:
        return None
    if base == "M486" and words.keys() & {"P", "C"}:
        return "cancels objects, so that moves are skipped"
    if base in HARMLESS or (flavor is GRBL and code in HARMLESS_TO_GRBL):
        return None
    if base[1:].isdigit():
        return "may change what the machine makes of the moves; [gcode] allowed_commands may allow it"
    return "is a macro that only the printer knows; [gcode] allowed_commands of a profile may allow it"
