"""What a job will take: the time of each command and the height after it, for displays."""

import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gcode.estimate import seconds_of
from gcode.parse import parse

if TYPE_CHECKING:
    from printer import Program
    from profiles import Profile


@dataclass(frozen=True)
class Timeline:
    """``seconds[k]`` of printing passed and ``heights_mm[k]`` (NaN if unknown) before command k, and one more
    of each for the end. Waits for heaters take no time here: how long is the machine's affair."""

    seconds: "array[float]"
    heights_mm: "array[float]"

    @property
    def total_s(self) -> float:
        """The whole job in s, heating apart."""
        return self.seconds[-1]


def timeline(program_file: Path, program: "Program", profile: "Profile") -> Timeline:
    """The times of ``program``, which was read from ``program_file``, on this machine.

    Raises:
        OSError: the file cannot be read.
        ParseError: it holds what `vslice check` does not read, such as an arc.
    """
    seconds, heights = array("d", [0.0]), array("f", [math.nan])
    steps = _steps(program_file, profile)
    step = next(steps, None)
    passed, height = 0.0, math.nan
    for line in program.lines:
        while step is not None and step[0] <= line:
            passed, height = passed + step[1], step[2]
            step = next(steps, None)
        seconds.append(passed)
        heights.append(height)
    return Timeline(seconds, heights)


def _steps(program_file: Path, profile: "Profile") -> Iterator[tuple[int, float, float]]:
    """Line of the file, seconds and height of each move."""
    with program_file.open(encoding="utf-8", errors="replace") as lines:
        moves = list(parse(lines, plane=profile.machine.plane, flavor=profile.flavor))
    for move, seconds in zip(moves, seconds_of(moves, profile).tolist(), strict=True):
        yield move.line, seconds, move.y_mm
