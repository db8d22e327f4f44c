"""Which journal the last job of each port has: what may still stand in that printer."""

import os
import re
from pathlib import Path

from printer.ports import port_key, state_folder


def remember(port: str, journal: Path) -> None:
    """A job of this journal begins, or goes on, on this port.

    Raises:
        OSError: if it cannot be written.
    """
    if not _lasts(port):
        return
    place = _place(port)
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = place.with_suffix(".new")
    beside.write_bytes(os.fsencode(journal.resolve()))
    os.replace(beside, place)


def journal_of(port: str) -> Path | None:
    """The journal of the last job on this port; None if none is known, or it is gone."""
    place = _place(port)
    if not _lasts(port) or not place.exists():
        return None
    journal = Path(os.fsdecode(place.read_bytes()))
    return journal if journal.is_file() else None


def _place(port: str) -> Path:
    return state_folder() / "ports" / f"{port_key(port)}.job"


def _lasts(port: str) -> bool:
    """Whether the same name means the same printer tomorrow. The numbers of pseudo-terminals go round, and
    an emulated printer without a name is a new one each time."""
    device = port if "://" in port else str(Path(port).resolve())
    return not re.match(r"marlin://(\?|$)|(spy://)?/dev/(pts/|ttys\d)", device)
