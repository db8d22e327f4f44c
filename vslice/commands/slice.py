"""``vslice slice``: a grid of fibre angles becomes G-code."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import click

from vslice import __version__, output
from vslice.session import common, progress, say


@click.command(
    "slice",
    epilog="Example: vslice grid.json -o part.gcode -p marlin-syringe --set motion.travel_speed_mm_s=80",
)
@click.argument("grid_file", metavar="GRID.json", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(path_type=Path, allow_dash=True),
    help="G-code file; - is stdout. By default GRID.gcode beside the grid.",
)
@click.option(
    "-p", "--profile", "profile_name", default="marlin-generic", show_default=True, metavar="NAME|FILE.toml",
    help="The machine: a shipped profile, or a file of your own.",
)  # fmt: skip
@click.option(
    "--set", "overrides", multiple=True, metavar="SECTION.KEY=VALUE", help="Change one setting; repeatable."
)
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
    import profiles
    from gcode import emit, program
    from slicer import grid, hatch, sequence, travel

    profile = profiles.load(profile_name, overrides)
    with progress(6) as step:
        step("reading")
        sheet = grid.read(grid_file)
        step("hatching")
        lines = hatch.hatch(sheet)
        n = len(lines.segments)
        if n == 0:
            raise click.ClickException(
                f"{grid_file}: no toolpath is left of it: "
                + (
                    f"{lines.dropped} were shorter than min_length_mm."
                    if lines.dropped
                    else "all tiles are empty."
                )
            )
        step("sequencing")
        first = lines.segments[0]
        corner = {"first": 0, "first_flipped": bool(first[1, 1] < first[0, 1])}
        free: dict[str, None] = {"first": None, "first_flipped": None}
        chosen = sequence.solve(
            sequence.Problem.build(lines.segments, **(free if start == "free" else corner)),
            method=method,
            seed=seed,
        )
        step("routing")
        clearance = profile.motion.clearance_mm
        plan = travel.plan(lines.segments, chosen.order, chosen.flipped, clearance_mm=clearance)
        tile = lines.tile[chosen.order]
        spacing = sheet.spacing_mm[tile[:, 1], tile[:, 0]]
        step("building")
        made = program.build(plan, profile, spacing, tile)
        facts = {
            "version": __version__,
            "grid_sha256": sheet.sha256,
            "profile": profile_name if profile_name in profiles.shipped() else Path(profile_name).name,
            "method": chosen.method,
            "seed": str(seed),
            "toolpaths": str(n),
            "travel_straight_mm": f"{plan.straight_mm:.3f}",
            "travel_routed_mm": f"{plan.routed_mm:.3f}",
            "printed_mm": f"{plan.printed_mm:.3f}",
        }
        if overrides:
            facts["settings"] = " ".join(overrides)
        picture = None
        if profile.gcode.thumbnail_px is not None:
            from gcode import preview

            picture = preview.thumbnail(plan, profile.gcode.thumbnail_px)
        step("writing")
        text = emit.emit(made, profile, facts, thumbnail_png=picture)
        target = _target(grid_file, out)
        output.write(target, _encoded(text))
    in_file_order = travel.straight_mm(lines.segments)
    saved = 1 - plan.straight_mm / in_file_order if in_file_order else 0.0
    feed = f" ({made.feed_mm:.2f} mm of feed)" if made.feed_mm else ""
    say(
        _table(
            {
                "toolpaths": f"{n}" + (f"  ({lines.dropped} too short, dropped)" if lines.dropped else ""),
                "printed length": f"{plan.printed_mm:.1f} mm",
                "straight travel J": f"{plan.straight_mm:.3f} mm",
                "routed travel": f"{plan.routed_mm:.3f} mm",
                "material": f"{made.material_ul:.1f} µL{feed}",
                "estimated time": f"{math.ceil(made.seconds)} s",
                "saved": f"{saved:.1%} of the {in_file_order:.1f} mm in file order, by {chosen.method}",
                "written to": str(target) if target else "stdout",
            }
        )
    )


def _target(grid_file: Path, out: Path | None) -> Path | None:
    """Where the program goes; None is stdout."""
    if out is None:
        return grid_file.with_suffix(".gcode")
    return None if str(out) == "-" else out


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
