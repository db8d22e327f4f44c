"""What every command shares: how much to say, and progress on a terminal."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

import click

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
    return bool(_settings(click.get_current_context()).get("quiet"))


def verbose() -> bool:
    """Whether the user wants to hear more."""
    return bool(_settings(click.get_current_context()).get("verbose"))


def say(text: str) -> None:
    """A line on stderr, unless the user wants quiet; stdout may be the product."""
    if not quiet():
        click.echo(text, err=True)


def _spoken() -> Iterator[Callable[[str], None]]:
    began = time.perf_counter()
    current = ""

    def step(name: str) -> None:
        nonlocal began, current
        now = time.perf_counter()
        if current:
            say(f"{current:<12} {now - began:.2f} s")
        began, current = now, name

    yield step
    step("")


@contextmanager
def progress(total: int) -> Iterator[Callable[[str], None]]:
    """A bar on stderr with ``total`` steps; call what it gives with the name of each step as it begins.

    Where stderr is no terminal, or the user wants quiet, there is none. With -v there are lines instead,
    each with the time that its step took.
    """
    if verbose() and not quiet():
        yield from _spoken()
        return
    if quiet() or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<12}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total)
        begun = 0

        def step(name: str) -> None:
            nonlocal begun
            bar.update(task, description=name, completed=begun)
            begun += 1

        yield step
