"""``vslice slice``: a grid of fibre angles, or an image in which they are measured, becomes G-code."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice import output
from vslice.compiling import compiling
from vslice.options import (
    IGNORED,
    IGNORED_STRAIGHT,
    METHOD_NAMES,
    MOST_SEED,
    MOST_WORKERS,
    effort_option,
    grid_argument,
    is_stdout,
    no_effect,
    not_onto_input,
    not_onto_profile,
    objective_option,
    output_option,
    profile_option,
    seconds,
    set_option,
    start_option,
    usual_nozzle_option,
    with_nozzle,
)
from vslice.orient_options import ALL, means_angles, measured_kind, measuring_options
from vslice.sliced_rows import sliced_rows
from vslice.terminal.session import (
    Steps,
    common,
    json_option,
    json_wanted,
    progress,
    say,
    so_far,
    warnings_said,
)

if TYPE_CHECKING:  # it imports all that is heavy
    from slicer.grid import Grid
    from vslice.printable import Conflicts


@click.command(
    "slice",
    epilog="Example: vslice grid.json -o part.gcode -p marlin-syringe --set motion.travel_speed_mm_s=80",
)
@grid_argument
@output_option("G-code file; - is stdout. By default GRID.gcode beside the grid.")
@profile_option
@usual_nozzle_option
@set_option
@click.option(
    "--method",
    default="auto",
    show_default=True,
    metavar="METHOD",
    help=f"How the toolpaths are ordered: {', '.join(METHOD_NAMES[:-1])} or {METHOD_NAMES[-1]}.",
)
@effort_option
@objective_option("time")
@start_option
@click.option(
    "--conflicts",
    type=click.Choice(["cut", "press", "refuse"]),
    default="cut",
    show_default=True,
    help="Toolpaths that stand in the nozzle's way in a ring: cut them, press the nozzle into them as little "
    "as can be, or refuse the sheet.",
)
@click.option(
    "--seed", default=0, show_default=True, type=click.IntRange(0, MOST_SEED), help="For random numbers."
)
@click.option(
    "--time-limit",
    "time_limit_s",
    type=seconds,
    metavar="S",
    help="End the search early. Cutting, and finding what must come first, count too, but are not cut short.",
)
@click.option(
    "--workers",
    default=1,
    show_default=True,
    type=click.IntRange(1, MOST_WORKERS),
    help="Processes to search with; no more run than there are cores and memory for.",
)
@click.option(
    "--fresh",
    is_flag=True,
    help="Do not start from the last order of the same sheet, and do not keep this one.",
)
@click.option("--send", is_flag=True, help="Check the program and stream it to the printer at --port.")
@click.option("--port", metavar="PORT", help="With --send: as for 'vslice send'.")
@click.option(
    "--upload",
    "upload_to",
    metavar="HOST",
    help="Check the program and upload it to a host of 'vslice config'.",
)
@measuring_options(shown=("tiles", "size_mm"))
@json_option
@common
def command(
    grid_file: Path,
    out: Path | None,
    profile_name: str,
    nozzle_name: str | None,
    overrides: tuple[str, ...],
    method: str,
    effort: str,
    objective: str,
    start: str,
    conflicts: "Conflicts",
    seed: int,
    time_limit_s: float | None,
    workers: int,
    fresh: bool,
    send: bool,
    port: str | None,
    upload_to: str | None,
    **asked: Any,
) -> None:
    """Turn a grid of fibre angles into G-code; - reads the grid from standard input.

    An image or a volume is measured first, with all options of 'vslice orient' that say how.

    Toolpaths are hatched into the tiles, put into an order in which each is laid after all that lies
    below it or would stand in the nozzle's way, and joined by travels that pass over what is printed.
    Ctrl-C ends the search for an order and goes on with the best one found.
    """
    piped = str(grid_file) == "-"
    target = None if is_stdout(out) or (piped and out is None) else out or grid_file.with_suffix(".gcode")
    not_onto_input(grid_file, target)
    not_onto_profile(profile_name, target)
    output.check_place(target)
    if json_wanted() and target is None:
        raise click.UsageError("--json and the program both go to stdout; name a file with -o.")
    if port is not None and not send:
        raise click.UsageError("--port goes with --send.")
    if send and target is None:
        raise click.UsageError("--send streams from a file; give it a name with -o.")
    if upload_to is not None and (send or target is None):
        raise click.UsageError("--upload takes a file, which -o names, and goes without --send.")
    if upload_to is not None:
        from vslice.handing_over import destination

        where = destination(upload_to, None, None, None)  # rather than behind a long search
    if port is not None:
        from printer.ports import check_name

        check_name(port)  # rather than behind a long search
    ignored = (IGNORED_STRAIGHT if objective == "straight" else IGNORED).get(method, ())
    no_effect(f"--method {method}", *(name for name in ignored if name != "workers" or workers > 1))
    measured = not piped and (measured_kind(grid_file) is not None or means_angles(grid_file))
    if not measured:
        no_effect("a grid", *ALL)
    restart = target is not None and _may_lose_job(target, send)
    from slicer.sequence.problem import unit_of
    from vslice.objective import objective_name
    from vslice.pipeline import Search, slice_grid

    overrides = with_nozzle(nozzle_name, overrides)
    if send or upload_to is not None:
        import profiles
        from vslice.commands.send import refuse_unsure
        from vslice.handing_over import refuse_foreign

        profile = profiles.load(profile_name, overrides)
        if send:
            refuse_unsure(profile)  # rather than behind a long search
        elif target is not None:
            refuse_foreign(target, profile, where.to)
    unit = unit_of(objective_name(objective))
    search = Search(
        method, effort, objective, start, conflicts, seed, time_limit_s, workers, recall=not fresh
    )
    with progress(8 if measured else 6) as step, compiling(say), warnings_said():
        sliced = slice_grid(
            _measured(grid_file, profile_name, overrides, asked, step) if measured else grid_file,
            profile_name,
            overrides,
            search=search,
            step=step,
            progress=lambda found: step.detail(so_far(found, unit)),
        )
        step("writing")
        output.write(target, _encoded(sliced.text()))
    for sentence in sliced.advice():
        say(f"Warning: {sentence}")
    for place in sliced.pressed_places():
        say(place)
    last = {"written to": "stdout" if target is None else str(target)}
    if measured:
        last["grid"] = "not kept; 'vslice orient' writes it, for 'vslice check --grid'"
    say(_table(sliced_rows(sliced) | last))
    if json_wanted():
        from vslice.figures import of_sliced

        click.echo(of_sliced(sliced, str(target)).text())
    if upload_to is not None and target is not None:
        from vslice.commands.send import check
        from vslice.handing_over import hand_over

        check(target, sliced.profile, "uploaded")
        hand_over(target, target.name, where, start=False)
    if send and target is not None:
        from vslice.commands.send import check, send_file

        check(target, sliced.profile)
        click.get_current_context().exit(send_file(target, port, sliced.profile, "", restart))


def _measured(
    file: Path, profile_name: str, overrides: tuple[str, ...], asked: Mapping[str, Any], step: Steps
) -> "Grid":
    """The grid that is measured in a file; toolpaths are as far apart as the profile's lines are wide."""
    import profiles
    from vslice.orienting import measure, rows_of

    width = profiles.load(profile_name, overrides).material.width_mm
    sheet = measure(file, asked, spacing_mm=width, step=step)
    say(_table(rows_of(sheet)))
    return sheet.grid


def _may_lose_job(target: Path, send: bool) -> bool:
    """Warn of an interrupted job whose program is to be written over; to send, ask. Whether to begin anew."""
    from printer.journal import journal_path
    from vslice.terminal.interrupted import ask, known_of

    journal = journal_path(target)
    if known_of(journal) is None:
        return False
    if send:
        if ask(target, journal, restart=False) == "resume":
            raise click.UsageError(f"Go on with it by 'vslice send --resume {target}'; nothing was sliced.")
        return True
    say(
        f"Warning: {target}: {known_of(journal)}. When another program is written here, that job cannot be "
        "resumed: to keep it, stop now and name another file with -o."
    )
    return False


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
