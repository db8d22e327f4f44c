"""A program becomes a file: a head and a tail that say what it is, and its moves between them."""

import base64
import math
from collections.abc import Iterator, Mapping

import numpy as np

from dialect.numbers import plain, position
from gcode import carried
from gcode.bead import feed_area_mm2
from gcode.moves import Kind
from gcode.program import Program
from gcode.written import written
from profiles import Profile

THUMBNAIL_LINE = 78


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
    yield f";TIME:{_whole_s(program)}"
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


def _whole_s(program: Program) -> int:
    """The estimated duration, rounded up; a whole second that was added up in another order stays one."""
    return math.ceil(round(program.seconds, 6))


def _tail(program: Program, profile: Profile) -> Iterator[str]:
    seconds = _whole_s(program)
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
    """The moves, with how far the print is before each that is the first of another percent."""
    lines = written(program.moves, profile)
    if not profile.gcode.progress_m73 or program.seconds <= 0:
        yield from (line for _, line in lines)
        return
    passed = np.concatenate(([0.0], np.cumsum(program.move_seconds))).tolist()
    percent = -1
    for k, line in lines:
        done = int(100 * passed[k] / program.seconds)
        if done > percent:
            percent = done
            yield f"M73 P{percent} R{math.ceil((program.seconds - passed[k]) / 60)}"
        yield line
    if percent < 100:
        yield "M73 P100 R0"
