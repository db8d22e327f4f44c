"""``vslice paper``: the source paper's table and figures, and the table that it does not have."""

from pathlib import Path

import click

from vslice import output
from vslice.compiling import compiling
from vslice.options import effort_option
from vslice.terminal.failure import InputError
from vslice.terminal.session import common, json_option, json_wanted, progress, say


@click.command("paper", epilog="Example: vslice paper -o paper/ --seeds 500 > paper.md")
@click.option(
    "-o", "--output", "folder", type=click.Path(path_type=Path), default=Path("paper"), show_default=True,
    help="Folder for the figures.",
)  # fmt: skip
@click.option(
    "--seeds",
    default=500,
    show_default=True,
    type=click.IntRange(10, 1_000_000),
    help="Random walks for Table 1.",
)
@click.option(
    "--grids", default=5, show_default=True, type=click.IntRange(1, 10_000), help="Grids for the methods."
)
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Of the figures.",
)
@effort_option
@json_option
@common
def command(folder: Path, seeds: int, grids: int, file_format: str, effort: str) -> None:
    """Reproduce the source paper on grids of its random walk.

    Prints, in Markdown, its Table 1 beside the distribution over many seeds, and the table that it does
    not have: the proven optimum and every method on the same grids. Draws its Figures 1 to 5.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; name a folder with -o.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: this folder cannot be made: {error.strerror}; name another.") from None
    for k in range(1, 6):
        output.check_place(folder / f"figure{k}.{file_format}")
    from vslice import comparison

    with progress(3) as step, compiling(say):
        step("Table 1")
        tables = [comparison.table_one(seeds)]
        step("methods")
        tables.append(comparison.table_of_methods(grids, effort, step))
        step("figures")
        names = comparison.draw_figures(folder, file_format)
    if json_wanted():
        from vslice.figures import of_paper

        click.echo(of_paper(tables, names).text())
    else:
        click.echo("\n\n".join(tables))
    say(f"figures {', '.join(names)} written to {folder}")
