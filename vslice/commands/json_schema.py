"""``vslice json-schema``: what a command prints with ``--json``."""

import click

from vslice.terminal.session import common

COMMANDS = ("slice", "orient", "check", "send", "upload", "compare", "nozzles", "paper", "profiles")


@click.command("json-schema", epilog="Example: vslice json-schema check > check.schema.json")
@click.argument("name", metavar="COMMAND", type=click.Choice(COMMANDS))
@common
def command(name: str) -> None:
    """Print the JSON Schema of what COMMAND prints with --json."""
    from vslice.figures import dumps, schema_of

    click.echo(dumps(schema_of(name)))
