"""A program is handed over to a print host: which host, with which key, and how far it is."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vslice.keys import key_for
from vslice.terminal.session import quiet, say

if TYPE_CHECKING:
    from printer.hosts import Uploaded
    from profiles import Profile

KINDS = ("octoprint", "moonraker", "prusalink", "duet")


@dataclass(frozen=True)
class Destination:
    """Where a program goes: ``known_as`` is the host's name in the configuration, or its address."""

    known_as: str
    to: str
    url: str
    ca: Path | None
    key_file: Path | None
    user: str


def destination(
    to: str, url: str | None, ca: Path | None, key_file: Path | None, user: str | None = None
) -> Destination:
    """The host that is meant by ``--to``: a kind with its ``--url``, or a name in the configuration.

    Raises:
        UsageError: there is no such host, or the address is missing, or is given twice.
    """
    if to in KINDS:
        if url is None:
            raise click.UsageError(
                "Where is it? Give --url http://..., or name a host with 'vslice config host'."
            )
        return Destination(url, to, url, ca, key_file, user or "")
    from vslice.user_config import config_file, user_config

    hosts = user_config().hosts
    if to not in hosts:
        names = ", ".join(sorted(hosts)) or "none"
        raise click.UsageError(
            f"--to {to}: is neither {', '.join(KINDS)} nor a host in {config_file()} (there: {names})."
        )
    if url is not None:
        raise click.UsageError(
            f"--url has no effect on {to}, whose address stands in {config_file()}; leave it out."
        )
    host = hosts[to]
    return Destination(
        to,
        host.to,
        host.url,
        ca or (Path(host.ca).expanduser() if host.ca else None),
        key_file or (Path(host.key_file) if host.key_file else None),
        user or host.user or "",
    )


def refuse_foreign(program_file: Path, profile: "Profile", to: str) -> None:
    """Refuse a program that is written for a firmware that this host does not drive.

    Raises:
        UsageError: it is.
    """
    from printer.hosts.upload import HOSTS

    kind = HOSTS[to]
    if profile.gcode.flavor not in kind.flavors:
        raise click.UsageError(
            f"{program_file} is written for {profile.flavor.title}, but {kind.title} prints "
            f"{' or '.join(kind.flavors)}: slice it with a profile of that [gcode] flavor, or insist with "
            "--no-check."
        )


def hand_over(program_file: Path, name: str, where: Destination, start: bool) -> "Uploaded":
    """Upload a program, with a bar on a terminal, and say what became of it.

    Raises:
        ReadError: the file is no program.
        HostError, HostInputError, MissingLibraryError: see ``printer.hosts.upload``.
    """
    from dialect.source import load
    from printer.hosts import upload
    from printer.hosts.client import public_address

    load(program_file)  # refuses what is no program
    data = program_file.read_bytes()
    key, source = key_for(where.known_as, where.key_file)
    if source:
        say(f"key from {source}")
    if address := public_address(where.url):
        # Whoever sits on the way reads the key: that is no matter of taste, and told with --quiet too.
        click.echo(
            f"Warning: {where.url} is a public address ({address}) without encryption: key and program can "
            "be read and changed on the way. Use https, or a tunnel.",
            err=True,
        )
    with _bar(len(data)) as told:
        done = upload(
            data,
            name,
            to=where.to,
            url=where.url,
            key=key,
            user=where.user,
            ca=where.ca,
            start=start,
            told=told,
        )
    said = ", printing" if done.printing else ""
    say(f"{done.name}: {done.size} bytes on {done.host}, verified by {done.verified}{said}")
    return done


@contextmanager
def _bar(total: int) -> Iterator[Callable[[int], None]]:
    """A bar on the terminal with the bytes that were sent; where there is none, nothing."""
    if quiet() or not sys.stderr.isatty():
        yield lambda sent: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TransferSpeedColumn

    with Progress(
        BarColumn(bar_width=24),
        DownloadColumn(),
        TransferSpeedColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task("", total=total)
        yield lambda sent: bar.update(task, completed=sent)
