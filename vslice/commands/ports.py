"""``vslice ports``: the serial ports of this machine."""

import click

from vslice.terminal.session import common, say


@click.command("ports", epilog="Example: vslice ports")
@common
def command() -> None:
    """List the serial ports of this machine, with description and USB ids."""
    from printer.ports import list_serial_ports

    ports = list_serial_ports()
    width = max((len(port.device) for port in ports), default=0)
    for port in ports:
        click.echo(f"{port.device:<{width}}  {port.usb or '-':<20}  {port.description}".rstrip())
    if not ports:
        say("No serial ports. Is the printer switched on, and its cable plugged in?")
