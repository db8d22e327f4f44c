"""``vslice study``: many sheets on Dask, and what they say."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice import output
from vslice.compiling import compiling
from vslice.options import no_effect
from vslice.terminal.failure import InputError
from vslice.terminal.session import common, progress, say

if TYPE_CHECKING:
    from studies import Study
    from studies.run import Standing

MB_A_WORKER = 700
"""What a worker needs for sheets of a few thousand toolpaths, the libraries included."""
SYSTEM_MB = 1000
"""Memory that is left to everything else."""


class StudyGroup(click.Group):
    """Reads anything that is no subcommand as ``run STUDY``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, "-h", "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group("study", cls=StudyGroup, epilog="Example: vslice study study.toml -o results/")
def command() -> None:
    """Order thousands of sheets, and report what they say.

    `vslice study FILE` is short for `vslice study run FILE`.
    """


@command.command("run", epilog="Example: vslice study study.toml -o results/ --workers 8")
@click.argument("study_file", metavar="STUDY.toml|NAME")
@click.option(
    "-o", "--output", "folder", type=click.Path(path_type=Path), required=True, help="Folder of the results."
)
@click.option(
    "--workers",
    type=click.IntRange(1, 100_000),
    help="Processes here. By default one a core, as memory allows.",
)
@click.option(
    "--scheduler", metavar="tcp://HOST:PORT", help="A Dask scheduler that runs, instead of processes here."
)
@click.option("--retry-failed", is_flag=True, help="Try again what failed before.")
@click.option(
    "--dry-run", is_flag=True, help="Say how many tasks there are, and show the first, and do no more."
)
@common
def run_command(
    study_file: str,
    folder: Path,
    workers: int | None,
    scheduler: str | None,
    retry_failed: bool,
    dry_run: bool,
) -> None:
    """Run a study, or what is left of it.

    A study is a TOML file that names factors and their levels, or the name of a shipped one. Every sheet's
    figures are kept as they come: after a crash, the same command goes on.
    """
    if scheduler is not None:
        no_effect("a scheduler elsewhere (--scheduler)", "workers")
    _need("dask", "distributed", "pyarrow", "locket")
    from studies import read_study
    from vslice import __version__
    from vslice.experiment import CALL, FIGURES, USUAL, VOCABULARY

    study = read_study(study_file, VOCABULARY, USUAL, (*FIGURES, "seconds"))
    if dry_run:
        no_effect("a dry run (--dry-run)", "workers", "scheduler", "retry_failed")
        _describe(study)
        return
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; name a folder with -o.")
    from studies.cluster import elsewhere, local_cluster
    from studies.run import run
    from studies.store import Store

    with Store(folder, study, FIGURES, __version__) as store:
        if retry_failed:
            store.forget_failed()
        before = len(store.finished) + len(store.failed)
        if before:
            say(f"{folder}: {before} of {len(study)} tasks are done already.")
        if before < len(study):
            count = _workers(workers)
            place = elsewhere(scheduler) if scheduler else local_cluster(*count)
            try:
                _run_on(place, lambda client, told: run(study, CALL, store, client, told), len(study))
            except KeyboardInterrupt:
                store.flush()
                done = len(store.finished) + len(store.failed)
                say(f"{done} of {len(study)} tasks are done and kept; the same command goes on.")
                raise
        table = store.finish()
        failed = len(store.failed)
    say(f"{len(study)} tasks done, {failed} failed; table written to {table}")
    if failed:
        say("Errors stand in the column 'error'; --retry-failed tries those tasks again.")
    say(f"'vslice study report {folder}' says what they show.")


def _run_on(place: Any, work: Any, total: int) -> None:
    from studies.run import Standing

    with progress(1) as step, compiling(say) as first_run:
        from vslice.experiment import warm_up

        step("tasks")
        step.detail("getting ready")
        if first_run:
            warm_up()
        with place as client:
            say(f"Dask's dashboard: {client.dashboard_link}")
            begun = time.monotonic()

            def told(standing: Standing) -> None:
                step.part(standing.done / total)
                step.detail(_how_it_stands(standing, time.monotonic() - begun))

            work(client, told)


def _how_it_stands(standing: "Standing", seconds: float) -> str:
    """For instance "300 of 20000, 2 failed, about 12 min left"."""
    parts = [f"{standing.done} of {standing.total}"]
    if standing.failed:
        parts.append(f"{standing.failed} failed")
    new, left = standing.done - standing.before, standing.total - standing.done
    if not standing.workers:
        parts.append("waiting for a worker")
    elif new and left:
        rest_s = seconds * left / new
        parts.append(f"about {rest_s:.0f} s left" if rest_s < 90 else f"about {rest_s / 60:.0f} min left")
    return ", ".join(parts)


def _workers(asked: int | None) -> tuple[int, int]:
    """How many processes, and what each may take in MB: capped by cores and memory, and said where it is."""
    from slicer.processes import usable_cores

    cores = usable_cores()
    memory_mb = _memory_mb()
    most = max(1, int((memory_mb - SYSTEM_MB) // MB_A_WORKER))
    count = min(asked or cores, cores, most)
    if asked is not None and count < asked:
        why = f"{cores} cores" if cores <= most else f"{memory_mb:.0f} MB of memory"
        say(f"Warning: {asked} workers are more than {why} can serve; {count} are taken.")
    return count, int((memory_mb - SYSTEM_MB) / count) if memory_mb > 2 * SYSTEM_MB else int(
        memory_mb / count
    )


def _memory_mb() -> float:
    """Memory that Dask sees: the machine's, or less where a container says so."""
    from distributed.system import MEMORY_LIMIT

    return float(MEMORY_LIMIT) / 2**20


def _describe(study: "Study") -> None:
    from itertools import islice

    say(f"{study.title}: {len(study)} tasks")
    width = 2 + max(len(factor.name) for factor in study.factors)
    for factor in study.factors:
        shown = ", ".join(map(str, factor.levels[:6])) + (", ..." if len(factor.levels) > 6 else "")
        what = f"{len(factor.levels)} levels: {shown}"
        if study.samples is not None and factor.limits is not None:
            what = f"from {factor.limits[0]:g} to {factor.limits[1]:g}"
        say(f"  {factor.name:<{width}}{what}")
    for task in islice(study.tasks(), 3):
        say("  first tasks: " + ", ".join(f"{name} = {value}" for name, value in task.items()))


@command.command("report", epilog="Example: vslice study report results/ --figures travel_mm,seconds")
@click.argument("folder", metavar="RESULTS", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "target",
    type=click.Path(path_type=Path),
    help="Folder for the report. By default RESULTS/report.",
)
@click.option("--figures", metavar="NAME,NAME,...", help="What to report. By default what says most.")
@click.option(
    "--format", "file_format", type=click.Choice(["pdf", "svg", "png"]), default="pdf", show_default=True,
    help="Of the pictures.",
)  # fmt: skip
@common
def report_command(folder: Path, target: Path | None, figures: str | None, file_format: str) -> None:
    """Say what the rows show, those of a study that still runs as well.

    Means with bootstrap intervals, differences on the same sheets, effects of factors and scaling laws, as
    CSV, Markdown and LaTeX, and pictures. The Markdown goes to stdout too.
    """
    _need("pyarrow", "scipy")
    from studies.figures import draw
    from studies.report import report
    from studies.written import as_csv, as_latex, as_markdown

    if not folder.is_dir():
        raise InputError(f"{folder} is no folder of results.")
    chosen = [name.strip() for name in figures.split(",") if name.strip()] if figures else []
    made = report(folder, chosen)
    place = target or folder / "report"
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{place}: this folder cannot be made: {error.strerror}; name another.") from None
    text = as_markdown(made)
    written = {"report.md": text.encode(), "report.tex": as_latex(made).encode()}
    written |= {f"{table.name}.csv": as_csv(table).encode() for table in made.tables}
    written |= draw(made, file_format)
    for name, data in written.items():
        output.write(place / name, [data])
    click.echo(text, nl=False)
    say(f"{len(written)} files written to {place}")


def _need(*modules: str) -> None:
    """Refuse to begin without the libraries of the extra.

    Raises:
        InputError: one of them is not installed.
    """
    from importlib.util import find_spec

    if missing := [name for name in modules if find_spec(name) is None]:
        raise InputError(
            f"studies need {', '.join(missing)}, not installed here: pip install 'vslice[study]'"
        )
