"""``vslice compare``: every method on one sheet, side by side."""

from pathlib import Path

import click

from vslice import output
from vslice.options import (
    effort_option,
    objective_option,
    output_option,
    profile_option,
    set_option,
    start_option,
)
from vslice.session import common, progress, say

FORMATS = ("csv", "md", "json")


@click.command(
    "compare", epilog="Example: vslice compare grid.json --methods greedy,auto --seeds 5 -o table.md"
)
@click.argument("file", metavar="GRID.json", type=click.Path(path_type=Path))
@click.option("--methods", metavar="A,B,...", help="Which methods; all of them by default.")
@click.option("--seeds", default=5, show_default=True, type=click.IntRange(1), help="Runs of each method.")
@effort_option
@objective_option("straight")
@start_option
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    help="Also draw the gap to the bound over time: PNG, SVG or PDF.",
)
@profile_option
@set_option
@output_option("Table; .csv, .md or .json by its extension. By default Markdown on stdout.")
@common
def command(
    file: Path,
    methods: str | None,
    seeds: int,
    effort: str,
    objective: str,
    start: str,
    plot: Path | None,
    profile_name: str,
    overrides: tuple[str, ...],
    out: Path | None,
) -> None:
    """Compare the methods on a grid, or on an instance of the reference format.

    For each method: straight travel J (mean and best of the seeds), routed travel, its seconds on the
    profile's machine, the gap to the best bound that any of them proved, and what it took.
    """
    to_stdout = out is None or str(out) == "-"
    file_format = "md" if to_stdout or out is None else out.suffix.lstrip(".")
    if file_format not in FORMATS:
        raise click.UsageError(f"{out}: a table must end in .csv, .md or .json, not '{file_format}'.")
    import profiles
    from slicer import sequence
    from vslice import study
    from vslice.objective import objective_name

    names = methods.split(",") if methods else list(sequence.METHODS)
    unknown = [name for name in names if name not in sequence.METHODS]
    if unknown:
        raise click.UsageError(f"There is no method '{unknown[0]}'; there are {', '.join(sequence.METHODS)}.")
    profile = profiles.load(profile_name, overrides)
    problem = study.load_problem(file, start)
    with progress(len(names) * seeds + 1) as step:
        rows, traces = study.run_methods(
            problem,
            names,
            seeds=seeds,
            effort=effort,
            objective=objective_name(objective),
            profile=profile,
            step=step,
        )
    output.write(None if to_stdout else out, [study.as_text(rows, file_format).encode()])
    if plot is not None:
        from gcode import preview

        bound = max((row.bound_mm for row in rows if row.bound_mm is not None), default=None)
        unit = "s" if objective == "time" else "mm"
        figure = study.draw_gap(traces, bound if objective == "straight" else None, unit)
        output.write(plot, [preview.picture(figure, plot.suffix.lstrip(".").lower())])
        say(f"picture written to {plot}")
