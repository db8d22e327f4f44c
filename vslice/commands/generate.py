"""``vslice generate``: a random grid of fibre angles."""

from pathlib import Path

import click

from vslice import output
from vslice.options import Number
from vslice.terminal.session import common, say

MOST_TILES = 1_000_000


@click.command("generate", epilog="Example: vslice generate --cols 4 --rows 4 --seed 7 -o grid.json")
@click.option(
    "--cols", default=4, show_default=True, type=click.IntRange(1, 10_000), help="Tiles from left to right."
)
@click.option(
    "--rows", default=4, show_default=True, type=click.IntRange(1, 10_000), help="Tiles from bottom to top."
)
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=click.IntRange(0, 2**63 - 1),
    help="The same seed gives the same grid.",
)
@click.option("--tile-mm", default=1.0, show_default=True, type=Number(0.01, 10_000), help="Side of a tile.")
@click.option(
    "--spacing-mm",
    default=0.1,
    show_default=True,
    type=Number(0.01, 10_000),
    help="Distance between toolpaths.",
)
@click.option(
    "--start-deg",
    default=-45.0,
    show_default=True,
    type=Number(-90, 90),
    help="Tilt of the bottom left tile.",
)
@click.option(
    "--deviation-deg", default=22.5, show_default=True, type=Number(0, 180), help="Largest step, either way."
)
@click.option(
    "--low-deg",
    default=-45.0,
    show_default=True,
    type=Number(-90, 90),
    help="Lowest tilt; walks are reflected there.",
)
@click.option(
    "--high-deg",
    default=0.0,
    show_default=True,
    type=Number(-90, 90),
    help="Highest tilt; walks are reflected there.",
)
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(path_type=Path, allow_dash=True),
    default=Path("-"),
    help="Grid file; by default, and with -, stdout.",
)
@common
def command(
    cols: int,
    rows: int,
    seed: int,
    tile_mm: float,
    spacing_mm: float,
    start_deg: float,
    deviation_deg: float,
    low_deg: float,
    high_deg: float,
    out: Path,
) -> None:
    """Write a random grid of fibre angles.

    A random walk: every tile is the mean of its left and its lower neighbour plus a uniform deviation,
    reflected back into the range of tilts. The defaults are those of the source paper.
    """
    if cols * rows > MOST_TILES:
        raise click.UsageError(
            f"{cols} x {rows} tiles are {cols * rows}, but a grid may have {MOST_TILES}; ask for fewer."
        )
    from slicer import grid
    from slicer.generate import random_walk

    sheet = random_walk(
        cols,
        rows,
        seed=seed,
        tile_mm=tile_mm,
        spacing_mm=spacing_mm,
        start_deg=start_deg,
        deviation_deg=deviation_deg,
        low_deg=low_deg,
        high_deg=high_deg,
    )
    to_stdout = str(out) == "-"
    output.write(None if to_stdout else out, [grid.dumps(sheet).encode("utf-8")])
    if not to_stdout:
        say(f"{cols} x {rows} tiles written to {out}")
