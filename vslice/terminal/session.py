"""What every command shares: how much to say, and progress on a terminal."""

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import click

if TYPE_CHECKING:  # it imports all that is heavy
    from slicer.sequence.problem import Progress as Found

P = ParamSpec("P")
R = TypeVar("R")


def common(command: Callable[P, R]) -> Callable[P, R]:
    """Let -v and -q stand behind the command as well as before it."""
    for option in (
        click.option(
            "-v", "--verbose", count=True, expose_value=False, callback=_add_verbose, help="Say more."
        ),
        click.option(
            "-q",
            "--quiet",
            is_flag=True,
            expose_value=False,
            callback=_set_quiet,
            help="Say nothing but errors.",
        ),
    ):
        command = option(command)
    return command


def _settings(ctx: click.Context) -> dict[str, Any]:
    settings: dict[str, Any] = ctx.ensure_object(dict)
    return settings


def _add_verbose(ctx: click.Context, _: click.Parameter, value: int) -> None:
    _settings(ctx)["verbose"] = _settings(ctx).get("verbose", 0) + value


def _set_quiet(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    _settings(ctx)["quiet"] = _settings(ctx).get("quiet", False) or value


def quiet() -> bool:
    """Whether the user wants to hear of errors alone."""
    ctx = click.get_current_context(silent=True)  # there is none where a function is called by a program
    return ctx is not None and bool(_settings(ctx).get("quiet"))


def verbose() -> bool:
    """Whether the user wants to hear more."""
    return bool(_settings(click.get_current_context()).get("verbose"))


def json_option(command: Callable[P, R]) -> Callable[P, R]:
    """--json, for commands that ask ``json_wanted`` where they print."""
    return click.option(
        "--json",
        is_flag=True,
        expose_value=False,
        callback=lambda ctx, _, value: _settings(ctx).update(json=value),
        help="The figures as JSON on stdout ('vslice json-schema' tells what they are).",
    )(command)


def json_wanted() -> bool:
    """Whether the user wants figures as JSON."""
    ctx = click.get_current_context(silent=True)
    return ctx is not None and bool(_settings(ctx).get("json"))


def say(text: str) -> None:
    """A line on stderr, unless the user wants quiet; stdout may be the product.

    The name of a file may hold what no encoding has.
    """
    if not quiet():
        click.echo(text.encode("utf-8", "backslashreplace").decode(), err=True)


@contextmanager
def said_if_interrupted(text: str) -> Iterator[None]:
    """Say what an end by Ctrl-C, or by a question that was not agreed to, leaves; also a decorator."""
    try:
        yield
    except (KeyboardInterrupt, click.Abort):
        say(text)
        raise click.Abort from None


@contextmanager
def warnings_said() -> Iterator[None]:
    """Say at once what the sequencer warns of; warnings of libraries go their own way."""
    from slicer.errors import SequenceWarning

    with warnings.catch_warnings():
        warnings.simplefilter("always", SequenceWarning)
        before = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if issubclass(category, SequenceWarning):
                say(f"Warning: {message}")
            else:
                before(message, category, *place, **more)

        warnings.showwarning = show
        yield


def so_far(found: "Found", unit: str) -> str:
    """The state of a search, short enough for a line: the best cost, and the bound where there is one."""
    bound = f", at least {found.lower_bound:.2f}" if found.lower_bound else ""
    return f"{found.stage}: {found.cost:.2f} {unit}{bound}"


class Steps:
    """What a command tells of its progress; this one keeps it to itself."""

    def __call__(self, name: str) -> None:
        """The step of this name begins."""

    def detail(self, text: str) -> None:
        """How the step is going."""

    def part(self, share: float) -> None:
        """So much of the step is done, 0 to 1."""


class _Spoken(Steps):
    """A line for each step with the time that it took."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._name = ""

    def __call__(self, name: str) -> None:
        now = time.perf_counter()
        if self._name:
            say(f"{self._name:<12} {now - self._began:.2f} s")
        self._began, self._name = now, name

    def detail(self, text: str) -> None:
        say(f"  {time.perf_counter() - self._began:8.2f} s  {text}")


class _Bar(Steps):
    """A bar on the terminal."""

    def __init__(self, bar: Any, total: int) -> None:
        self._bar = bar
        self._task = bar.add_task("", total=total)
        self._begun = 0
        self._name = ""

    def __call__(self, name: str) -> None:
        self._name = name
        self._bar.update(self._task, description=name, completed=self._begun)
        self._begun += 1

    def detail(self, text: str) -> None:
        self._bar.update(self._task, description=f"{self._name}, {text}")

    def part(self, share: float) -> None:
        self._bar.update(self._task, completed=self._begun - 1 + share)


@contextmanager
def progress(total: int) -> Iterator[Steps]:
    """A bar on stderr with ``total`` steps; call what it gives with the name of each step as it begins.

    Where stderr is no terminal, or the user wants quiet, there is none. With -v there are lines instead,
    each with the time that its step took.
    """
    if verbose() and not quiet():
        spoken = _Spoken()
        yield spoken
        spoken("")
        return
    if quiet() or not sys.stderr.isatty():
        yield Steps()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    # The spinner turns in a thread of its own: a step without news is seen to be alive.
    columns = (
        SpinnerColumn(),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield _Bar(bar, total)
