"""Moves become text: the only place where axis letters and number formats exist."""

import base64
import math
from collections.abc import Iterator, Mapping

from dialect.flavor import Flavor
from dialect.numbers import feed, plain, position, rate
from gcode import carried
from gcode.bead import feed_area_mm2
from gcode.estimate import seconds_of
from gcode.moves import Kind, Move
from gcode.program import Program
from profiles import Profile

THUMBNAIL_LINE = 78
E_STEP = 1e-5
"""The last decimal of E."""


def emit(
    program: Program, profile: Profile, facts: Mapping[str, str], *, thumbnail_png: bytes | None = None
) -> Iterator[str]:
    """The lines of a G-code file, without line ends. The same input gives the same lines.

    Positions have three decimals and E has five; what an axis already has is left out. What rounding
    takes from E is given to the next toolpath, so that the sum is right to the last decimal.

    Args:
        facts: what is written as ``; vslice key = value`` in the head; "profile" and "version" also name the
            profile, which stands whole at the end.
        thumbnail_png: a picture for the head; its size is [gcode] thumbnail_px.
    """
    yield from _head(program, profile, facts, thumbnail_png)
    yield from _body(program, profile)
    yield from _tail(program, profile)
    yield from carried.write(profile, facts.get("profile", ""), facts.get("version", ""))


def _head(
    program: Program, profile: Profile, facts: Mapping[str, str], thumbnail_png: bytes | None
) -> Iterator[str]:
    yield from profile.flavor.heads(facts.get("version", ""))
    yield f";TIME:{math.ceil(program.seconds)}"
    yield f";Filament used: {(program.feed_mm + program.primed_mm) / 1000:.5f}m"
    for key, value in facts.items():
        # The name of a file may hold a line end, and what is behind it would be a command.
        yield f"; vslice {key} = {value if value.isprintable() else ascii(value)}"
    yield f"; vslice shift_mm = {program.shift_mm[0]:.6f} {program.shift_mm[1]:.6f}"
    yield f"; vslice material_ul = {program.material_ul:.3f}"
    if thumbnail_png is not None and profile.gcode.thumbnail_px is not None:
        width, height = profile.gcode.thumbnail_px
        text = base64.b64encode(thumbnail_png).decode("ascii")
        yield f"; thumbnail begin {width}x{height} {len(text)}"
        for k in range(0, len(text), THUMBNAIL_LINE):
            yield f"; {text[k : k + THUMBNAIL_LINE]}"
        yield "; thumbnail end"


def _tail(program: Program, profile: Profile) -> Iterator[str]:
    seconds = math.ceil(program.seconds)
    parts = [(seconds // 86400, "d"), (seconds // 3600 % 24, "h"), (seconds // 60 % 60, "m")]
    text = " ".join(f"{count}{unit}" for count, unit in parts if count) + f" {seconds % 60}s"
    yield f"; estimated printing time (normal mode) = {text.strip()}"
    if profile.flavor.dated_head:
        yield from _settings(program, profile)
    if feed_area_mm2(profile.material) is not None:
        yield f"; filament used [mm] = {program.feed_mm + program.primed_mm:.5f}"
        yield f"; filament used [cm3] = {program.material_ul / 1000:.5f}"


def _settings(program: Program, profile: Profile) -> Iterator[str]:
    """What Moonraker shows of a program: temperatures, 0 where nothing is heated, and how high Z goes in it.

    Its height is looked for behind changes of layers, which a sheet does not have: one at the end tells it.
    """
    laid = [move.y_mm for move in program.moves if move.kind == Kind.EXTRUDE and move.toolpath >= 0]
    if laid:
        yield ";BEFORE_LAYER_CHANGE"
        yield f";{position(max(laid))}"
    yield f"; first_layer_temperature = {plain(profile.material.nozzle_temperature_c)}"
    yield f"; first_layer_bed_temperature = {plain(profile.material.bed_temperature_c)}"


def _body(program: Program, profile: Profile) -> Iterator[str]:
    horizontal, across = ("X", "Y") if profile.machine.plane == "XZ" else ("Y", "X")
    letters = (across, horizontal, "Z")  # the axis across the sheet is named once, at the first move
    at = ["", "", ""]
    speed = ""
    axis = _FeedAxis(profile.flavor)
    elapsed, percent = 0.0, -1
    for move, seconds in zip(program.moves, seconds_of(program.moves, profile).tolist(), strict=True):
        if profile.gcode.progress_m73 and program.seconds > 0:
            done = int(100 * elapsed / program.seconds)
            if done > percent:
                percent = done
                yield f"M73 P{percent} R{math.ceil((program.seconds - elapsed) / 60)}"
        elapsed += seconds
        kind = move.kind
        if kind in (Kind.TRAVEL, Kind.EXTRUDE):
            words = []
            for k, value in enumerate((move.depth_mm, move.x_mm, move.y_mm)):
                if not math.isnan(value) and (text := position(value)) != at[k]:
                    at[k] = text
                    words.append(letters[k] + text)
            if not words:
                continue
            if kind == Kind.EXTRUDE and move.e_mm:
                words.append(axis.extruded(move.e_mm))
            if (text := rate(move.speed_mm_s)) != speed:
                speed = text
                words.append("F" + text)
            yield ("G0 " if kind == Kind.TRAVEL else "G1 ") + " ".join(words)
        elif kind == Kind.FEED:
            speed = rate(move.speed_mm_s)
            yield f"G1 {axis.fed(move.e_mm)} F{speed}"
        else:
            yield _plain(move, profile.flavor)
    if profile.gcode.progress_m73 and percent < 100:
        yield "M73 P100 R0"


class _FeedAxis:
    """The axis that pushes material, from where it is or from the start of the program."""

    def __init__(self, flavor: Flavor) -> None:
        self._letter, self._relative = flavor.feed_letter, flavor.relative_feed
        self._debt = 0.0  # feed that was due and lost to rounding
        self._at = 0  # in the last decimal of E

    def extruded(self, mm: float) -> str:
        """The word of a toolpath; what rounding takes is given to the next."""
        text = feed(max(mm + self._debt, E_STEP))  # what extrudes must not become a travel
        self._debt += mm - float(text)
        return self._word(text)

    def fed(self, mm: float) -> str:
        """The word of a movement of the feed alone."""
        return self._word(feed(mm))

    def _word(self, text: str) -> str:
        if self._relative:
            return self._letter + text
        self._at += round(float(text) / E_STEP)
        return self._letter + feed(self._at * E_STEP)


def _plain(move: Move, flavor: Flavor) -> str:
    match move.kind:
        case Kind.FIRMWARE_RETRACT:
            return "G10"
        case Kind.FIRMWARE_PRIME:
            return "G11"
        case Kind.DWELL:
            return flavor.dwell(move.seconds)
        case Kind.COMMENT:
            return ";" + move.text
        case _:
            return move.text
