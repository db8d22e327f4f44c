"""How long a program takes on a machine: what its motion planner makes of the moves, with the dwells."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcode.limits import Dynamics, in_plane
from gcode.lookahead import Queue, klipper_times, marlin_times, reprap_times
from gcode.moves import Kind, Move
from profiles import Profile

FIRST_SPEED_MM_S = 25.0
"""Speed before any F, as Marlin begins."""
FEW_MOVES, START_DELAY_S = 3, 0.1
"""Marlin holds fewer moves than these back for so long, in case more come (BLOCK_DELAY_FOR_1ST_MOVE)."""
STOPS = frozenset(
    (
        "G4",
        "G28",
        "$H",
        "G29",
        "G92",
        "M0",
        "M1",
        "M3",
        "M4",
        "M5",
        "M7",
        "M8",
        "M9",
        "M18",
        "M84",
        "M226",
        "M400",
        "M600",
    )
)
"""Commands that wait until all moves have ended."""


class Times(NamedTuple):
    """Where the time of a print goes, in s. Homing and heating are in none of it.

    Attributes:
        printing_s: of the toolpaths.
        travel_s: between them, retraction and valves included.
        other_s: the prime line, the ways before, after and to the parking place, dwells of the blocks.
    """

    printing_s: float
    travel_s: float
    other_s: float

    @property
    def total_s(self) -> float:
        """All of it."""
        return self.printing_s + self.travel_s + self.other_s


class _Step(NamedTuple):
    """A move that the planner gets: which, by how much, how fast, under which limits, from rest or not."""

    move: int
    dx: float
    dy: float
    depth: float
    e: float
    speed: float
    limits: int
    begins: bool


def seconds_of(moves: Sequence[Move], profile: Profile) -> NDArray[np.float64]:
    """Estimated seconds of each move (n,), as they stand or as they were read from text.

    Speeds and accelerations are those of the profile and of M201, M203, M204 and M205; corners, as the
    profile's planner passes them. Marlin and Klipper look ahead over some moves, this over all up to the
    next stop. Homing and heating count as 0, and so do commands; an axis of which the place is not
    known stands where homing leaves it, at the low corner of the build volume.
    """
    seconds = np.zeros(len(moves))
    steps, limits = _steps(moves, profile, seconds)
    if not steps:
        return seconds
    table = np.array(steps, np.float64)
    queue = _queue(table, limits)
    if profile.machine.planner == "klipper":
        machine = profile.machine
        times = klipper_times(queue, machine.square_corner_velocity_mm_s, machine.minimum_cruise_ratio)
    elif profile.machine.planner == "reprapfirmware":
        times = reprap_times(queue, np.array(in_plane(profile.machine.jerk_mm_s, profile.machine.plane)))
    elif profile.machine.planner == "grbl":
        deviation = np.full(len(table), profile.machine.junction_deviation_mm)
        times = marlin_times(queue, deviation, arcs=False)
    else:
        which = table[:, 6].astype(np.intp)
        deviation = np.array([known.junction_deviation_mm for known in limits])[which]
        times = marlin_times(queue, deviation)
        first = np.flatnonzero(queue.begins)
        few = np.diff(np.append(first, len(times))) < FEW_MOVES
        times[first[few]] += START_DELAY_S
    seconds[table[:, 0].astype(np.intp)] += times
    return seconds


def times_of(moves: Sequence[Move], seconds: NDArray[np.float64]) -> Times:
    """Where the time goes of a program as ``program.build`` lays it out, whose moves know their toolpath.

    Args:
        seconds: (n,), of each move.
    """
    kind = np.array([move.kind for move in moves], np.intp)
    toolpath = np.array([move.toolpath for move in moves], np.intp)
    printing = (kind == Kind.EXTRUDE) & (toolpath >= 0)
    first = np.flatnonzero(printing)
    between = (toolpath >= 0) & ~printing
    if len(first):
        between[: first[0]] = False  # the way to the first toolpath is none between toolpaths
    other = ~printing & ~between
    return Times(*(float(seconds[part].sum()) for part in (printing, between, other)))


def _steps(
    moves: Iterable[Move], profile: Profile, seconds: NDArray[np.float64]
) -> tuple[list[_Step], list[Dynamics]]:
    """What the planner gets, and the limits that hold; dwells go straight into ``seconds``."""
    machine, motion = profile.machine, profile.motion
    corner = machine.build_corner_mm
    top = corner[2] + machine.build_volume_mm[2] if profile.printer.build_axis_homes_up else corner[2]
    home = (corner[0], top, corner[1]) if machine.plane == "XZ" else (corner[1], top, corner[0])
    x, y, depth = home
    steps: list[_Step] = []
    limits = [Dynamics.of(profile)]
    begins = True
    for k, move in enumerate(moves):
        kind = move.kind
        if kind in (Kind.TRAVEL, Kind.EXTRUDE):
            to_x = x if math.isnan(move.x_mm) else move.x_mm
            to_y = y if math.isnan(move.y_mm) else move.y_mm
            to_depth = depth if math.isnan(move.depth_mm) else move.depth_mm
            change = (to_x - x, to_y - y, to_depth - depth, move.e_mm)
            x, y, depth = to_x, to_y, to_depth
            speed = move.speed_mm_s
        elif kind == Kind.FEED:
            change, speed = (0.0, 0.0, 0.0, move.e_mm), move.speed_mm_s
        elif kind in (Kind.FIRMWARE_RETRACT, Kind.FIRMWARE_PRIME):
            e = -motion.retract_mm if kind == Kind.FIRMWARE_RETRACT else motion.retract_mm
            change, speed = (0.0, 0.0, 0.0, e), motion.retract_speed_mm_s
        else:
            if kind == Kind.DWELL:
                seconds[k] = math.ceil(move.seconds * 1000) / 1000
                begins = True
            elif kind == Kind.COMMAND and move.text.strip():
                code = move.text.upper().split(maxsplit=1)[0]
                begins = begins or code in STOPS
                if code in ("G28", "$H"):
                    # Axes that it names have no known place afterwards; where they stand is known here.
                    x, y, depth = (
                        at if math.isnan(told) else told
                        for told, at in zip((move.x_mm, move.y_mm, move.depth_mm), home, strict=True)
                    )
                if (changed := limits[-1].after(move.text)) is not limits[-1]:
                    limits.append(changed)
            continue
        if any(change):
            speed = speed if speed > 0 else FIRST_SPEED_MM_S
            steps.append(_Step(k, *change, speed, len(limits) - 1, begins))
            begins = False
    return steps, limits


def _queue(table: NDArray[np.float64], limits: Sequence[Dynamics]) -> Queue:
    """Lengths, directions, and what the axes allow, for rows as of ``_Step``."""
    change, which = table[:, 1:5], table[:, 6].astype(np.intp)
    path = np.sqrt((change[:, :3] ** 2).sum(axis=1))
    moves_nozzle = path > 0
    length = np.where(moves_nozzle, path, np.abs(change[:, 3]))
    feeds = change[:, 3] != 0
    share = np.abs(change) / length[:, None]
    share_or_1 = np.where(share > 0, share, 1.0)
    speeds = np.array([known.speed for known in limits])[which]
    axis_acceleration = np.array([known.acceleration for known in limits])[which]
    along = np.array([(known.travelling, known.printing, known.retracting) for known in limits])
    kind = np.where(moves_nozzle, feeds.astype(np.intp), 2)
    speed = np.minimum(table[:, 5], np.where(share > 0, speeds / share_or_1, np.inf).min(axis=1))
    allowed = np.where(share > 0, axis_acceleration / share_or_1, np.inf).min(axis=1)
    whole = np.sqrt((change**2).sum(axis=1, keepdims=True))  # with the feed
    return Queue(
        unit=change / whole,
        length=length,
        speed=speed,
        acceleration=np.minimum(along[which, kind], allowed),
        asked=along[which, kind],
        axis_acceleration=axis_acceleration,
        begins=table[:, 7].astype(np.bool_),
        moves_nozzle=moves_nozzle,
        fed=np.where(moves_nozzle, change[:, 3] / length, 0.0),
    )


def length_mm(before: Move | None, move: Move) -> float:
    """Length of a move, along the axes whose position before it is known."""
    if before is None:
        return 0.0
    steps = (move.x_mm - before.x_mm, move.y_mm - before.y_mm, move.depth_mm - before.depth_mm)
    return math.hypot(*(step for step in steps if not math.isnan(step)))
