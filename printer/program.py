"""A program as the sender wants it: clean commands, each with the line that it stands in."""

import hashlib
import re
from array import array
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from printer.errors import ProtocolError
from printer.protocol import clean, fault_of

TOOLPATH = re.compile(r"\s*;\s*TOOLPATH\s+(\d+)\b")


@dataclass(frozen=True, slots=True)
class Program:
    """Commands without comments and blanks.

    ``lines[k]`` is the line of ``commands[k]`` in the file, counted from 1. ``toolpaths`` holds, for each
    comment ``;TOOLPATH n``, the index of the first command behind it. ``printing_time_s`` is what the
    slicer wrote into the file, in seconds, or None.
    """

    name: str
    commands: list[str]
    lines: "array[int]"
    toolpaths: "array[int]"
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


def read_program(path: Path) -> Program:
    """Read a G-code file.

    Raises:
        OSError: if the file cannot be read.
        ProtocolError: if it is no UTF-8 text, or holds a line that Marlin cannot take.
    """
    data = path.read_bytes()
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        raise ProtocolError(
            f"{path.name}: byte {error.start} is no UTF-8 text: this is no G-code file, or a binary one"
        ) from error
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return make_program(text.split("\n"), name=path.name, sha256=hashlib.sha256(data).hexdigest())


def make_program(lines: Iterable[str], name: str = "program", sha256: str | None = None) -> Program:
    """Clean the lines and check each.

    Raises:
        ProtocolError: for a command that is too long or that contains M110, with its line.
    """
    digest = hashlib.sha256()
    commands: list[str] = []
    numbers, toolpaths = array("q"), array("q")
    printing_time_s: float | None = None
    known: dict[str, str] = {}  # repeated commands are stored once
    for number, line in enumerate(lines, start=1):
        if sha256 is None:
            digest.update(line.encode(errors="surrogatepass") + b"\n")
        if ";" in line:
            if TOOLPATH.match(line):
                toolpaths.append(len(commands))
            elif printing_time_s is None and "printing time" in line:
                printing_time_s = read_duration(line)
        if command := clean(line):
            if len(command) > 60 or "M110" in command or not (command.isascii() and command.isprintable()):
                _refuse(command, name, number)
            commands.append(known.setdefault(command, command) if len(command) < 12 else command)
            numbers.append(number)
    return Program(name, commands, numbers, toolpaths, sha256 or digest.hexdigest(), printing_time_s)


def _refuse(command: str, name: str, number: int) -> None:
    # Our own lines share the numbers; ten times the line and a thousand leave room for all of them.
    fault = fault_of(command, 10 * number + 1000)
    if fault:
        raise ProtocolError(f"{name}: line {number}: {command[:40]!r}: {fault}.")


def read_duration(comment: str) -> float | None:
    """Seconds in a comment like ``; estimated printing time (normal mode) = 1d 2h 3m 4.5s``, or None."""
    match = re.search(r"printing time[^=:]*[=:]\s*([\d.dhms ]+)", comment)
    parts = re.findall(r"(\d+(?:\.\d*)?)\s*([dhms])", match[1]) if match else []
    units = {"d": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0}
    return sum(float(value) * units[unit] for value, unit in parts) if parts else None
