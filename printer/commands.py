"""A program as the sender wants it: clean commands, each with the line that it stands in."""

import hashlib
import re
from array import array
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from dialect.errors import ReadError
from dialect.reader import read
from dialect.source import Source, load
from printer.errors import ProtocolError

TOOLPATH = re.compile(r"\s*TOOLPATH\s+(\d+)\b")
JOIN = re.compile(r"\s*JOIN\s*")


@dataclass(frozen=True, slots=True)
class Program:
    """Commands without comments and blanks.

    ``lines[k]`` is the line of ``commands[k]`` in the file, counted from 1. ``toolpaths`` holds, for each
    comment ``;TOOLPATH n``, the index of the first command behind it; ``starts`` the same, and where a
    toolpath goes on behind a hop that is extruded to it (``;JOIN``). ``printing_time_s`` is what the slicer
    wrote into the file, in seconds, or None.
    """

    name: str
    commands: list[str]
    lines: "array[int]"
    toolpaths: "array[int]"
    starts: "array[int]"
    sha256: str
    printing_time_s: float | None = None

    def __len__(self) -> int:
        return len(self.commands)

    def acknowledged_line(self, acknowledged: int) -> int:
        """The line of the file up to which ``acknowledged`` commands reach; 0 before the first."""
        return self.lines[acknowledged - 1] if acknowledged else 0

    def index_of_line(self, line: int) -> int:
        """How many commands stand in the lines up to and with ``line``."""
        return bisect_right(self.lines, line)


def read_program(source: Source | Path) -> Program:
    """Read a G-code file, or one that has been loaded.

    Raises:
        ProtocolError: if it cannot be read, or holds a line that Marlin cannot take.
    """
    try:
        source = load(source) if isinstance(source, Path) else source
    except ReadError as error:
        raise ProtocolError(str(error)) from None
    program = make_program(source.lines, name=source.name, sha256=source.sha256)
    return replace(program, name=Path(source.name).name)


def make_program(lines: Iterable[str], name: str = "program", sha256: str | None = None) -> Program:
    """Read the lines, as ``dialect.reader`` does.

    Raises:
        ProtocolError: for what is no command, is too long or contains M110, with its line.
    """
    digest = hashlib.sha256()
    commands: list[str] = []
    numbers, toolpaths, starts = array("q"), array("q"), array("q")
    printing_time_s: float | None = None
    known: dict[str, str] = {}  # repeated commands are stored once
    if sha256 is None:
        lines = list(lines)
        for line in lines:
            digest.update(line.encode(errors="surrogatepass") + b"\n")
    try:
        for number, command, comment in read(lines, name):
            if comment is not None:
                if not command and TOOLPATH.match(comment):
                    toolpaths.append(len(commands))
                    starts.append(len(commands))
                elif not command and toolpaths and JOIN.fullmatch(comment):
                    starts.append(len(commands) + 1)
                elif printing_time_s is None and "printing time" in comment:
                    printing_time_s = read_duration(comment)
            if command:
                commands.append(known.setdefault(command, command) if len(command) < 12 else command)
                numbers.append(number)
    except ReadError as error:
        raise ProtocolError(str(error)) from None
    return Program(name, commands, numbers, toolpaths, starts, sha256 or digest.hexdigest(), printing_time_s)


def read_duration(comment: str) -> float | None:
    """Seconds in a comment like ``; estimated printing time (normal mode) = 1d 2h 3m 4.5s``, or None."""
    match = re.search(r"printing time[^=:]*[=:]\s*([\d.dhms ]+)", comment)
    parts = re.findall(r"(\d+(?:\.\d*)?)\s*([dhms])", match[1]) if match else []
    units = {"d": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0}
    return sum(float(value) * units[unit] for value, unit in parts) if parts else None
