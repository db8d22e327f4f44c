"""``vslice nozzles``: which nozzles print a sheet, before one is bought."""

from pathlib import Path

import click

from vslice import output
from vslice.compiling import compiling
from vslice.options import (
    not_onto_input,
    not_onto_profile,
    picture_format,
    profile_option,
    set_option,
    settings_without_effect,
)
from vslice.terminal.session import common, progress, say


@click.command("nozzles", epilog="Example: vslice nozzles grid.json -p marlin-syringe --plot nozzles.png")
@click.argument("grid_file", metavar="GRID.json", type=click.Path(path_type=Path))
@click.option("--only", metavar="A,B,...", help="These nozzles; by default all that are known.")
@click.option(
    "--method",
    default="greedy",
    show_default=True,
    metavar="METHOD",
    help="How the toolpaths are ordered, as for 'vslice slice'; better orders take longer.",
)
@click.option("--plot", type=click.Path(path_type=Path), help="Also draw it: PNG, SVG or PDF.")
@click.option("--json", "as_json", is_flag=True, help="JSON instead of a table.")
@profile_option
@set_option
@common
def command(
    grid_file: Path,
    only: str | None,
    method: str,
    plot: Path | None,
    as_json: bool,
    profile_name: str,
    overrides: tuple[str, ...],
) -> None:
    """Compare nozzles on a grid: which print it as it is, and what it takes with the others.

    For each nozzle: how many toolpaths stand in one another's way in a ring, so that none of them can be
    printed first; how many pieces they must be cut into; how deep the printed pushes into the nozzle; and
    the time of the travels, in the order that the method finds. Below stand the widest blunt needle, and
    the widest cone on the profile's own tip, that print the sheet without a cut.
    """
    not_onto_input(grid_file, plot, option="--plot")
    not_onto_profile(profile_name, plot, option="--plot")
    output.check_place(plot)
    plot_format = None if plot is None else picture_format(plot)
    settings_without_effect("the choice of a nozzle", overrides, "gcode", "printer")
    import profiles
    from vslice import fitting
    from vslice.pipeline import hatched
    from vslice.reading import read_grid

    own = profiles.load(profile_name, overrides)
    sheet = read_grid(grid_file)
    lines = hatched(sheet)
    height = float(lines.segments[:, :, 1].max() - lines.segments[:, :, 1].min())
    names = None if only is None else [name.strip() for name in only.split(",")]
    known = fitting.candidates(height, names)
    with progress(len(known) + 1) as step, compiling(say):
        found = []
        for nozzle in known:
            step(nozzle.name)
            profile = profiles.load(profile_name, (*overrides, *nozzle.settings()))
            found.append(fitting.fit(sheet, lines, profile, nozzle.name, method))
        step("limits")
        tried = 0

        def told() -> None:
            nonlocal tried
            tried += 1
            step.detail(f"limits, {tried} tried")

        fits = fitting.Fits(*fitting.limits(sheet, lines, own, told), found)
    click.echo(fitting.as_json(fits) if as_json else fitting.as_table(fits))
    if plot is not None and plot_format is not None:
        from gcode import preview

        title = f"{grid_file.name}: {len(lines.segments)} toolpaths"
        output.write(plot, [preview.picture(fitting.draw(fits, title), plot_format)])
        say(f"picture written to {plot}")
