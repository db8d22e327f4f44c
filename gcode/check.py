"""Replay a program against the physics; knows nothing of how it was planned or written."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gcode.bead import bead_height_mm, press_mm, said_height_mm
from gcode.envelope import replay
from gcode.errors import ParseError
from gcode.feeding import check_feeding
from gcode.followed import check_commands
from gcode.head import read_head
from gcode.limits import AxisLimits
from gcode.moves import Kind, Move
from gcode.parse import read_moves
from gcode.pressing import Pressing, check_nozzle
from gcode.ranges import SLOWEST_MM_S
from gcode.strokes import Stroke, compare_with_hatch, motions, prime_strokes
from gcode.unseen import unseen_collisions
from gcode.violation import Violation
from profiles import Profile

if TYPE_CHECKING:  # it imports shapely, which a program alone does not take
    from slicer.grid import Grid

RESOLUTION_MM = 0.001
"""Positions are written with three decimals: either end of a line may be this far off."""

EXACT_MM = 1e-8


@dataclass(frozen=True, eq=False)
class Report:
    """What a replay found.

    Attributes:
        violations: in the order of the program.
        moves: how many moves were replayed.
        extrusions: how many of them laid material.
        printed_mm, travel_mm: length of what laid material and of what did not, once it had begun.
        pressing: how deep the printed pushes into the nozzle's body; None where that is a point.
        join_lines: of the hops over which the bead went on from one hatch line to the next; none without
            a grid.
    """

    violations: list[Violation]
    moves: int
    extrusions: int
    printed_mm: float
    travel_mm: float
    pressing: Pressing | None
    join_lines: frozenset[int] = frozenset()

    @property
    def joins(self) -> int:
        """How many such hops there are."""
        return len(self.join_lines)


def check_file(path: Path, profile: Profile, grid: "Grid | None" = None) -> Report:
    """Replay the program in a file; see ``check``.

    Raises:
        ParseError: the file cannot be read, or is no G-code of the kind that is read here.
    """
    return check(read_moves(path, plane=profile.machine.plane, flavor=profile.flavor), profile, grid)


def check(moves: list[Move], profile: Profile, grid: "Grid | None" = None) -> Report:
    """Replay a program and list what is wrong with it.

    Every extrusion must be printable, no travel may pass through printed material, every position must
    be in the build volume and in the plane, no speed above the limits, extrusion constant along all
    toolpaths and none while travelling, and no command but those that are followed may stand in the
    print. Where the profile's nozzle has a body, nothing printed may push deeper into it than it allows. With
    a grid, each of its hatch lines must be printed exactly once.
    """
    feeding, printing = check_feeding(moves, profile, _only_spacing(grid))
    laid = motions(moves, printing)
    segments = np.array([(s.x0, s.y0, s.x1, s.y1, s.line) for s in laid], np.float64).reshape(-1, 5)
    primes = prime_strokes(laid, moves, profile.motion.prime_mm)
    violations = (
        check_commands(moves, printing, profile)
        + feeding
        + _volume(moves, profile)
        + _speeds(moves, profile)
        + _plane(laid)
    )
    violations += _incomplete(moves, sum(stroke.prints for stroke in laid) - len(primes))
    # Two uprights of one x, as far as three decimals tell, may in truth pass beside each other.
    violations += _collisions(laid, segments, same_x=0.0 if grid is None else -1.0)
    violations += unseen_collisions(moves, printing, RESOLUTION_MM)
    allowed_mm = press_mm(profile.nozzle, _bead_heights(moves, profile, grid))
    driven, pressing = check_nozzle(laid, profile.nozzle, allowed_mm, RESOLUTION_MM)
    violations += driven
    joins: set[int] = set()
    if grid is not None:
        drawn = [stroke for stroke in laid if stroke.prints and stroke.line not in primes]
        compared = compare_with_hatch(drawn, grid, _shift(moves), _join_mm(profile, grid))
        joins = compared.joins
        said = {violation.line for violation in violations if violation.kind == "printability"}
        violations += compared.violations + [v for v in _out_of_order(compared.exact) if v.line not in said]
    violations.sort(key=lambda violation: violation.line or math.inf)
    lengths = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
    prints = np.array([stroke.prints and stroke.line not in primes for stroke in laid], np.bool_)
    if prints.any():  # what comes before and after the print is no travel of the print
        used = np.flatnonzero(prints)
        inside = np.zeros(len(prints), np.bool_)
        inside[used[0] : used[-1] + 1] = True
        travel = float(lengths[inside & ~prints].sum())
    else:
        travel = 0.0
    printed = float(lengths[prints].sum())
    return Report(violations, len(moves), int(prints.sum()), printed, travel, pressing, frozenset(joins))


def _collisions(laid: list[Stroke], segments: NDArray[np.float64], same_x: float) -> list[Violation]:
    prints = np.array([stroke.prints for stroke in laid], np.bool_)
    who, how = replay(segments, prints, RESOLUTION_MM, same_x)
    found = []
    for (k, below), (depth, x) in zip(who.tolist(), how.tolist(), strict=True):
        stroke = laid[k]
        kind = "printability" if stroke.prints else "collision"
        what = "extrusion" if stroke.prints else "travel"
        found.append(
            Violation(
                stroke.line,
                kind,
                f"{what} to ({stroke.x1:.3f}, {stroke.y1:.3f}) passes {depth:.3f} mm below what line {below} "
                f"printed, at {x:.3f}",
            )
        )
    return found


def _incomplete(moves: list[Move], extrusions: int) -> list[Violation]:
    """A program that prints nothing, or less than its head speaks of."""
    if extrusions == 0:
        return [Violation(0, "missing", "nothing is extruded in it; is the profile the right one?")]
    said = read_head(moves).get("toolpaths", "")
    if said.isdigit() and int(said) > extrusions:
        text = f"its head speaks of {said} toolpaths, but it has {extrusions} extrusions; is it cut off?"
        return [Violation(0, "missing", text)]
    return []


def _out_of_order(exact: NDArray[np.float64]) -> list[Violation]:
    """Printability of the hatch lines themselves, which the resolution of the text does not blur."""
    who, how = replay(exact, np.ones(len(exact), np.bool_), EXACT_MM, EXACT_MM)
    return [
        Violation(
            int(exact[k, 4]),
            "printability",
            f"the hatch line that it prints lies {depth:.3f} mm below that of line {below}, at {x:.3f}",
        )
        for (k, below), (depth, x) in zip(who.tolist(), how.tolist(), strict=True)
    ]


def _volume(moves: list[Move], profile: Profile) -> list[Violation]:
    machine = profile.machine
    low = machine.build_corner_mm
    high = [a + b for a, b in zip(low, machine.build_volume_mm, strict=True)]
    along, across = (0, 1) if machine.plane == "XZ" else (1, 0)
    found = []
    before = (math.nan,) * 3
    for move in moves:
        here = (move.x_mm, move.depth_mm, move.y_mm)
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE):
            for value, old, axis in zip(here, before, (along, across, 2), strict=True):
                if value != old and not low[axis] - RESOLUTION_MM <= value <= high[axis] + RESOLUTION_MM:
                    if math.isnan(value):
                        continue
                    where = f"outside the build volume, {low[axis]:g} to {high[axis]:g} mm"
                    found.append(Violation(move.line, "volume", f"{'XYZ'[axis]} {value:.3f} is {where}"))
        before = here
    return found


def _speeds(moves: list[Move], profile: Profile) -> list[Violation]:
    limits = AxisLimits.of(profile)
    horizontal, across = profile.machine.plane[0], "Y" if profile.machine.plane == "XZ" else "X"
    found = []
    moving = (Kind.TRAVEL, Kind.EXTRUDE, Kind.FEED)
    unset = next((m for m in moves if m.kind in moving and not m.speed_mm_s > 0), None)
    slow = next((m for m in moves if m.kind in moving and 0 < m.speed_mm_s < SLOWEST_MM_S), None)
    if slow is not None:
        text = f"moves at {slow.speed_mm_s:.2g} mm/s; at least {SLOWEST_MM_S:g} mm/s are taken here"
        found.append(Violation(slow.line, "speed", text))
    if unset is not None:
        found.append(Violation(unset.line, "speed", "moves before any speed above 0 (F) has been set"))
    before: Move | None = None
    for move in moves:
        if move.kind == Kind.FEED and move.speed_mm_s > limits.e_mm_s * 1.001:
            found.append(_too_fast(move, "E", move.speed_mm_s, limits.e_mm_s))
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE) and before is not None:
            steps = [move.x_mm - before.x_mm, move.y_mm - before.y_mm, move.depth_mm - before.depth_mm]
            steps = [0.0 if math.isnan(step) else abs(step) for step in steps]
            length = math.hypot(*steps)
            axes = (
                (horizontal, limits.x_mm_s, RESOLUTION_MM),
                ("Z", limits.y_mm_s, RESOLUTION_MM),
                (across, limits.depth_mm_s, RESOLUTION_MM),
                ("E", limits.e_mm_s, 1e-5),
            )
            for step, (axis, limit, resolution) in zip([*steps, move.e_mm], axes, strict=True):
                # Rounding turns and shortens short moves: as if the step were less by the resolution.
                slowest = (step - resolution) / (length + RESOLUTION_MM) * move.speed_mm_s
                if length > RESOLUTION_MM and slowest > limit * 1.001:
                    found.append(_too_fast(move, axis, step / length * move.speed_mm_s, limit))
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE):
            before = move
    return found


def _too_fast(move: Move, axis: str, speed: float, limit: float) -> Violation:
    return Violation(move.line, "speed", f"{axis} would move at {speed:.2f} mm/s, its limit is {limit:g}")


def _plane(laid: list[Stroke]) -> list[Violation]:
    found = []
    sheet = next((s.depth for s in laid if s.prints), math.nan)
    for s in laid:
        if not s.prints:
            continue
        if s.off_plane > RESOLUTION_MM:
            text = f"leaves the plane of the sheet by {s.off_plane:.3f} mm while extruding"
            found.append(Violation(s.line, "plane", text))
        elif abs(s.depth - sheet) > RESOLUTION_MM:
            text = f"extrudes at {s.depth:.3f} across the sheet, which stands at {sheet:.3f}"
            found.append(Violation(s.line, "plane", text))
    return found


def _join_mm(profile: Profile, grid: "Grid") -> float:
    """The longest hop over which a bead goes on, by the least spacing of the sheet."""
    return profile.motion.longest_join_mm(grid.spacing_mm[~np.isnan(grid.angles_deg)].tolist())


def _only_spacing(grid: "Grid | None") -> float | None:
    """The height of all beads, where a grid is given and has one spacing."""
    if grid is None:
        return None
    used = np.unique(grid.spacing_mm[~np.isnan(grid.angles_deg)])
    return float(used[0]) if len(used) == 1 else None


def _bead_heights(moves: list[Move], profile: Profile, grid: "Grid | None") -> NDArray[np.float64]:
    """Heights of the beads, as far as profile, grid or program tell: PrusaSlicer and vslice write ;HEIGHT."""
    if grid is not None:
        spacing = np.unique(grid.spacing_mm[~np.isnan(grid.angles_deg)])
    else:
        said = {said_height_mm(m.text) for m in moves if m.kind == Kind.COMMENT}
        spacing = np.array(sorted(said - {0.0}), np.float64)
    if len(spacing) == 0 and profile.material.height_mm is not None:
        spacing = np.array([profile.material.height_mm])
    return bead_height_mm(profile.material, spacing)


def _shift(moves: list[Move]) -> tuple[float, float] | None:
    """Where the program says that it has put the sheet, if it does."""
    text = read_head(moves).get("shift_mm")
    if text is None:
        return None
    try:
        x, y = (float(number) for number in text.split())
    except ValueError:
        raise ParseError(f"its head: shift_mm must be two numbers, not '{text}'") from None
    return x, y
