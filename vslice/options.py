"""Options that several commands share, each declared once."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

profile_option: Decorator = click.option(
    "-p",
    "--profile",
    "profile_name",
    default="marlin-generic",
    show_default=True,
    metavar="NAME|FILE.toml",
    help="The machine: a shipped profile, or a file of your own.",
)

program_profile_option: Decorator = click.option(
    "-p",
    "--profile",
    "profile_name",
    metavar="NAME|FILE.toml",
    help="The machine: a shipped profile, or a file of your own. By default the one that the program "
    "names in its head, or else marlin-generic.",
)

set_option: Decorator = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="SECTION.KEY=VALUE",
    help="Change one setting of the profile; repeatable.",
)

grid_argument: Decorator = click.argument("grid_file", metavar="GRID.json", type=click.Path(path_type=Path))


def output_option(help_text: str) -> Decorator:
    """-o/--output, where - is stdout."""
    return click.option(
        "-o", "--output", "out", type=click.Path(path_type=Path, allow_dash=True), help=help_text
    )


def not_onto_input(source: Path, target: Path | None) -> None:
    """Refuse to write over the file that is being read.

    Raises:
        UsageError: source and target are the same file.
    """
    if target is not None and target.exists() and source.exists() and target.samefile(source):
        raise click.UsageError(f"{target} is the input itself; name another file with -o.")


def is_stdout(path: Path | None) -> bool:
    """Whether an output option asks for stdout."""
    return path is not None and str(path) == "-"
