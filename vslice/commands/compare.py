"""``vslice compare``: every method on one sheet, side by side."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from vslice import output
from vslice.compiling import compiling
from vslice.options import (
    IGNORED,
    effort_option,
    is_stdout,
    no_effect,
    not_onto_input,
    not_onto_profile,
    objective_option,
    output_option,
    picture_format,
    profile_option,
    set_option,
    settings_without_effect,
    start_option,
    usual_nozzle_option,
    with_nozzle,
)
from vslice.terminal.session import common, json_option, json_wanted, progress, say

FORMATS = ("csv", "md", "json")


@click.command(
    "compare", epilog="Example: vslice compare grid.json --methods greedy,auto --seeds 5 -o table.md"
)
@click.argument("file", metavar="GRID.json", type=click.Path(path_type=Path))
@click.option("--methods", metavar="A,B,...", help="Which methods; all of them by default.")
@click.option(
    "--seeds",
    default=5,
    show_default=True,
    type=click.IntRange(1, 10_000),
    help="Runs of each method; one where it draws no random numbers.",
)
@effort_option
@objective_option("straight")
@start_option
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    help="Also draw every run over time: PNG, SVG or PDF. How far what the objective measures is above its "
    "best bound, in percent; or itself, in mm or s, where there is no bound.",
)
@click.option(
    "--play",
    "play",
    metavar="PAGE.html",
    type=click.Path(path_type=Path),
    help="Also write a page that plays the best run of each method, greedy's too, two of them side by side.",
)
@profile_option
@usual_nozzle_option
@set_option
@output_option("Table; .csv, .md or .json by its extension. By default, and with -, Markdown on stdout.")
@json_option
@common
def command(
    file: Path,
    methods: str | None,
    seeds: int,
    effort: str,
    objective: str,
    start: str,
    plot: Path | None,
    play: Path | None,
    profile_name: str,
    nozzle_name: str | None,
    overrides: tuple[str, ...],
    out: Path | None,
) -> None:
    """Compare the methods on a grid, or on an instance of the reference format.

    An instance is {"segments": [[[x, y], [x, y]], ...], "first": index or null}; it begins with that
    toolpath, or anywhere with --start free.

    For each method: straight travel J in mm (mean and best of the seeds), routed travel in mm, the seconds of
    all travels on the profile's machine as "vslice slice" estimates them, the bound on J that it proved, how
    far its mean J is above the best bound of all methods and below greedy's J, and the seconds of a run. All
    columns named J speak of straight travel, whatever --objective was aimed at. With --objective routed or
    time two more columns tell what was minimised, and its bound; the search counts the time of each travel
    from stop to stop.

    Below it stands the price of printability: how far the least J is above the J of the same toolpaths in any
    order at all, which no print can use.
    """
    target = None if is_stdout(out) else out
    file_format = "md" if target is None else target.suffix.lstrip(".").lower()
    if file_format not in FORMATS:
        raise click.UsageError(f"{out}: a table must end in .csv, .md or .json, not '{file_format}'.")
    _check_places(file, profile_name, {"-o": target, "--plot": plot, "--play": play})
    plot_format = None if plot is None else picture_format(plot)
    import profiles
    from slicer import sequence
    from vslice import comparison
    from vslice.objective import objective_name

    names = _methods(methods, list(sequence.METHODS))
    goal = objective_name(objective)
    if seeds > 1 and len(comparison.runs(names, 2, goal)) == len(comparison.runs(names, 1, goal)):
        no_effect(f"{', '.join(names)}, which draws no random numbers", "seeds")
    if all("effort" in IGNORED.get(name, ()) for name in names):
        no_effect(", ".join(names), "effort")
    settings_without_effect("the order of toolpaths", overrides, "gcode", "printer")
    profile = profiles.load(profile_name, with_nozzle(nozzle_name, overrides))
    problem, spacing_mm, ends = comparison.load_instance(file, start, profile)
    machine = comparison.Machine(profile, spacing_mm, ends)
    played = comparison.Played()
    # Under a body the corner of a grid may be no place to begin, nor the first toolpath, once it is cut.
    if problem.first is None and start == "corner" and spacing_mm is None and ends is None:
        no_effect("an instance without a first toolpath", "start")
    with progress(2 + len(comparison.runs(names, seeds, goal))) as step, compiling(say):
        step("loading")
        comparison.warm_up(problem, names, goal, machine)
        rows, traces, best = comparison.run_methods(
            problem,
            names,
            seeds=seeds,
            effort=effort,
            objective=goal,
            machine=machine,
            step=step,
            keep=None if play is None else played.keep,
        )
        step("without precedence")
        unordered = comparison.unordered(problem, best, effort)
    if json_wanted():
        click.echo(comparison.as_text(rows, "json", goal), nl=False)
    if target is not None or not json_wanted():
        output.write(target, [comparison.as_text(rows, file_format, goal).encode()])
    say(comparison.price_of_printability(rows, unordered))
    if plot is not None and plot_format is not None:
        from gcode import preview

        bound = max((row.cost_bound for row in rows if row.cost_bound is not None), default=None)
        title = f"{file.name}: {problem.n} toolpaths, aimed at {objective}, effort {effort}"
        figure = comparison.draw_runs(traces, bound, goal, title)
        output.write(plot, [preview.picture(figure, plot_format)])
        say(f"picture written to {plot}")
    if play is not None:
        output.write(play, [played.page(f"{file.name}: methods").encode()])
        say(f"page written to {play}")


def _check_places(file: Path, profile_name: str, places: Mapping[str, Path | None]) -> None:
    """Refuse places that cannot be written, or must not, before the work begins; by the option of each."""
    taken: dict[Path, str] = {}
    for option, place in places.items():
        not_onto_input(file, place, option=option)
        not_onto_profile(profile_name, place, option=option)
        output.check_place(place)
        if place is None:
            continue
        if (other := taken.setdefault(place.resolve(), option)) != option:
            what = {"-o": "the table", "--plot": "the picture"}[other]
            raise click.UsageError(f"{place} is to hold {what}; name another file with {option}.")


def _methods(text: str | None, known: Sequence[str]) -> list[str]:
    """The names in a list with commas, each once; spaces around them do not matter.

    Raises:
        UsageError: there is no such method, or none is named.
    """
    if text is None:
        return list(known)
    names = list(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise click.UsageError(f"There is no method '{name}'; there are {', '.join(known)}.{hint}")
    return names
