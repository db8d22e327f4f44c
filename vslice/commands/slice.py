"""``vslice slice``: a grid of fibre angles becomes G-code."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vslice import output
from vslice.options import grid_argument, is_stdout, not_onto_input, output_option, profile_option, set_option
from vslice.session import common, progress, say

if TYPE_CHECKING:  # it imports all that is heavy
    from vslice.pipeline import Sliced


@click.command(
    "slice",
    epilog="Example: vslice grid.json -o part.gcode -p marlin-syringe --set motion.travel_speed_mm_s=80",
)
@grid_argument
@output_option("G-code file; - is stdout. By default GRID.gcode beside the grid.")
@profile_option
@set_option
@click.option("--method", default="greedy", show_default=True, help="How the toolpaths are ordered.")
@click.option(
    "--start",
    type=click.Choice(["corner", "free"]),
    default="corner",
    show_default=True,
    help="Begin with the lowest toolpath of the bottom left tile, at its lower end, or wherever is best.",
)
@click.option("--seed", default=0, show_default=True, help="For methods that draw random numbers.")
@common
def command(
    grid_file: Path,
    out: Path | None,
    profile_name: str,
    overrides: tuple[str, ...],
    method: str,
    start: str,
    seed: int,
) -> None:
    """Turn a grid of fibre angles into G-code.

    Toolpaths are hatched into the tiles, put into an order in which each is laid after all that lies
    below it, and joined by travels that pass over what is printed.
    """
    target = None if is_stdout(out) else out or grid_file.with_suffix(".gcode")
    not_onto_input(grid_file, target)
    from vslice.pipeline import slice_grid

    with progress(6) as step:
        sliced = slice_grid(
            grid_file, profile_name, overrides, method=method, start=start, seed=seed, step=step
        )
        step("writing")
        output.write(target, _encoded(sliced.text()))
    filled = sliced.program.material_ul / sliced.room_ul
    if not 0.5 <= filled <= 1.25:
        say(
            f"Warning: the beads fill {filled:.0%} of the room that spacing and width leave them. "
            "See [material] bead_shape, width_mm, height_mm and flow."
        )
    say(_table(_rows(sliced) | {"written to": "stdout" if target is None else str(target)}))


def _rows(sliced: "Sliced") -> dict[str, str]:
    """What a user wants to know of a sliced sheet."""
    plan, made = sliced.plan, sliced.program
    dropped = f"  ({sliced.lines.dropped} too short, dropped)" if sliced.lines.dropped else ""
    feed = f" ({made.feed_mm:.2f} mm of feed)" if made.feed_mm else ""
    room = sliced.room_ul
    before = sliced.in_file_order_mm
    saved = 1 - plan.straight_mm / before if before else 0.0
    return {
        "toolpaths": f"{len(plan.toolpaths)}{dropped}",
        "printed length": f"{plan.printed_mm:.1f} mm",
        "straight travel J": f"{plan.straight_mm:.3f} mm",
        "routed travel": f"{plan.routed_mm:.3f} mm",
        "material": f"{made.material_ul:.1f} µL{feed}, {made.material_ul / room:.0%} of the room for it",
        "estimated time": f"{math.ceil(made.seconds)} s",
        "saved": f"{saved:.1%} of the {before:.1f} mm in file order, by {sliced.result.method}",
    }


def _encoded(lines: Iterator[str]) -> Iterator[bytes]:
    """Lines with their ends, in blocks that are worth a write."""
    block: list[str] = []
    for line in lines:
        block.append(line)
        if len(block) == 4096:
            yield ("\n".join(block) + "\n").encode("utf-8")
            block = []
    if block:
        yield ("\n".join(block) + "\n").encode("utf-8")


def _table(rows: Mapping[str, str]) -> str:
    width = max(map(len, rows))
    return "\n".join(f"{name:<{width}}  {value}" for name, value in rows.items())
