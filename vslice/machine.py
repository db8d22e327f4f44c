"""Which machine a program is for: the one that the user names, or else the one in its head."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import profiles
from gcode.head import read_head
from gcode.moves import Move
from gcode.parse import read_moves
from profiles import Profile

FALLBACK = "marlin-generic"


def profile_for(moves: Sequence[Move], name: str | None, overrides: tuple[str, ...]) -> tuple[str, Profile]:
    """The profile to judge a program by, and its name.

    Without a name it is the shipped profile that the head names, with the settings that were changed
    when the program was written; or the fallback for programs of others.

    Raises:
        ProfileError: no such profile, or a setting that is wrong.
    """
    if name is not None:
        return name, profiles.load(name, overrides)
    facts = read_head(moves)
    own = facts.get("profile")
    if own not in profiles.shipped() or own is None:
        return FALLBACK, profiles.load(FALLBACK, overrides)
    return own, profiles.load(own, (*_settings(facts), *overrides))


def _settings(facts: Mapping[str, str]) -> list[str]:
    try:
        found = json.loads(facts.get("settings", "[]"))
    except ValueError:
        return []  # the head was edited; what it says of settings is not needed to read the program
    return [entry for entry in found if isinstance(entry, str)] if isinstance(found, list) else []


def mismatch(moves: Sequence[Move], name: str, grid_sha256: str | None) -> list[str]:
    """What the head says that does not go with the profile and the grid it is judged by."""
    facts = read_head(moves)
    notes = []
    if facts.get("profile", name) != name:
        notes.append(f"The program was made for {facts['profile']}, and is checked against {name}.")
    if grid_sha256 and facts.get("grid_sha256", grid_sha256) != grid_sha256:
        notes.append("The program was made from another grid file, or the file has changed since.")
    return notes


def read_program(path: Path, name: str | None, overrides: tuple[str, ...]) -> tuple[list[Move], str, Profile]:
    """The moves of a G-code file in the plane of its machine, and that machine; see ``profile_for``.

    Raises:
        ParseError: the file cannot be read, or is no G-code of the kind that is read here.
        ProfileError: no such profile, or a setting that is wrong.
    """
    moves = read_moves(path)
    name, profile = profile_for(moves, name, overrides)
    if profile.machine.plane == "YZ":
        moves = [move._replace(x_mm=move.depth_mm, depth_mm=move.x_mm) for move in moves]
    return moves, name, profile
