"""What a page must know of a program to play it: where the nozzle is when, what it lays, what is wrong."""

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gcode.bead import bead_area_mm2, feed_area_mm2
from gcode.estimate import seconds_of
from gcode.feeding import check_feeding
from gcode.head import read_head
from gcode.moves import Kind, Move
from gcode.nozzle_body import parts_of
from gcode.player.packing import counted, pack
from gcode.player.support import support
from gcode.strokes import motions, named_joins, prime_strokes
from gcode.violation import Violation
from profiles import Profile

if TYPE_CHECKING:  # it imports shapely, which a program alone does not take
    from slicer.grid import Grid

TRAVEL, TOOLPATH, PRIME, STANDS, JUMP = range(5)
"""What a step is. A jump goes where nobody followed it, and nothing is drawn for it."""

TICK_S, DROP_UL, GRAIN_MM, CREEP_MM_S = 1e-4, 1e-4, 1e-3, 1e-2
"""Resolution of times, volumes, places and speeds in a page."""

MOST_FINDINGS = 1000
"""So many are listed in a page; their number is told."""

TOOL = re.compile(r"T(\d{1,2})$")
FACTS = ("version", "profile", "method", "objective", "effort", "seed", "toolpaths")


@dataclass(frozen=True, eq=False)
class Track:
    """A program as steps (m,) of which each takes time or goes somewhere, and what it lays (n,).

    What is laid are toolpaths, and joins: the hops over which a bead goes on from one toolpath to the next.

    Attributes:
        name: what it is called.
        end_mm: float64 (m, 2), where the nozzle is after each step, in the plane of the sheet.
        end_s: float64 (m,), the estimated time after each step.
        kind: uint8 (m,), TRAVEL, TOOLPATH, PRIME, STANDS or JUMP.
        line: int64 (m,), its line in the program.
        volume_ul: float64 (m,), what has been laid for the print after each step.
        speed_mm_s: float64 (m,), as the program says it.
        tool: uint8 (m,), number of the tool.
        height_mm: float64 (n,), of the bead, in the plane of the sheet.
        join: uint8 (n,), 1 for a join.
        hangs: uint8 (n,), percent of its length with nothing close below.
        after: int64 (n,), how many of all that is laid must be printed before this one.
        tile: int64 (n,), row times ``cols`` plus column, or -1; empty where no grid is given.
        cols: columns of the grid.
        findings: what ``check`` found.
        facts: of the machine and of the head of the program.
    """

    name: str
    end_mm: NDArray[np.float64]
    end_s: NDArray[np.float64]
    kind: NDArray[np.uint8]
    line: NDArray[np.int64]
    volume_ul: NDArray[np.float64]
    speed_mm_s: NDArray[np.float64]
    tool: NDArray[np.uint8]
    height_mm: NDArray[np.float64]
    join: NDArray[np.uint8]
    hangs: NDArray[np.uint8]
    after: NDArray[np.int64]
    tile: NDArray[np.int64]
    cols: int
    findings: Sequence[Violation]
    facts: dict[str, Any]

    @property
    def toolpaths(self) -> int:
        """How many there are, without the joins between them."""
        return len(self.join) - int(self.join.sum())

    @property
    def total_s(self) -> float:
        """The estimated time of all of it, homing and heating apart."""
        return float(self.end_s[-1]) if len(self.end_s) else 0.0

    def packed(self) -> tuple[dict[str, Any], str]:
        """What a page reads: a header, and the arrays as text."""
        time, tick = counted(self.end_s, TICK_S)
        volume, drop = counted(self.volume_ul, DROP_UL)
        speed, creep = counted(self.speed_mm_s, CREEP_MM_S)
        places, grain = counted(self.end_mm, GRAIN_MM)
        height, layer = counted(self.height_mm, GRAIN_MM)
        arrays: dict[str, NDArray[Any]] = {
            "x": places[:, 0],
            "y": places[:, 1],
            "time": time,
            "line": self.line,
            "volume": volume,
            "speed": speed,
            "kind": self.kind,
            "tool": self.tool,
            "height": height,
            "join": self.join,
            "hangs": self.hangs,
            "after": self.after,
            "tile": self.tile,
        }
        table, text = pack(arrays)
        header = {
            "name": self.name,
            "units": {
                "x": grain, "y": grain, "time": tick, "volume": drop, "speed": creep, "height": layer,
            },
            "arrays": table,
            "cols": self.cols,
            "findings": [[v.line, v.kind, v.message] for v in self.findings[:MOST_FINDINGS]],
            "findings_in_all": len(self.findings),
            **self.facts,
        }  # fmt: skip
        return header, text


def track_of(
    moves: list[Move],
    profile: Profile,
    *,
    name: str,
    findings: Sequence[Violation] = (),
    grid: "Grid | None" = None,
    joins: Collection[int] = (),
) -> Track:
    """The steps of a program, timed as ``gcode.estimate`` does.

    Args:
        moves: as they were read from its text.
        name: what the page calls it.
        findings: of ``gcode.check``, to be marked.
        grid: from which it was sliced: toolpaths then know their tile.
        joins: program lines of the hops over which a bead goes on, as ``check`` finds them with a grid. Those
            that the program itself names by the comment ``;JOIN`` need not be said.
    """
    _, printing = check_feeding(moves, profile)
    primes = prime_strokes(motions(moves, printing), moves, profile.motion.prime_mm)
    named = {*joins, *named_joins(moves, printing)}
    steps, heights = _steps(moves, printing, primes, seconds_of(moves, profile).tolist(), profile)
    table = np.array(steps, np.float64).reshape(-1, 8)
    end = table[:, :2]
    known = np.flatnonzero(~np.isnan(end[:, 0]))
    # Before any place is known, the nozzle is shown at the first that is.
    end[: known[0] if len(known) else len(end)] = end[known[0]] if len(known) else 0.0
    height = np.array(heights, np.float64)
    kind = table[:, 2].astype(np.uint8)
    laid = np.flatnonzero(kind == TOOLPATH)
    lines = np.stack([end[laid - 1], end[laid]], axis=1) if len(laid) else np.empty((0, 2, 2))
    join = np.array([line in named for line in table[laid, 4].astype(np.int64).tolist()], np.uint8)
    hangs, after = support(lines, height, profile.machine.bed_z_mm)
    return Track(
        name=name,
        end_mm=end,
        end_s=np.cumsum(table[:, 3]),
        kind=kind,
        line=table[:, 4].astype(np.int64),
        volume_ul=np.cumsum(table[:, 5]),
        speed_mm_s=np.nan_to_num(table[:, 6]),
        tool=table[:, 7].astype(np.uint8),
        height_mm=height,
        join=join,
        hangs=hangs,
        after=after,
        tile=_tiles(lines, grid, moves),
        cols=0 if grid is None else grid.cols,
        findings=findings,
        facts=_facts(moves, profile),
    )


def _steps(
    moves: Sequence[Move],
    printing: Sequence[bool],
    primes: set[int],
    seconds: Sequence[float],
    profile: Profile,
) -> tuple[list[tuple[float, ...]], list[float]]:
    """Rows (x, y, kind, seconds, line, volume, speed, tool), and the height of all that is laid."""
    material = profile.material
    feed_area = feed_area_mm2(material)
    height = material.height_mm or material.width_mm
    bead = _area(profile, height)
    tool = 0
    x = y = math.nan
    steps: list[tuple[float, ...]] = []
    heights: list[float] = []
    for move, prints, took in zip(moves, printing, seconds, strict=True):
        if move.kind == Kind.COMMENT:
            if move.text.startswith("HEIGHT:") and material.height_mm is None:
                height = _number(move.text.partition(":")[2], height)
                bead = _area(profile, height)
            continue
        if move.kind == Kind.COMMAND and (said := TOOL.match(move.text.strip())):
            tool = int(said[1])
        known = not (math.isnan(move.x_mm) or math.isnan(move.y_mm))
        goes = known and (move.x_mm, move.y_mm) != (x, y)
        volume, kind = 0.0, STANDS
        if goes and (math.isnan(x) or move.kind not in (Kind.TRAVEL, Kind.EXTRUDE)):
            kind = JUMP
        elif goes and not prints:
            kind = TRAVEL
        elif goes:
            kind = PRIME if move.line in primes else TOOLPATH
            if kind == TOOLPATH:
                length = math.hypot(move.x_mm - x, move.y_mm - y)
                volume = bead * length if feed_area is None else move.e_mm * feed_area
                heights.append(height)
        if goes:
            x, y = move.x_mm, move.y_mm
        if goes or took > 0:
            steps.append((x, y, kind, took, move.line, volume, move.speed_mm_s, tool))
    return steps, heights


def _area(profile: Profile, height_mm: float) -> float:
    return float(bead_area_mm2(profile.material, np.array([height_mm]))[0]) * profile.material.flow


def _number(text: str, otherwise: float) -> float:
    try:
        number = float(text)
    except ValueError:
        return otherwise
    return number if 0 < number < math.inf else otherwise


def _tiles(lines: NDArray[np.float64], grid: "Grid | None", moves: Sequence[Move]) -> NDArray[np.int64]:
    """The tile of the middle of each toolpath; -1 outside the grid, and nothing without one."""
    if grid is None or len(lines) == 0:
        return np.empty(0, np.int64)
    said = read_head(moves).get("shift_mm", "").split()
    try:
        shift = np.array([float(number) for number in said]).reshape(2)
    except ValueError:
        from slicer.hatch import hatch

        shift = lines.min(axis=(0, 1)) - hatch(grid).segments.min(axis=(0, 1))
    place = (lines.mean(axis=1) - shift - grid.origin_mm) / grid.tile_mm
    col, row = np.floor(place).astype(np.int64).T
    inside = (col >= 0) & (row >= 0) & (col < grid.cols) & (row < grid.rows)
    return np.where(inside, row * grid.cols + col, -1)


def _facts(moves: Sequence[Move], profile: Profile) -> dict[str, Any]:
    """What the page says and draws of the machine and of how the program was made."""
    machine = profile.machine
    head = read_head(moves)
    return {
        "axes": machine.plane,
        "bed_mm": machine.bed_z_mm,
        "nozzle": nozzle_of(profile),
        "head": {key: head[key] for key in FACTS if key in head},
    }


def nozzle_of(profile: Profile) -> dict[str, Any] | None:
    """The parts of the nozzle as ``gcode.nozzle_body`` has them; None where it is a point."""
    parts = parts_of(profile.nozzle)
    if not parts:
        return None
    told = [
        {key: None if value == math.inf else value for key, value in part._asdict().items()} for part in parts
    ]
    return {"parts": told, "press_mm": profile.nozzle.press_mm}
