"""A sequencing problem from a file: a grid, or an instance of the reference format.

An instance holds toolpaths instead of tiles, ``{"segments": [[[x, y], [x, y]], ...], "first": index or
null}``, in mm; other keys are ignored.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from profiles import Profile
from slicer import grid
from slicer.errors import CycleError, GridError, SlicerError
from slicer.hatch import Hatch
from slicer.sequence import Problem
from slicer.sequence.problem import REACH_MM
from vslice.nozzle import body_of
from vslice.pipeline import hatched
from vslice.printable import printable
from vslice.reading import read_grid


class Instance(NamedTuple):
    """A sheet to be ordered.

    Attributes:
        problem: its sequencing problem.
        spacing_mm: float64 (n,), the spacing of each toolpath; None where the file does not say.
        ends: bool (n, 2), which endpoints are ends of toolpaths, not cuts; None where all are.
    """

    problem: Problem
    spacing_mm: NDArray[np.float64] | None
    ends: NDArray[np.bool_] | None = None


def load_instance(path: Path, start: str, profile: Profile | None = None) -> Instance:
    """The sheet of a grid file, or of an instance, for the nozzle of a machine.

    Args:
        profile: the machine, by default one whose nozzle is a point; where an instance says no spacing, its
            beads are as high as they are wide.
        start: "corner" is the lowest toolpath of the bottom left tile of a grid, at its lower end, and the
            first toolpath of an instance in either direction, unless it has to be cut; "free" is wherever is
            best.

    Raises:
        GridError: the file is neither; one line for each problem.
        SlicerError: the grid leaves no toolpaths.
    """
    profile = profile or Profile()
    data = _json_object(path)
    if data is None or not ({"segments", "first"} & data.keys()):
        sheet = read_grid(path)
        lines = hatched(sheet)
        spacing = sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]]
        body = body_of(profile, spacing)
        nozzle = profile.nozzle
        shaped = printable(str(path), lines, start, body, nozzle.downhill_deg, overlap_mm=nozzle.overlap_mm)
        tile = shaped.lines.tile
        return Instance(shaped.problem, sheet.spacing_mm[tile[:, 1], tile[:, 0]], shaped.ends)
    problems = _problems(data)
    if problems:
        raise GridError(str(path), problems)
    try:
        first = data["first"] if start == "corner" else None
        segments = np.array(data["segments"], np.float64)
        body = body_of(profile, np.full(len(segments), profile.material.width_mm))
        downhill = profile.nozzle.downhill_deg
        try:
            return Instance(Problem.build(segments, body=body, downhill_deg=downhill, first=first), None)
        except CycleError:
            lines = Hatch(segments, np.zeros((len(segments), 2), np.int32), 0)
            shaped = printable(str(path), lines, "free", body, downhill, overlap_mm=profile.nozzle.overlap_mm)
            return Instance(shaped.problem, None, shaped.ends)
    except SlicerError as error:
        raise GridError(str(path), [str(error)]) from None


def _json_object(path: Path) -> dict[str, Any] | None:
    """What the file holds, or None where it is no object: the reader of grids says what is wrong with it."""
    try:
        if path.stat().st_size > grid.MAX_FILE_BYTES:
            return None
        data = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return data if isinstance(data, dict) else None


def _problems(data: dict[str, Any]) -> list[str]:
    """A line for each thing that is wrong with an instance."""
    missing = [
        f"key '{key}' is missing; an instance has both, {meaning}."
        for key, meaning in (
            ("segments", "'segments' being its toolpaths, [[[x, y], [x, y]], ...]"),
            ("first", "'first' being the number of its first toolpath, or null for a free start"),
        )
        if key not in data
    ]
    if missing:
        return missing
    segments, first = data["segments"], data["first"]
    if not isinstance(segments, list):
        return [f"segments is {_shown(segments)}; it must be a list, [[[x, y], [x, y]], ...]."]
    if not segments:
        return ["segments holds 0 toolpaths, but there must be at least 1 to be ordered; add toolpaths."]
    problems = []
    for k, segment in enumerate(segments):
        problems += _problems_of_segment(f"segments[{k}]", segment)
    whole = isinstance(first, int) and not isinstance(first, bool)
    last = len(segments) - 1
    if first is not None and not (whole and 0 <= first <= last):
        problems.append(
            f"first is {_shown(first)}, but there are {len(segments)} toolpaths; "
            f"give a whole number from 0 to {last}, or null for a free start."
        )
    return problems


def _problems_of_segment(name: str, segment: Any) -> list[str]:
    if not isinstance(segment, list) or len(segment) != 2:
        return [f"{name} {_count(segment, 'point')}, but a toolpath has 2; write [[x, y], [x, y]]."]
    problems = []
    for end, point in enumerate(segment):
        if not isinstance(point, list) or len(point) != 2:
            problems.append(
                f"{name}[{end}] {_count(point, 'coordinate')}, but a point has 2; write [x, y], in mm."
            )
            continue
        for axis, value in enumerate(point):
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not abs(value) <= REACH_MM:  # no comparison holds for NaN
                problems.append(
                    f"{name}[{end}][{axis}] is {_shown(value)}; "
                    f"a coordinate must be a number of mm from {-REACH_MM:.0f} to {REACH_MM:.0f}."
                )
    return problems


def _count(value: Any, what: str) -> str:
    """What stands in the place of a list."""
    if not isinstance(value, list):
        return f"is {_shown(value)}"
    return f"holds {len(value)} {what}{'' if len(value) == 1 else 's'}"


def _shown(value: Any) -> str:
    """A value as it stands in the file, cut where it is long."""
    text = json.dumps(value, ensure_ascii=True)
    return text if len(text) <= 40 else text[:37] + "..."
