"""Which commands a replay follows, and so may stand in a print; every other one is named.

Between the first and the last extrusion only what is listed here may stand, in a form that changes nothing
that is not followed. Before and behind may stand what prepares or ends, see ``gcode.preparing``, and the
profile's own start and end blocks.
"""

import math
import re

from dialect.commands import IMMEDIATE_OUTPUTS, code_of
from dialect.flavor import Flavor
from dialect.reader import clean
from dialect.words import values_of
from gcode.moves import Kind, Move
from gcode.preparing import ASKS_HOST, START_MACROS, asks_host, why_not
from gcode.ranges import (
    EXTRUDES_FROM_C,
    HEATERS,
    SETTINGS,
    out_of_range,
    wrong_dwell,
    wrong_temperature,
)
from gcode.violation import Violation
from profiles import Profile, render

BARE = frozenset({"G21", "G90", "G91", "G94", "M82", "M83", "M400", "M105", "M114"})
"""Modes that are followed, waits and questions; none has words."""

FANS = frozenset({"M106", "M107"})
ACCELERATIONS = frozenset({"M201", "M204", "M205"})
"""How fast speeds change; that may happen within a print."""

NO_EFFECT = {"M200": "S0", "M220": "S100", "M221": "S100"}
"""Factors on flow and speed, and the one form of each that changes nothing."""

NEVER = frozenset(
    f"G{code}"
    for code in (2, 3, 5, 7, 8, 16, 41, 42, 43, 49, 51, 52, 53, 54, 55, 56, 57, 58, 59, 68, 76, 93, 95)
) | frozenset(
    f"M{code}"
    for code in (
        *(23, 24, 28, 30, 32, 92, 98, 112, 163, 164, 165, 166, 206, 218, 290, 350, 404, 405, 410, 428, 502),
        *(605, 665, 666, 851, 852),
    )
)
"""Curves, other coordinates, other scales, other programs, an emergency stop: wrong wherever they stand."""

ACCELERATION_ALONE = re.compile(r"SET_VELOCITY_LIMIT ACCEL=[1-9][0-9]{0,5}(?:\.[0-9]+)?", re.IGNORECASE)
"""Klipper's own way to change how fast speeds change."""

PROBES = frozenset(f"G{code}" for code in (12, 29, 30, 32, 33, 34, 35, 38, 76, 80, 425)) | frozenset(
    {"M48", "M401", "BED_MESH_CALIBRATE", "QUAD_GANTRY_LEVEL", "Z_TILT_ADJUST", "SCREWS_TILT_CALCULATE"}
    | START_MACROS
)
"""They drive the nozzle, its probe or its brush down, wherever the axis homes; a start macro may."""


def check_commands(moves: list[Move], printing: list[bool], profile: Profile) -> list[Violation]:
    """Name every command that is not followed where it stands.

    Args:
        printing: for each move, whether it lays material.
    """
    allowed = {name.upper() for name in profile.gcode.allowed_commands}
    flavor = profile.flavor
    valve = set(valve_lines(profile)) if profile.material.feed == "pneumatic" else set()
    start, end = _block(profile.gcode.start, profile), _block(profile.gcode.end, profile)
    outputs = {_output(line) for line in valve} - {None}
    laid = [k for k, prints in enumerate(printing) if prints]
    first, last = (laid[0], laid[-1]) if laid else (len(moves), len(moves))
    before = moves[: first + 1] if laid else []
    found = (_cold_start(before, profile) + _cold_around(before, profile)) if laid else []
    queued = homed = False
    for k, move in enumerate(moves):
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE, Kind.FEED):
            queued = True
        if move.kind == Kind.DWELL:
            queued = False
        if move.kind == Kind.DWELL and (why := wrong_dwell(move.seconds, move.text)):
            found.append(Violation(move.line, "command", f"{move.text or 'G4'} {why}"))
        if not move.text or move.kind in (Kind.COMMENT, Kind.DWELL):
            continue
        code = code_of(move.text)
        middle = first < k < last
        if code in flavor.empties_queue:
            queued = False
        turns = code in flavor.immediate_outputs and (code in IMMEDIATE_OUTPUTS or move.text in valve)
        if queued and middle and turns:
            text = (
                f"{move.text} acts when it is read, while moves before it are queued: put {flavor.wait} "
                "before it"
            )
            found.append(Violation(move.line, "flow", text))
        if code in allowed or move.text in valve:
            continue
        if code == flavor.homing:
            homed = True
        own = move.text in (start if k < first else end if k > last else ())
        why = None if own else flavor.unknown(code) or _anywhere(move.text, code, profile)
        if (
            why is None
            and not own
            and homed
            and code == "G92"
            and _renames_unknown(moves[k - 1], move.text, profile)
        ):
            why = "renames the place to which the axes homed, which is not known here: what comes is shifted"
        if why is None and k > first and not middle and _drives_down(move.text, code, profile):
            why = "drives the nozzle down into the sheet that stands"
        if why is None and not own and _output(move.text) in outputs and (middle or not _shuts(move.text)):
            why = "turns the output of the valve, but neither opens nor closes it as the profile does"
        elif why is None and middle:
            why = _in_the_middle(move.text, code, profile)
        elif why is None and not own and code not in (*HEATERS, *SETTINGS, *NO_EFFECT, "M302"):
            known = flavor.name == "klipper" and ACCELERATION_ALONE.fullmatch(move.text)
            why = why_not(move.text, k > last, flavor) if laid and not known else None
        if why is not None:
            found.append(Violation(move.line, "command", f"{move.text} {why}"))
    return found


def _cold_start(moves: list[Move], profile: Profile) -> list[Violation]:
    """What is wrong with the temperature of the nozzle at the first extrusion, the last of ``moves``.

    Marlin extrudes nothing below ``EXTRUDES_FROM_C`` unless M302 allows it, and moves on all the same. A
    profile whose firmware extrudes cold as it is has M302 in ``allowed_commands``.
    """
    wanted = profile.material.nozzle_temperature_c
    if profile.material.feed == "pneumatic":
        return []
    if "M302" in map(str.upper, profile.gcode.allowed_commands):
        return []
    if profile.flavor.allows_cold is None and wanted < EXTRUDES_FROM_C:
        return []  # whether it extrudes cold is up to the printer's own settings
    target, reached, least, unseen = None, -math.inf, EXTRUDES_FROM_C, False
    allowed = False
    for move in moves:
        code = code_of(move.text) if move.kind == Kind.COMMAND else ""
        words = values_of(move.text) if code in ("M104", "M109", "M302") else {}
        unseen = unseen or code in START_MACROS
        if code == "TURN_OFF_HEATERS":
            target, reached = 0.0, 0.0
        if code == "M302":
            least = words.get("S") or (0.0 if "S" in words else least)
            allowed = bool(words["P"]) if "P" in words else least == 0 if "S" in words else allowed
        elif words:
            target = words.get("S", words.get("R"))
            # M104 does not wait, but changes nothing where the nozzle is hot already.
            reached = (target or 0.0) if code == "M109" else min(reached, target or 0.0)
    if allowed or reached >= least or (unseen and target is None):
        return []
    if wanted < EXTRUDES_FROM_C:
        text = (
            f"the first extrusion is cold, and below {least:g} C Marlin extrudes nothing: put M302 P1 "
            f"before it (the profile has {wanted:g} C), or M302 in [gcode] allowed_commands of the profile "
            "if its firmware does not prevent cold extrusion"
        )
    elif target is None:
        text = f"the first extrusion comes before the nozzle is heated; the profile has {wanted:g} C (M109)"
    elif target < least:
        text = (
            f"the nozzle is set to {target:g} C at the first extrusion; below {least:g} C nothing is extruded"
        )
    else:
        text = f"the first extrusion does not wait for the nozzle to reach {target:g} C (M109)"
    return [Violation(moves[-1].line, "command", text)]


def _cold_around(moves: list[Move], profile: Profile) -> list[Violation]:
    """Whether the bed or the chamber, which the profile heats, is switched off at the first extrusion."""
    targets = {
        HEATERS[move_code]: values_of(move.text)
        for move in moves
        if move.kind == Kind.COMMAND and (move_code := code_of(move.text)) in HEATERS
    }
    found = []
    for setting, words in targets.items():
        target, wanted = words.get("S", words.get("R")), profile.temperature_c(setting)
        if not setting.startswith("nozzle") and target is not None and target <= 0 < wanted:
            part = setting.partition("_")[0]
            text = f"the {part} is switched off at the first extrusion; the profile has {wanted:g} C"
            found.append(Violation(moves[-1].line, "command", text))
    return found


def valve_lines(profile: Profile) -> list[str]:
    """The profile's own lines that open and close the valve, as the reader gives them."""
    return [*_block(profile.gcode.valve_open, profile), *_block(profile.gcode.valve_close, profile)]


def _block(lines: tuple[str, ...], profile: Profile) -> list[str]:
    commands = (clean(line, profile.flavor) for line in render(lines, profile.values))
    return [command for command in commands if command]


def _anywhere(text: str, code: str, profile: Profile) -> str | None:
    """Why a command is wrong wherever it stands."""
    base = code.partition(".")[0]
    words = values_of(text)
    if code in NO_EFFECT:
        letter, value = NO_EFFECT[code][0], float(NO_EFFECT[code][1:])
        return None if words == {letter: value} else UNSURE
    if base in ("G0", "G1"):
        speed = words.get("F")
        if speed is not None and speed <= 0:
            return f"has a speed of {speed:g}, which a printer ignores or stops at"
        odd = ", ".join(sorted(words.keys() - set("XYZEF")))
        if odd or code != base:
            return f"has words that are not followed here ({odd or code})"
        return "goes on from a place that is not known here; give it in absolute coordinates (G90)"
    if code in HEATERS and words:
        return wrong_temperature(words, code, profile)
    if code in SETTINGS:
        return out_of_range(text, profile.flavor)
    if code in profile.flavor.tool_offsets and words:
        return "puts the tool elsewhere than the program says; what comes is unsure"
    longer = base in ("G10", "G11") and text != base  # of a tool, a coordinate system, or of another length
    subcode = code != base and base in ("G4", "G20", "G21", "G28", "G90", "G91", "G92")
    numbered = code[1:2].isdigit()
    other_tool = numbered and code[0] == "T" and code != "T0"
    if (
        base in NEVER - _orients(profile.flavor)
        or longer
        or subcode
        or other_tool
        or (numbered and code[0] == "O")
        or base in MACROS
    ):
        return UNSURE
    return None


def _renames_unknown(before: Move, text: str, profile: Profile) -> bool:
    """Whether a G92 is given where an axis has homed and has not moved since: it shifts all that comes."""
    along, across = ("X", "Y") if profile.machine.plane == "XZ" else ("Y", "X")
    places = {along: before.x_mm, "Z": before.y_mm, across: before.depth_mm}
    words = values_of(text)
    axes = words.keys() & places.keys() if words else places.keys()
    return any(math.isnan(places[axis]) for axis in axes)


def _orients(flavor: Flavor) -> frozenset[str]:
    """What means another thing to grbl: no offset of tools, the first origin, the end of the program."""
    return frozenset({"G49", "G54", "M30"}) if flavor.words_per_line else frozenset()


UNSURE = "is not followed here; what comes is unsure"
MACROS = frozenset(f"M{code}" for code in range(810, 820))


def _drives_down(text: str, code: str, profile: Profile) -> bool:
    """Whether a command homes or probes downwards."""
    if code.partition(".")[0] in PROBES:
        return True
    axes = values_of(text).keys() & set("XYZ")
    homes = code == profile.flavor.homing
    return homes and not profile.printer.build_axis_homes_up and (not axes or "Z" in axes)


def _in_the_middle(text: str, code: str, profile: Profile) -> str | None:
    """Why a command must not stand between the first and the last extrusion."""
    words = values_of(text)
    if text in BARE or code in ("G0", "G1", "M73", *NO_EFFECT):
        return None
    if code == "G92" and words.keys() == {"E"}:
        return None
    if code in profile.flavor.messages:
        return ASKS_HOST if code != "M117" and asks_host(text) else None
    if code in FANS and words.keys() <= {"S", "P"} and all(value is not None for value in words.values()):
        return None
    if code in HEATERS:
        return _cold(words, code, profile)
    if code in ACCELERATIONS and words:
        return None  # its values were looked at by ``out_of_range``
    if code == "SET_VELOCITY_LIMIT" and ACCELERATION_ALONE.fullmatch(text):
        return None
    return "is not followed in the middle of a print; [gcode] allowed_commands of a profile may allow it"


def _cold(words: dict[str, float | None], code: str, profile: Profile) -> str | None:
    """Why a temperature would end the flow of material."""
    target = words.get("S", words.get("R"))
    if target is None:
        return "sets no temperature that is followed here"
    wanted = profile.temperature_c(HEATERS[code])
    if wanted > 0 and target <= 0:
        return f"switches heat off in the middle of a print, the profile has {wanted:g} C"
    if HEATERS[code].startswith("nozzle") and target < EXTRUDES_FROM_C <= wanted:
        return f"is below {EXTRUDES_FROM_C:g} C, where nothing is extruded; the profile has {wanted:g} C"
    return None


def _shuts(text: str) -> bool:
    """Whether a command turns an output off, which outside of a print does no harm in whatever form."""
    return code_of(text) == "M107" or values_of(text).get("S") == 0


def _output(text: str) -> tuple[str, float | None] | None:
    """Which output a command turns: the fan or pin of its number."""
    code = code_of(text)
    if code in FANS:
        return "fan", values_of(text).get("P") or 0.0
    return (code, values_of(text).get("P")) if code in IMMEDIATE_OUTPUTS else None
