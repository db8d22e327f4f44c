"""``vslice preview``: a grid or a program as a picture."""

import shutil
import sys
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dialect.source import MAX_BYTES, Source, load_stream
from vslice import output
from vslice.compiling import compiling
from vslice.options import (
    no_effect,
    not_onto_input,
    not_onto_profile,
    nozzle_option,
    picture_format,
    program_profile_option,
    set_option,
    with_nozzle,
)
from vslice.terminal.failure import InputError
from vslice.terminal.session import common, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gcode.moves import Move
    from slicer.grid import Grid

MOST = 5  # gaps that are shown one by one


@click.command("preview", epilog="Example: vslice preview part.gcode -o part.png --color order")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(path_type=Path),
    help="Picture; PNG, SVG or PDF by its extension, or of a program GIF or MP4, which move. By default FILE "
    "with .png behind it.",
)
@click.option(
    "--show",
    type=click.Choice(["tilts", "toolpaths"]),
    default="tilts",
    show_default=True,
    help="Of a grid: the tilt of each tile, or the toolpaths in it.",
)
@click.option(
    "--conflicts",
    is_flag=True,
    help="Of a grid: the toolpaths that stand in the nozzle's way in a ring, and the worst pair.",
)
@click.option(
    "--hanging",
    is_flag=True,
    help="Of a program: what is laid with nothing under or beside it, farther than a bead's height.",
)
@click.option(
    "--color",
    type=click.Choice(["kind", "order"]),
    default="kind",
    show_default=True,
    help="Of a program: extrusion red and travel blue, or a ramp from the first toolpath to the last.",
)
@click.option(
    "--arrows", is_flag=True, help="Of a program: also direction and number of each toolpath long enough."
)
@click.option(
    "--dpi", default=150, show_default=True, type=click.IntRange(20, 1200), help="Resolution of a PNG."
)
@program_profile_option
@nozzle_option
@set_option
@common
def command(
    file: Path,
    out: Path | None,
    show: str,
    conflicts: bool,
    hanging: bool,
    color: str,
    arrows: bool,
    dpi: int,
    profile_name: str | None,
    nozzle_name: str | None,
    overrides: tuple[str, ...],
) -> None:
    """Draw a grid or a G-code program.

    A grid is a file whose first character is a brace; anything else is read as G-code. FILE may be - for
    standard input.
    """
    given = str(file) == "-"
    if given and out is None:
        raise click.UsageError("The picture of standard input needs a name: give -o PICTURE.png.")
    target = out or file.with_name(file.name + ".png")
    not_onto_input(file, target)
    not_onto_profile(profile_name, target)
    output.check_place(target)
    moving = target.suffix.lower() in (".gif", ".mp4")
    file_format = target.suffix.lstrip(".").lower() if moving else picture_format(target)
    if moving:
        no_effect(f"a moving picture, {target.suffix}", "color", "arrows", "hanging", "dpi")
        if file_format == "mp4" and shutil.which("ffmpeg") is None:
            raise InputError(f"{target}: ffmpeg, which writes MP4, is not installed here; name a .gif.")
    elif file_format != "png":
        no_effect(f"a picture of lines, {target.suffix}", "dpi")
    data = sys.stdin.buffer.read(MAX_BYTES + 1) if given else b""
    is_grid = begins_as_grid(data) if given else _is_grid(file)
    if is_grid:
        no_effect("a grid", "color", "arrows", "hanging")
        if moving:
            raise InputError(f"{target}: a grid has no order that could be played; slice it first.")
    else:
        no_effect("a program", "show", "conflicts")
    if not conflicts:
        no_effect("a grid" if is_grid else "a program", "nozzle_name")
        if not hanging:
            no_effect("a grid" if is_grid else "a program", "overrides")
    if is_grid and conflicts:
        no_effect("a picture of conflicts", "show")
    elif is_grid:
        no_effect("a grid", "profile_name")
    if moving:
        data = _moving(
            load_stream(BytesIO(data), "standard input") if given else file, file_format, profile_name
        )
        output.write(target, [data])
        say(f"picture written to {target}")
        return
    # What draws is imported once there is something to draw: it takes longer than all before.
    if is_grid:
        from slicer import grid
        from vslice.reading import read_grid, say_warnings

        if given:
            sheet = grid.from_bytes(data, source="standard input")
            say_warnings(sheet)
        else:
            sheet = read_grid(file)
        from gcode import preview

        if conflicts:
            figure = _of_conflicts(sheet, profile_name, with_nozzle(nozzle_name, overrides))
        else:
            figure = preview.draw_grid(sheet, show="tilts" if show == "tilts" else "toolpaths")
    else:
        from vslice.machine import read_program

        source = load_stream(BytesIO(data), "standard input") if given else file
        moves, _, profile = read_program(source, profile_name, overrides)
        from gcode import preview

        drawing = preview.Drawing.of_moves(moves, profile)
        if len(drawing.toolpaths) == 0:
            raise InputError(f"{file}: nothing is extruded in it. Is the profile (-p) the right one?")
        if hanging:
            from gcode.hanging import with_hanging

            drawing = with_hanging(drawing, moves, profile.material)
        _say_gaps(preview.not_drawn(moves, profile))
        figure = preview.draw_sequence(
            drawing,
            color="order" if color == "order" else "kind",
            axes=profile.machine.plane,
            arrows=arrows,
        )
    output.write(target, [preview.picture(figure, file_format, dpi=dpi)])
    say(f"picture written to {target}")


def _of_conflicts(sheet: "Grid", profile_name: str | None, overrides: tuple[str, ...]) -> "Figure":
    """The picture of what stands in a nozzle's way.

    Raises:
        InputError: the nozzle is a point.
    """
    import profiles
    from vslice.conflicts import draw_conflicts
    from vslice.machine import FALLBACK
    from vslice.pipeline import hatched

    name = profile_name or FALLBACK
    profile = profiles.load(name, overrides)
    if profile.nozzle.tip_width_mm <= 0:
        raise InputError(
            f"{name}: its nozzle is a point, in whose way nothing stands; name one with --nozzle."
        )
    with compiling(say):
        return draw_conflicts(sheet, hatched(sheet), profile)


def _moving(source: "Path | Source", file_format: str, profile_name: str | None) -> bytes:
    from gcode.animation import animation
    from gcode.player import track_of
    from vslice.machine import read_program

    moves, _, profile = read_program(source, profile_name, ())
    name = source.name
    track = track_of(moves, profile, name=name)
    if track.toolpaths == 0:
        raise InputError(f"{name}: nothing is extruded in it. Is the profile (-p) the right one?")
    return animation(track, file_format)


def _say_gaps(gaps: "list[Move]") -> None:
    """A picture with a gap must not pass for the whole print."""
    if not gaps:
        return
    shown = "".join(f"\n  line {move.line}: {move.text}" for move in gaps[:MOST])
    more = f"\n  and {len(gaps) - MOST} more" if len(gaps) > MOST else ""
    say(f"Warning: not drawn, since these are not followed here:{shown}{more}")


def _is_grid(file: Path) -> bool:
    if not file.is_file() or file.suffix.lower() == ".csv":
        return file.suffix in (".json", ".csv", ".geojson")  # its reader says what is wrong
    with file.open("rb") as head:
        return begins_as_grid(head.read(64))


def begins_as_grid(data: bytes) -> bool:
    """Whether the first character is one of JSON."""
    return data[:64].lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"[")
