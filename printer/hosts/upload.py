"""A program goes to a host, is compared there with what was sent, and only then, if wanted, is printed."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from printer.hosts.client import Client
from printer.hosts.errors import HostError, HostInputError
from printer.hosts.hosts import Duet, Host, Moonraker, OctoPrint, PrusaLink

HOSTS: dict[str, type[Host]] = {
    "octoprint": OctoPrint,
    "moonraker": Moonraker,
    "prusalink": PrusaLink,
    "duet": Duet,
}
NAME = re.compile(r"[^/\\:*?\"<>|\x00-\x1f\x7f]{1,200}\.(?:gcode|gco|g|nc)\Z", re.IGNORECASE)


@dataclass(frozen=True)
class Uploaded:
    """What became of an upload.

    Attributes:
        host: what answered, with its version.
        name: of the file there.
        size: in bytes.
        verified: what was compared after the upload.
        printing: whether it was told to print it.
    """

    host: str
    name: str
    size: int
    verified: str
    printing: bool


def upload(
    data: bytes,
    name: str,
    *,
    to: str,
    url: str,
    key: str = "",
    user: str = "",
    ca: Path | None = None,
    start: bool = False,
    told: Callable[[int], None] = lambda sent: None,
) -> Uploaded:
    """Upload a program, verify it, and start it if wanted.

    Args:
        data: the bytes of the program.
        name: what it shall be called there.
        to: a key of ``HOSTS``.
        key: the host's API key, or password; it goes to that host alone.
        user: whose password the key is, where the host has users.
        ca: certificates to trust besides the system's, in a PEM file.
        start: whether to print it once it is verified.
        told: told how many bytes were sent.

    Raises:
        HostError: the host or the network failed, or it prints already.
        HostInputError: key, address, name or certificate cannot be used.
        MissingLibraryError: httpx is not installed.
    """
    if not NAME.match(name):
        raise HostInputError(f"{name!a}: is no name that hosts take; give another, such as part.gcode")
    if not (key.isascii() and key.isprintable()):
        raise HostInputError("the key holds letters that no key has: was it copied whole?")
    kind = HOSTS[to]
    if user and not kind.users:
        raise HostInputError(f"{kind.title} is spoken to with a key or a password alone; leave out --user")
    if user and not key:
        raise HostInputError(f"{user!a}: has no password here; see VSLICE_API_KEY and --key-file")
    login = (user, key) if user else None
    headers = {kind.key_header: key} if kind.key_header and key and not user else {}
    with Client(url, kind.title, headers, ca, login) as client:
        host = kind(client, key)
        who = host.greet()
        if start and host.printing():
            raise HostError(f"{client.where}: is printing already; nothing was uploaded")
        there = host.put(name, data, told)
        verified = host.verify(there, data)
        if start:
            host.start(there)
        host.leave()
    return Uploaded(who, there, len(data), verified, start)
