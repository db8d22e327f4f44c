"""``vslice play``: a page that plays a program, or two side by side."""

from pathlib import Path

import click

from vslice import output
from vslice.options import (
    is_stdout,
    not_onto_input,
    not_onto_profile,
    program_profile_option,
    set_option,
    settings_without_effect,
)
from vslice.terminal.session import common, progress, say


@click.command("play", epilog="Example: vslice play part.gcode --open")
@click.argument(
    "files", metavar="PART.gcode [OTHER.gcode]", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(path_type=Path, allow_dash=True),
    help="The page. By default PART.gcode with .html behind it; - is stdout.",
)
@click.option("--open", "open_it", is_flag=True, help="Open it in the browser.")
@click.option(
    "--grid",
    "grid_file",
    type=click.Path(path_type=Path),
    help="The grid that was sliced: check against it too, and colour by its tiles.",
)
@click.option("--no-check", is_flag=True, help="Do not look for what 'vslice check' finds.")
@program_profile_option
@set_option
@common
def command(
    files: tuple[Path, ...],
    out: Path | None,
    open_it: bool,
    grid_file: Path | None,
    no_check: bool,
    profile_name: str | None,
    overrides: tuple[str, ...],
) -> None:
    """Write one HTML file that plays a program as it would be printed, or two side by side.

    The page needs no network and no installation: any browser of 2023 or later opens it. It plays in the
    estimated time, draws beads, travels and the nozzle, and marks on its time line what 'vslice check' finds.
    """
    if len(files) > 2:
        raise click.UsageError(f"{len(files)} programs; a page plays one, or two side by side.")
    settings_without_effect("a page", overrides, "printer")
    target = None if is_stdout(out) else out or files[0].with_name(files[0].name + ".html")
    if target is None and open_it:
        raise click.UsageError("--open has no effect on a page that goes to stdout; leave it out.")
    for file in (*files, *([] if grid_file is None else [grid_file])):
        not_onto_input(file, target)
    not_onto_profile(profile_name, target)
    output.check_place(target)
    from gcode.player import page, track_of
    from vslice.machine import read_program

    sheet = None
    if grid_file is not None:
        from vslice.reading import read_grid

        sheet = read_grid(grid_file)
    tracks = []
    with progress(2 * len(files)) as step:
        for file in files:
            step(f"reading {file.name}")
            moves, _, profile = read_program(file, profile_name, overrides)
            step(f"replaying {file.name}")
            found, joins = [], frozenset[int]()
            if not no_check:
                from gcode.check import check

                report = check(moves, profile, sheet)
                found, joins = report.violations, report.join_lines
            track = track_of(moves, profile, name=file.name, findings=found, grid=sheet, joins=joins)
            if track.toolpaths == 0:
                say(f"Warning: {file}: nothing is extruded in it. Is the profile (-p) the right one?")
            tracks.append(track)
    output.write(target, [page(tracks).encode()])
    if target is not None:
        say(f"page written to {target}")
        if open_it:
            click.launch(target.resolve().as_uri())
