"""The command group: finds the command, loads only that one, and turns errors into exit codes."""

import difflib
import importlib
import os
import sys
from pathlib import Path
from typing import Any

import click

from vslice import __version__
from vslice.terminal.failure import report

# One line of help a command, so that `vslice --help` imports none of them.
COMMANDS = {
    "slice": "Turn a grid of fibre angles, or an image, into G-code (the default command).",
    "orient": "Measure fibre angles in an image, a diffusion volume or a table.",
    "generate": "Write a random grid of fibre angles.",
    "preview": "Draw a grid or a program as a picture.",
    "play": "Write a page that plays a program, or two side by side.",
    "check": "Replay a program and verify that it can be printed.",
    "send": "Stream a program to a printer, or see in a dry run what it would do.",
    "upload": "Hand a program over to OctoPrint, Moonraker, PrusaLink or a Duet.",
    "ports": "List the serial ports of this machine.",
    "console": "Type commands to a printer and see its replies.",
    "emulate": "Be a printer on a pseudo-terminal, for other hosts and for learning.",
    "compare": "Compare the methods of ordering on one sheet.",
    "nozzles": "Compare nozzles on one sheet: which of them print it as it is.",
    "study": "Order thousands of sheets, and report what they say.",
    "paper": "Reproduce the source paper's table and figures.",
    "profiles": "List and show the machines that vslice knows.",
    "config": "Settle the usual profile, nozzle and print hosts.",
    "help": "Show a page of the documentation in the terminal.",
    "completion": "Print what lets a shell complete commands and options.",
    "json-schema": "Print the JSON Schema of what a command prints with --json.",
    "grid-schema": "Print the JSON Schema of a grid file.",
}
FLAGS = {"-v", "-vv", "--verbose", "-q", "--quiet"}


class LazyGroup(click.Group):
    """A group that imports a command when it runs, and reads a file name as ``slice FILE``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"vslice.commands.{cmd_name.replace('-', '_')}")
        command = module.command
        if not isinstance(command, click.Command):
            raise TypeError(f"{module.__name__}.command is no click command")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        place = next((k for k, word in enumerate(args) if word not in FLAGS), None)
        if place is not None and _means_slice(args[place]):
            args = [*args[:place], "slice", *args[place:]]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if name not in COMMANDS and Path(name).is_dir():
            ctx.fail(f"'{name}' is a folder; name a grid file in it.")
        if name not in COMMANDS:
            near = difflib.get_close_matches(name, COMMANDS, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else " 'vslice --help' lists the commands."
            ctx.fail(f"There is no command '{name}', and no file of that name.{hint}")
        return super().resolve_command(ctx, args)


def _means_slice(word: str) -> bool:
    """Whether the first word is a grid file, or an option of ``slice``, rather than a command."""
    if word in COMMANDS or word in ("--help", "-h", "--version"):
        return False
    return (
        word.startswith("-")
        or Path(word).is_file()
        or (("." in word or os.sep in word) and not Path(word).is_dir())
    )


@click.command(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Example: vslice grid.json -o part.gcode",
)
@click.version_option(__version__, prog_name="vslice")
@click.option("-v", "--verbose", count=True, help="Say more; -vv shows where an error came from.")
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
@click.pass_context
def cli(ctx: click.Context, verbose: int, quiet: bool) -> None:
    """Slice grids of fibre angles into G-code for printers that build a sheet upright.

    `vslice GRID.json` is short for `vslice slice GRID.json`.
    """
    ctx.obj = {"verbose": verbose, "quiet": quiet}


def main(argv: list[str] | None = None) -> Any:
    """Run the command line; exits with 0, with 1 for a failure, with 2 for wrong use or bad input."""
    words = sys.argv[1:] if argv is None else argv
    try:
        code = cli.main(args=words, prog_name="vslice", standalone_mode=False) or 0
        if sys.stdout is not None:
            sys.stdout.flush()
        sys.exit(code)
    except Exception as error:  # noqa: BLE001 - the outermost frame: every error becomes an exit code here
        try:
            code = report(error, traceback_wanted="-vv" in words or words.count("-v") > 1)
        except OSError:  # standard error takes nothing either: the exit code is all that can be told
            code = 1
        sys.exit(code)
