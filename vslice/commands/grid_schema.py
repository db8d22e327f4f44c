"""``vslice grid-schema``: the JSON Schema of a grid file."""

import json

import click

from vslice.terminal.session import common


@click.command("grid-schema", epilog="Example: vslice grid-schema > grid.schema.json")
@common
def command() -> None:
    """Print the JSON Schema of a grid file, for editors."""
    from slicer import grid

    click.echo(json.dumps(grid.schema(), indent=1))
