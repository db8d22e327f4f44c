"""Which machine a program is for: the one that the user names, or else the one that it carries."""

from collections.abc import Sequence
from pathlib import Path

import click

import profiles
from dialect.errors import ReadError
from dialect.flavor import flavor_called
from dialect.source import Source, load
from gcode import carried
from gcode.errors import ParseError
from gcode.head import facts_of, read_head
from gcode.moves import Move
from gcode.parse import read_moves
from profiles import Profile, ProfileError
from vslice.pressed import nozzle_name
from vslice.terminal.session import say

FALLBACK = "marlin-generic"
MOST = 12
"""Differences that are shown one by one."""


def profile_for(
    comments: Sequence[str], source: str, name: str | None, overrides: tuple[str, ...]
) -> tuple[str, Profile]:
    """The profile to judge a program by, and its name; says on stderr what a user must know of the choice.

    Without a name it is the one that the program carries, or the fallback for programs of others.

    Args:
        comments: the text behind the semicolon of every comment of the program.
        source: what the program is called in messages.
        overrides: settings that come last.

    Raises:
        ProfileError: no such profile, a setting that is wrong, or the program has lost the profile that it
            was made for.
    """
    if name is not None:
        profile = profiles.load(name, overrides)
        _compare(comments, source, name, profile)
        return name, profile
    found = carried.read(comments, source, overrides)
    if found is not None:
        if found.unsaid:
            say(
                f"{source}: was made by vslice {found.version}, which did not know these settings; this "
                f"version takes {', '.join(found.unsaid)}."
            )
        return found.name, found.profile
    lost = facts_of(comments).get("profile")
    if lost is not None:
        raise ProfileError(
            f"{source}: was made for {lost}, but its end, where that profile stands, is missing: was it cut "
            "off, or were its comments taken out? Slice again, or give the machine with -p."
        )
    fallback = _fallback(comments)
    profile = profiles.load(fallback, overrides)
    volume = " x ".join(f"{side:g}" for side in profile.machine.build_volume_mm)
    nozzle = f", nozzle {nozzle_name(profile)}" if profile.nozzle.tip_width_mm > 0 else ""
    # An assumption about a machine is no matter of taste: it is told with --quiet too.
    click.echo(
        f"Warning: {source} does not say which machine it is for; assuming {fallback}, with a build "
        f"volume of {volume} mm{nozzle}. Give the machine with -p.",
        err=True,
    )
    return fallback, profile


def _fallback(comments: Sequence[str]) -> str:
    """A shipped machine of the flavour that a program names; that of Marlin where it names none."""
    for comment in comments:
        key, _, said = comment.strip().replace(" = ", ":").partition(":")
        if key in ("FLAVOR", "gcode_flavor") and (flavor := flavor_called(said)) is not None:
            return {"grbl": "grbl-syringe"}.get(flavor.name, f"{flavor.name}-generic")
    return FALLBACK


def _compare(comments: Sequence[str], source: str, name: str, profile: Profile) -> None:
    """Say in what the profile that the user named differs from the one that the program carries."""
    try:
        found = carried.read(comments, source)
    except ProfileError as error:
        say(f"{error} Now {name} is used.")
        return
    differing = [] if found is None else carried.differences(found.profile, profile)
    if found is None or not differing:
        return
    more = [f"and {len(differing) - MOST} more"] if len(differing) > MOST else []
    listing = "".join(f"\n  {line}" for line in [*differing[:MOST], *more])
    say(f"{source}: was made for {found.name}; {name} is used, which differs:{listing}")


def read_profile(path: Path, name: str | None, overrides: tuple[str, ...]) -> tuple[str, Profile]:
    """The machine of a G-code file alone; see ``profile_for``.

    Raises:
        ParseError: the file cannot be read.
        ProfileError: no such profile, a setting that is wrong, or a lost profile.
    """
    return profile_for(list(carried.comments_in(path)), str(path), name, overrides)


def mismatch(moves: Sequence[Move], grid_sha256: str | None) -> list[str]:
    """What the head says that does not go with the grid that the program is judged by."""
    facts = read_head(moves)
    if grid_sha256 and facts.get("grid_sha256", grid_sha256) != grid_sha256:
        return ["The program was made from another grid file, or the file has changed since."]
    return []


def read_program(
    path: Path | Source, name: str | None, overrides: tuple[str, ...]
) -> tuple[list[Move], str, Profile]:
    """The moves of a G-code file in the plane of its machine, and that machine; see ``profile_for``.

    Raises:
        ParseError: the file cannot be read, or is no G-code of the kind that is read here.
        ProfileError: no such profile, a setting that is wrong, or a lost profile.
    """
    try:
        source = path if isinstance(path, Source) else load(path)
    except ReadError as error:
        raise ParseError(str(error)) from None
    name, profile = profile_for(list(carried.comments_of(source.lines)), source.name, name, overrides)
    return read_moves(source, plane=profile.machine.plane, flavor=profile.flavor), name, profile
