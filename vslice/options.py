"""Options that several commands share, each declared once."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

METHOD_NAMES = ("auto", "exact", "beam", "local", "multistart", "mcts", "aco", "greedy")
"""Those of ``METHODS`` in ``slicer/sequence/solve.py``, which light commands do not import."""
MOST_SEED = 2**64 - 1
MOST_WORKERS = 1_000_000


class Number(click.FloatRange):
    """A number from ``low`` to ``high``, both included; NaN, which is in every range, is none."""

    def __init__(self, low: float, high: float) -> None:
        super().__init__(low, high)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number: float = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{number} is not in the range {self._describe_range()}.", param, ctx)
        return number


seconds = Number(0.001, 1e7)
baud_rate = click.IntRange(300, 12_000_000)


def given(name: str) -> bool:
    """Whether the user gave this option, by the name of its parameter; its default is not given."""
    source = click.get_current_context().get_parameter_source(name)
    return source in (ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT)


def no_effect(why: str, *names: str) -> None:
    """Refuse options that change nothing here: the user takes them to do something.

    Args:
        why: what the input or another option is, such as "a grid".
        names: of their parameters.

    Raises:
        UsageError: one of them was given.
    """
    for parameter in click.get_current_context().command.params:
        if parameter.name in names and given(parameter.name):
            raise click.UsageError(f"{parameter.opts[-1]} has no effect on {why}; leave it out.")


def settings_without_effect(why: str, overrides: Sequence[str], *sections: str) -> None:
    """Refuse ``--set`` of sections of the profile that are not looked at here.

    Raises:
        UsageError: there is one.
    """
    for override in overrides:
        if override.partition(".")[0].strip() in sections:
            raise click.UsageError(f"--set {override} has no effect on {why}; leave it out.")


IGNORED = {
    "greedy": ("effort", "seed", "workers", "time_limit_s"),
    "multistart": ("effort", "seed", "workers"),
}
"""Options that change nothing with a method: it draws nothing at random, and its work is fixed."""
IGNORED_STRAIGHT = IGNORED | {"beam": ("seed", "workers"), "exact": ("seed", "workers")}
"""The same for straight travel. Over the skyline, kicks follow these two, and kicks are drawn."""


def _usual_profile() -> str:
    """The profile that the user has settled, or a filament printer."""
    from vslice.user_config import user_config

    return user_config().profile or "marlin-generic"


def _usual_nozzle() -> str | None:
    """The nozzle that the user has settled, unless another profile than the usual one is given."""
    from vslice.user_config import user_config

    usual = user_config()
    profile = click.get_current_context().params.get("profile_name", usual.profile)
    return usual.nozzle if profile == (usual.profile or "marlin-generic") else None


profile_option: Decorator = click.option(
    "-p",
    "--profile",
    "profile_name",
    default=_usual_profile,
    show_default="marlin-generic, or what 'vslice config' says",
    is_eager=True,
    metavar="NAME|FILE.toml",
    help="The machine: a shipped profile, or a file of your own.",
)

program_profile_option: Decorator = click.option(
    "-p",
    "--profile",
    "profile_name",
    metavar="NAME|FILE.toml",
    help="The machine: a shipped profile, or a file of your own. By default the one that the program "
    "carries at its end, or else marlin-generic.",
)

set_option: Decorator = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="SECTION.KEY=VALUE",
    help="Change one setting of the profile; repeatable.",
)

nozzle_option: Decorator = click.option(
    "--nozzle",
    "nozzle_name",
    metavar="NAME",
    help="The nozzle on it, such as 25G, instead of the profile's; 'vslice profiles nozzles' lists them.",
)


usual_nozzle_option: Decorator = click.option(
    "--nozzle",
    "nozzle_name",
    metavar="NAME",
    default=_usual_nozzle,
    help="The nozzle on it, such as 25G, instead of the profile's; 'vslice profiles nozzles' lists them.",
)


def with_nozzle(nozzle_name: str | None, overrides: tuple[str, ...]) -> tuple[str, ...]:
    """What ``--nozzle`` changes in a profile, and then ``--set``.

    Raises:
        ProfileError: there is no such nozzle.
    """
    if nozzle_name is None:
        return overrides
    from profiles.nozzles import nozzle_called

    return (*nozzle_called(nozzle_name).settings(), *overrides)


effort_option: Decorator = click.option(
    "--effort",
    type=click.Choice(["quick", "default", "high"]),
    default="default",
    show_default=True,
    help="How long to search for a good order.",
)

start_option: Decorator = click.option(
    "--start",
    type=click.Choice(["corner", "free"]),
    default="corner",
    show_default=True,
    help="Begin with the lowest toolpath of the bottom left tile, at its lower end, or wherever is best.",
)


def objective_option(default: str) -> Decorator:
    """--objective with its default."""
    return click.option(
        "--objective",
        type=click.Choice(["straight", "routed", "time"]),
        default=default,
        show_default=True,
        help="What the order minimises: the paper's straight travel J, the travel over what is printed, "
        "or its seconds on this machine.",
    )


grid_argument: Decorator = click.argument("grid_file", metavar="GRID.json", type=click.Path(path_type=Path))


def output_option(help_text: str) -> Decorator:
    """-o/--output, where - is stdout."""
    return click.option(
        "-o", "--output", "out", type=click.Path(path_type=Path, allow_dash=True), help=help_text
    )


def not_onto_input(source: Path, target: Path | None, *, option: str = "-o") -> None:
    """Refuse to write over a file that is being read: the input, or a profile.

    Args:
        option: the one that names the target.

    Raises:
        UsageError: source and target are the same file.
    """
    if target is not None and target.exists() and source.exists() and target.samefile(source):
        raise click.UsageError(f"{target} is the input itself; name another file with {option}.")


def not_onto_profile(profile_name: str | None, target: Path | None, *, option: str = "-o") -> None:
    """``not_onto_input`` for a profile, which may be a file."""
    if profile_name is not None and Path(profile_name).is_file():
        not_onto_input(Path(profile_name), target, option=option)


PICTURE_FORMATS = ("png", "svg", "pdf")


def picture_format(target: Path) -> str:
    """The format of a picture by its extension.

    Raises:
        UsageError: there is no such format.
    """
    file_format = target.suffix.lstrip(".").lower()
    if file_format not in PICTURE_FORMATS:
        if target.exists() and not target.is_file():
            raise click.UsageError(f"{target} is no ordinary file; name one that ends in .png, .svg or .pdf.")
        raise click.UsageError(f"{target}: a picture must end in .png, .svg or .pdf, not '{target.suffix}'.")
    return file_format


def is_stdout(path: Path | None) -> bool:
    """Whether an output option asks for stdout."""
    return path is not None and str(path) == "-"
