"""``vslice orient``: measured tissue becomes a grid of fibre angles."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice import output
from vslice.compiling import compiling
from vslice.options import (
    is_stdout,
    no_effect,
    not_onto_input,
    not_onto_profile,
    output_option,
    profile_option,
    set_option,
)
from vslice.orient_options import Numbers, layout_of, measuring_options
from vslice.orienting import DEFAULT_SPACING_MM, Sheet, measure, rows_of
from vslice.terminal.session import Steps, common, json_option, json_wanted, progress, say

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_TILES_DRAWN = 40_000


@click.command("orient", epilog="Example: vslice orient muscle.tif --tiles 16x16 --size-mm 40 -o grid.json")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@output_option("Grid file; - is stdout. By default FILE.json beside it.")
@measuring_options()
@click.option(
    "--picture",
    type=click.Path(path_type=Path),
    metavar="FILE.png",
    help="What was measured, drawn on the tissue. By default the grid's name with .orient.png.",
)
@click.option("--no-picture", is_flag=True, help="Draw none.")
@click.option("--hatch-lines", is_flag=True, help="Draw the toolpaths as well.")
@click.option(
    "--sidecar",
    type=click.Path(path_type=Path),
    metavar="FILE.json",
    help="Also write how it was measured as a sidecar, with the keys of BIDS where there are any.",
)
@click.option(
    "--sweep",
    type=Numbers("N,N,...", None, 1, 10_000),
    help="Compare numbers of columns: fidelity, length, travel and time; as table, CSV and plot.",
)
@profile_option
@set_option
@json_option
@common
def command(
    file: Path,
    out: Path | None,
    picture: Path | None,
    no_picture: bool,
    hatch_lines: bool,
    sidecar: Path | None,
    sweep: tuple[int, ...] | None,
    profile_name: str,
    overrides: tuple[str, ...],
    **asked: Any,
) -> None:
    """Measure fibre angles in tissue and write them as a grid.

    FILE is an image (PNG, JPEG, BMP, TIFF), a NIfTI volume of principal directions or of diffusion-weighted
    data, or a table of angles (.npy, .csv). Angles are axial and averaged as tensors; the record of how they
    were measured stands in the grid's meta.
    """
    target = None if is_stdout(out) else out or file.with_suffix(".json")
    drawn = _picture_place(target, picture, no_picture)
    if json_wanted() and target is None:
        raise click.UsageError("--json and the grid both go to stdout; name a file with -o.")
    swept = [] if sweep is None else _sweep_places(target, file)
    if no_picture:
        no_effect("no picture (--no-picture)", "picture", "hatch_lines")
    if sweep is None:
        no_effect("an orientation without --sweep", "profile_name", "overrides")
    if sidecar is not None and target is not None and sidecar.resolve() == target.resolve():
        raise click.UsageError(f"{sidecar} is to hold the grid; name another file with --sidecar.")
    for place in (target, drawn, sidecar, *swept):
        not_onto_input(file, place)
        not_onto_profile(profile_name, place)
        output.check_place(place)
    with progress(4) as step:
        sheet = measure(file, asked, spacing_mm=DEFAULT_SPACING_MM, step=step)
        if sheet.measured is None and sweep is not None:
            raise click.UsageError("--sweep has no effect on a table of angles; leave it out.")
        image = None
        if drawn is not None:
            step("drawing")
            image = _drawn(sheet, hatch_lines)
        rows = []
        if sweep is not None:
            with compiling(say):
                rows = _swept(sheet, asked, sweep, profile_name, overrides, step)
        step("writing")
        from slicer import grid

        if drawn is not None and image is not None:
            output.write(drawn, [image])
        if rows:
            _write_sweep(swept, rows)
        if sidecar is not None:
            from vslice.sidecar import sidecar as record

            output.write(sidecar, [record(sheet.grid, file)])
        output.write(target, [grid.dumps(sheet.grid).encode("utf-8")])
    told = rows_of(sheet) | {"written to": "stdout" if target is None else str(target)}
    if drawn is not None and image is not None:
        told["picture"] = str(drawn)
    say(_columns(told))
    if json_wanted():
        from vslice.figures import of_oriented

        click.echo(of_oriented(sheet, str(file)).text())
    if rows:
        say("\n" + _sweep_table(rows))


def _picture_place(target: Path | None, picture: Path | None, no_picture: bool) -> Path | None:
    if no_picture:
        return None
    if picture is None:
        return None if target is None else target.with_name(f"{target.stem}.orient.png")
    if picture.suffix.lower() != ".png":
        raise click.UsageError(f"{picture}: the picture must end in .png, not '{picture.suffix}'.")
    return picture


def _sweep_places(target: Path | None, file: Path) -> list[Path]:
    base = target or file
    return [base.with_name(f"{base.stem}.sweep{end}") for end in (".csv", ".png")]


def _drawn(sheet: Sheet, hatch_lines: bool) -> bytes | None:
    toolpaths: NDArray[Any] | None = None
    if hatch_lines:
        from slicer.hatch import hatch

        toolpaths = hatch(sheet.grid).segments
    if sheet.measured is None or sheet.oriented is None:
        from gcode import preview

        figure = preview.draw_grid(sheet.grid, show="toolpaths" if hatch_lines else "tilts")
        return preview.picture(figure, "png", dpi=150)
    from tissue.drawing import draw

    return draw(sheet.measured, sheet.oriented, toolpaths)


def _swept(
    sheet: Sheet,
    asked: Mapping[str, Any],
    sweep: tuple[int, ...],
    profile_name: str,
    overrides: tuple[str, ...],
    step: Steps,
) -> list[dict[str, float]]:
    """What each number of columns gives: how true it is, and what its print takes."""
    from tissue.orient import orient
    from vslice.pipeline import Search, slice_grid

    assert sheet.measured is not None
    rows = []
    for cols in sorted(set(sweep)):
        step.detail(f"{cols} columns")
        layout = replace(layout_of(asked, sheet.layout.spacing_mm), tiles=(cols, None), tile_mm=None)
        oriented = orient(sheet.measured, layout)
        sliced = slice_grid(
            oriented.sheet, profile_name, overrides, search=Search(effort="quick"), step=lambda name: None
        )
        plan, times = sliced.plan, sliced.program.times
        rows.append(
            {
                "cols": float(cols),
                "tile_mm": oriented.sheet.tile_mm[0],
                "deviation_deg": oriented.deviation_deg,
                "toolpaths": float(len(plan.toolpaths)),
                "printed_mm": plan.printed_mm,
                "travel_mm": plan.routed_mm,
                "time_s": float(sum(times)),
            }
        )
    return rows


def _write_sweep(places: list[Path], rows: list[dict[str, float]]) -> None:
    from tissue.drawing import draw_sweep

    def lines() -> Iterator[str]:
        yield ",".join(rows[0])
        for row in rows:
            yield ",".join(f"{value:.6g}" for value in row.values())

    output.write(places[0], [("\n".join(lines()) + "\n").encode("utf-8")])
    output.write(places[1], [draw_sweep(rows)])


def _sweep_table(rows: list[dict[str, float]]) -> str:
    heads = ("columns", "tile", "deviation", "toolpaths", "printed", "travel", "time")
    lines = ["".join(f"{head:>12}" for head in heads)]
    lines += [
        f"{row['cols']:>12.0f}{row['tile_mm']:>9.3g} mm{row['deviation_deg']:>11.1f}°"
        f"{row['toolpaths']:>12.0f}{row['printed_mm']:>9.0f} mm{row['travel_mm']:>9.0f} mm"
        f"{row['time_s']:>10.0f} s"
        for row in rows
    ]
    return "\n".join(lines)


def _columns(rows: Mapping[str, str]) -> str:
    width = max(map(len, rows))
    return "\n".join(f"{name:<{width}}  {value}" for name, value in rows.items())
