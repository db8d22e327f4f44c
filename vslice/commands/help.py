"""``vslice help``: the documentation in the terminal."""

import difflib
import sys
from pathlib import Path

import click

from vslice.terminal.session import common


@click.command("help", epilog="Example: vslice help hosts")
@click.argument("topic", required=False)
@common
def command(topic: str | None) -> None:
    """Show a page of the documentation, or, without a TOPIC, which there are.

    'vslice COMMAND --help' tells the options of a command.
    """
    pages = topics()
    if topic is None:
        width = max(map(len, pages))
        for name, page in pages.items():
            click.echo(f"{name:<{width}}  {title(page)}")
        return
    if topic not in pages:
        near = difflib.get_close_matches(topic, pages, n=1)
        hint = f"Did you mean '{near[0]}'?" if near else f"There are {', '.join(pages)}."
        raise click.UsageError(f"There is no page '{topic}'. {hint}")
    text = pages[topic].read_text("utf-8")
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.markdown import Markdown

        console = Console()
        with console.pager(styles=True):
            console.print(Markdown(text))
        return
    click.echo(text.rstrip())


def topics() -> dict[str, Path]:
    """The pages by their names: inside the installed package, or in the docs of a checkout."""
    package = Path(__file__).parents[1]
    folder = next((f for f in (package / "docs", package.parent / "docs") if (f / "grid.md").exists()), None)
    if folder is None:
        raise click.ClickException(
            "The documentation was not installed with this vslice; its README tells where it is."
        )
    return {page.stem: page for page in sorted(folder.glob("*.md"))}


def title(page: Path) -> str:
    """The heading of a page."""
    first = page.read_text("utf-8").partition("\n")[0]
    return first.removeprefix("# ").strip()
