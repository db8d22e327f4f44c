"""What a number in a command may be: beyond it lies a slip of the pen, or the end of a print or a machine."""

import math

from dialect.commands import code_of
from dialect.flavor import MARLIN, Flavor
from dialect.words import values_of
from profiles import Profile

Words = dict[str, float | None]

LONGEST_DWELL_S = 3600.0
"""As for the dwells of a profile."""

SLOWEST_MM_S = 0.0016
"""F of a tenth of a mm/min, the least that a program of vslice can say."""

HOTTEST_NOZZLE_C = 350.0
HOTTEST_BED_C = 150.0
"""What a printer of plastic can stand; a profile that is hotter says so itself."""

EXTRUDES_FROM_C = 170.0
"""Below this Marlin extrudes nothing (EXTRUDE_MINTEMP)."""

HEATERS = {
    "M104": "nozzle_temperature_c",
    "M109": "nozzle_temperature_c",
    "M140": "bed_temperature_c",
    "M190": "bed_temperature_c",
}

_ACCELERATION = (1.0, 1_000_000.0)
_SPEED = (0.1, 10_000.0)
_JERK = (0.01, 1000.0)

SETTINGS: dict[str, dict[str, tuple[float, float]]] = {
    "M106": {"S": (0, 255), "P": (0, 20)},
    "M107": {"P": (0, 20)},
    "M201": dict.fromkeys("XYZE", _ACCELERATION),
    "M203": dict.fromkeys("XYZE", _SPEED),
    "M204": dict.fromkeys("PRTS", _ACCELERATION),
    # S and T would raise slow feeds, B is the shortest time of a segment in microseconds.
    "M205": {**dict.fromkeys("XYZE", _JERK), "J": (0.0001, 10), "S": (0, 0), "T": (0, 0), "B": (0, 1e6)},
    "M209": {"S": (0, 0)},  # 1 would turn E moves into retractions
    "M211": {"S": (1, 1)},  # 0 lets the axes run into their ends
    "M111": {"S": (0, 7)},  # 8 is a dry run
    "M141": {"S": (0, HOTTEST_BED_C)},
    "M191": {"S": (0, HOTTEST_BED_C)},
    "M300": {"S": (0, 20_000), "P": (0, 60_000)},  # a beep, for which the printer waits
    "M566": dict.fromkeys("XYZE", (1.0, 100_000.0)),  # RepRapFirmware: jerk in mm/min
    "M900": {"K": (0, 10), "L": (0, 10), "S": (0, 1), "T": (0, 0)},  # Marlin takes K below 10
}
"""Settings that change how fast, never where: of each its words, and their least and greatest value."""


def out_of_range(text: str, flavor: Flavor = MARLIN) -> str | None:
    """What is wrong with the words of a command of ``SETTINGS``; None where nothing is, as without words."""
    code = code_of(text)
    factor = flavor.axis_speed_per_s if code == "M203" else 1.0
    for letter, value in values_of(text).items():
        limits = SETTINGS[code].get(letter)
        if limits is None:
            return f"has a word that is not followed here ({letter})"
        low, high = limits[0] * factor, limits[1] * factor
        if value is None or not low <= value <= high:
            what = "nothing" if value is None else f"{value:g}"
            allowed = f"only {low:g} is" if low == high else f"{low:g} to {high:g} are"
            return f"sets {letter} to {what}; {allowed} taken here"
    return None


def wrong_dwell(seconds: float, text: str) -> str | None:
    """What is wrong with a G4, whose text is given where it has not just S or P."""
    if text:
        return "has no time that is followed here; give S or P"
    if not 0 <= seconds <= LONGEST_DWELL_S:
        return f"dwells {seconds:g} s; 0 to {LONGEST_DWELL_S:g} s are taken here"
    return None


def wrong_temperature(words: Words, code: str, profile: Profile) -> str | None:
    """Why a temperature is none that this machine can have, or none that this command can set."""
    target = words.get("S", words.get("R") if code in ("M109", "M190") else None)
    wanted = profile.temperature_c(HEATERS[code])
    part = "nozzle" if HEATERS[code].startswith("nozzle") else "bed"
    most = max(HOTTEST_NOZZLE_C if part == "nozzle" else HOTTEST_BED_C, wanted)
    if len(words) != 1 or target is None or math.isnan(target):
        return "sets no temperature that is followed here"
    if target > 0 and wanted == 0:
        return f"heats the {part}, which the profile leaves cold ({part}_temperature_c is 0)"
    if not 0 <= target <= most:
        return f"sets the {part} to {target:g} C; 0 to {most:g} C are taken here"
    return None
