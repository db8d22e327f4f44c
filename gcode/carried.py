"""The machine that a program was made for: its whole profile, in comments at the very end of the text.

A line for each setting, ``; section.key = value`` with the value as in JSON, between a line that begins the
block and one that ends it with the SHA-256 of what stands between. Defaults are written out too, since they
may be others in another version.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from dialect.errors import ReadError
from dialect.flavor import GRBL
from dialect.source import load
from gcode.errors import ParseError
from profiles import Profile, ProfileError, made

BEGIN = "vslice profile begin"
END = "vslice profile end"
HASH = "sha256:"
LINE = 160
"""Longer values go on in the next line, behind a plus."""
MORE = "+ "
REMEDY = "Slice again, or give the machine with -p"


@dataclass(frozen=True)
class Carried:
    """A profile that was found in a program.

    Attributes:
        name: what the user called it: a shipped name, or the name of a file without its folder.
        version: of the vslice that wrote it.
        profile: the machine, with settings that were changed on reading.
        unsaid: what the program does not say, "section.key = value" with the default of this version.
    """

    name: str
    version: str
    profile: Profile
    unsaid: list[str]


def write(profile: Profile, name: str, version: str) -> Iterator[str]:
    """The lines of the block, without line ends; the same profile gives the same lines."""
    entries = {"name": name, "version": version}
    entries |= {f"{section}.{key}": value for section, key, value in _settings(profile)}
    # Senders for grbl count bytes, and wait for ever with a line that its buffer cannot hold.
    width = GRBL.max_line - len("; + ") if profile.flavor is GRBL and GRBL.max_line else LINE
    yield f"; {BEGIN}"
    for key, value in entries.items():
        text = f"{key} = {_json(value)}"
        first = True
        while text:
            end = _cut(text, width)
            yield f"; {'' if first else MORE}{text[:end]}"
            text, first = text[end:], False
    yield f"; {END} {HASH}{_hash(entries)}"


def read(comments: Iterable[str], source: str, overrides: Sequence[str] = ()) -> Carried | None:
    """The profile that a program carries, or None where it carries none.

    Blocks that say the same, as of programs that were joined, are one.

    Args:
        comments: the text behind the semicolon of every comment; see ``comments_of``.
        source: what the program is called in messages.
        overrides: settings that come last, as for ``profiles.load``.

    Raises:
        ProfileError: the block is damaged or cut off; there are two that differ; a setting is unknown here or
            out of range.
    """
    blocks = [_entries(lines, said, source) for lines, said in _blocks(comments, source)]
    if not blocks:
        return None
    entries = blocks[-1]
    for other in blocks[:-1]:
        if _hash(other) != _hash(entries):
            raise ProfileError(
                f"{source}: carries two different profiles, {other.get('name', '')!r} and "
                f"{entries.get('name', '')!r}: was it joined from several programs? {REMEDY}."
            )
    name, version = str(entries.pop("name", "")), str(entries.pop("version", ""))
    settings: dict[str, Any] = {}
    for key, value in entries.items():
        section, _, bare = key.partition(".")
        settings.setdefault(section, {})[bare] = value
    known = {f"{section}.{key}": value for section, key, value in _settings(Profile())}
    strange = [key for key in entries if key not in known]
    if strange:
        raise ProfileError(
            f"{source}: was made by vslice {version or 'of an unknown version'}, whose profiles have "
            f"what this version does not know: {', '.join(strange)}. "
            "Use that version, or give the machine with -p."
        )
    profile = made(f"{source}: its profile {name}", settings, overrides)
    unsaid = [f"{key} = {_json(value)}" for key, value in known.items() if key not in entries]
    return Carried(name, version, profile, unsaid)


def read_file(path: Path, overrides: Sequence[str] = ()) -> Carried | None:
    """The profile that the program in a file carries; see ``read``.

    Raises:
        ParseError: the file cannot be read.
        ProfileError: as ``read``.
    """
    return read(comments_in(path), str(path), overrides)


def comments_in(path: Path) -> Iterator[str]:
    """``comments_of`` a file.

    Raises:
        ParseError: the file cannot be read.
    """
    try:
        yield from comments_of(load(path).lines)
    except ReadError as error:
        raise ParseError(str(error)) from None


def comments_of(lines: Iterable[str]) -> Iterator[str]:
    """What stands behind the first semicolon of each line of a program that has one."""
    for line in lines:
        _, semicolon, comment = line.partition(";")
        if semicolon:
            yield comment


def differences(carried: Profile, given: Profile) -> list[str]:
    """A line for each setting in which two profiles differ, with both values; not in what it is called."""
    return [
        f"{section}.{key}: {_json(value)} in the program, {_json(other)} given"
        for (section, key, value), (_, _, other) in zip(_settings(carried), _settings(given), strict=True)
        if value != other and key != "description"
    ]


def _blocks(comments: Iterable[str], source: str) -> Iterator[tuple[list[str], str]]:
    """Each block: its lines, put together where they had been cut, and what its end says."""
    lines: list[str] | None = None
    cut = f"{source}: the profile that it carries is cut off. {REMEDY}."
    for comment in comments:
        text = comment.strip()
        if text == BEGIN:
            if lines is not None:
                raise ProfileError(cut)
            lines = []
        elif lines is not None and text.startswith(END):
            yield lines, text.removeprefix(END).strip()
            lines = None
        elif lines and text.startswith(MORE):
            lines[-1] += text.removeprefix(MORE)
        elif lines is not None and text:
            lines.append(text)
    if lines is not None:
        raise ProfileError(cut)


def _entries(lines: list[str], said: str, source: str) -> dict[str, Any]:
    entries: dict[str, Any] = {}
    for line in lines:
        key, equals, text = line.partition(" = ")
        try:
            if not equals or key in entries:
                raise ValueError
            entries[key] = json.loads(text)
        except (ValueError, RecursionError):
            raise ProfileError(
                f"{source}: the profile that it carries is damaged: '{line[:60]}' is no setting, or is one "
                f"more of its name. {REMEDY}."
            ) from None
    found = HASH + _hash(entries)
    if said != found:
        raise ProfileError(
            f"{source}: the profile that it carries was changed or damaged: its lines give {found[:19]}.., "
            f"but its end says {said[:19]}... {REMEDY}; change single settings with --set when slicing."
        )
    return entries


def _settings(profile: Profile) -> Iterator[tuple[str, str, Any]]:
    for section, values in profile:
        if isinstance(values, BaseModel):
            for key, value in values:
                yield section, key, value


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=True)


def _hash(entries: dict[str, Any]) -> str:
    text = "\n".join(f"{key} = {_json(value)}" for key, value in entries.items())
    return hashlib.sha256(text.encode()).hexdigest()


def _cut(text: str, width: int) -> int:
    """Where a line ends: never beside a blank, since editors drop blanks at the ends of lines."""
    end = min(len(text), width)
    while end < len(text) and (text[end - 1].isspace() or text[end].isspace()):
        end += 1
    return end
