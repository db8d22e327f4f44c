"""``vslice upload``: hand a program over to a print host."""

import dataclasses
import json
from pathlib import Path

import click

from vslice.options import program_profile_option
from vslice.terminal.session import common


@click.command(
    "upload",
    epilog="Example: vslice upload part.gcode --to moonraker --url http://printer.local:7125 --print",
)
@click.argument("program_file", metavar="PART.gcode", type=click.Path(path_type=Path))
@click.option(
    "--to",
    required=True,
    metavar="HOST",
    help="octoprint, moonraker, prusalink or duet, with --url; or a host that 'vslice config' knows.",
)
@click.option("--url", help="Its address, such as http://printer.local.")
@click.option("--print", "start", is_flag=True, help="Print it once it is there and verified.")
@click.option("--name", help="What it is called there; by default as here.")
@click.option("--user", help="Whose password the key is (PrusaLink); by default it is an API key.")
@click.option(
    "--key-file",
    type=click.Path(path_type=Path),
    help="The file with the host's key, which only you may read (mode 600). VSLICE_API_KEY of the "
    "environment comes first, the keyring last.",
)
@click.option(
    "--ca", type=click.Path(path_type=Path), help="Certificates to trust besides the system's (PEM)."
)
@program_profile_option
@click.option("--no-check", is_flag=True, help="Upload even what 'vslice check' finds fault with.")
@click.option("--json", "as_json", is_flag=True, help="What became of it, as JSON on stdout.")
@common
def command(
    program_file: Path,
    to: str,
    url: str | None,
    start: bool,
    name: str | None,
    user: str | None,
    key_file: Path | None,
    ca: Path | None,
    profile_name: str | None,
    no_check: bool,
    as_json: bool,
) -> None:
    """Check a program, upload it to a print host, and verify that it arrived as it was sent.

    Keys are never given on the command line. A certificate that is not trusted is refused; name the host's
    own with --ca.
    """
    from vslice.handing_over import destination, hand_over, refuse_foreign

    where = destination(to, url, ca, key_file, user)
    if not no_check:
        from vslice.commands.send import check
        from vslice.machine import read_profile

        _, profile = read_profile(program_file, profile_name, ())
        refuse_foreign(program_file, profile, where.to)
        check(program_file, profile, "uploaded")
    done = hand_over(program_file, name or program_file.name, where, start)
    if as_json:
        click.echo(json.dumps(dataclasses.asdict(done), indent=1))
