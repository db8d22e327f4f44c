"""``vslice emulate``: be a printer on a pseudo-terminal."""

import signal
import sys
from pathlib import Path

import click

from vslice.terminal.session import common, say


@click.command("emulate", epilog="Example: vslice emulate --faults corrupt=3e-4 --faults fault=reset@500")
@click.option(
    "--faults", "options", multiple=True, metavar="KEY=VALUE",
    help="An option of marlin://, repeatable: seed=N; corrupt, drop, reply_corrupt, reply_drop (a byte), "
    "ok_drop, ok_duplicate (an ok); fault=KIND@LINE with KIND resend, resend-of-unknown-line, reset, "
    "kill, silence, pause, disconnect, garbage or long-busy; slots, rx, blocks, command_s, delay_s, "
    "homing_s, keep_path=0, advanced_ok=1, emergency_parser=1; odd=WAY, answers in other words: "
    "cr, cr-lf, lf-cr (line ends), capital-ok, temperatures-behind-ok, no-ok-behind-resend, no-sensors, "
    "silent, temperatures-while-heating.",
)  # fmt: skip
@click.option("--fast", is_flag=True, help="Let the printer's time fly: moves take no time.")
@click.option("--link", type=click.Path(path_type=Path), help="Also make a symbolic link to the port.")
@common
def command(options: tuple[str, ...], fast: bool, link: Path | None) -> None:
    """Be a Marlin printer on a pseudo-terminal, for other hosts and for learning.

    Prints the port on stdout, and serves it until Ctrl-C; then says what was printed.
    """
    if sys.platform == "win32":
        raise click.UsageError("Pseudo-terminals exist on Linux and macOS only; here use --port marlin://")
    for option in options:
        if option.startswith("clock="):
            raise click.UsageError("--faults clock=.. has no effect here; see --fast.")
        if not all(option.partition("=")) or "&" in option:
            raise click.UsageError(f"--faults {option!r} is no KEY=VALUE.")
    if link is not None and link.exists() and not (link.is_symlink() and link.is_char_device()):
        raise click.UsageError(f"{link} is there and is no link to a port; name another with --link.")
    from printer.emulator.pty import PtyPrinter
    from printer.urlhandler.protocol_marlin import printer_from_url

    firmware, _ = printer_from_url("marlin://?" + "&".join(options))
    printer = PtyPrinter(firmware, fast)
    if link is not None:
        link.unlink(missing_ok=True)
        link.symlink_to(printer.path)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: printer.stop())
    try:
        click.echo(printer.path)
        sys.stdout.flush()
        printer.serve()
    finally:
        printer.close()
        if link is not None:
            link.unlink(missing_ok=True)
    if not firmware.connected:
        say("The cable was pulled (a scripted fault).")
    say(
        f"{firmware.lines} commands, {firmware.path.count} moves, {firmware.path.material:.2f} mm of E, "
        f"{firmware.refused} lines refused, {firmware.repeated} repeated lines dropped, "
        f"{firmware.bytes_lost} bytes lost"
    )
