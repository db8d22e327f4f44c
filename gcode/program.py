"""A plan and a profile become a program: every move of the machine, in the plane of the sheet."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dialect.commands import code_of
from dialect.flavor import Flavor
from dialect.numbers import plain
from dialect.reader import clean
from gcode import volume
from gcode.bead import bead_area_mm2, bead_height_mm, feed_per_mm
from gcode.estimate import Times, times_of
from gcode.limits import AxisLimits
from gcode.moves import Kind, Move
from gcode.written import seconds_as_read
from profiles import Profile, render

if TYPE_CHECKING:  # it imports what compiles the routing
    from slicer.nozzle import NozzleBody
    from slicer.travel import Plan

STILL_MM = 1e-6
"""A travel that is shorter is none: the next toolpath begins where the last one ended."""


@dataclass(frozen=True, eq=False)
class Program:
    """A complete print.

    Attributes:
        moves: everything between the start block and the end block, both included.
        height_mm: float64 (n,), bead height of each toolpath in the order of printing.
        shift_mm: what is added to a point of the sheet to get machine coordinates in the plane.
        feed_mm: feed that ends up in the print.
        primed_mm: feed of the line that fills the nozzle.
        material_ul: volume of the print in microlitres.
        move_seconds: float64, the estimated seconds of each move, see ``seconds_as_read``.
        times: where the estimated duration goes.
        profile: the machine that it is for.
    """

    moves: list[Move]
    height_mm: NDArray[np.float64]
    shift_mm: tuple[float, float]
    feed_mm: float
    primed_mm: float
    material_ul: float
    move_seconds: NDArray[np.float64]
    times: Times
    profile: Profile

    @property
    def seconds(self) -> float:
        """Estimated duration, homing and heating apart."""
        return self.times.total_s

    def _repr_html_(self) -> str:
        """What a notebook shows of it: the page that plays it."""
        from gcode.player import framed, track_of_program

        return framed(track_of_program(self, self.profile, "program", {}))


def build(
    plan: "Plan",
    profile: Profile,
    spacing_mm: NDArray[np.float64],
    tile: NDArray[np.int32],
    body: "NozzleBody | None" = None,
) -> Program:
    """Lay out the moves of a plan: feed along the path in the plane, retraction or valve around travels.

    Args:
        plan: the sequence with its routes.
        spacing_mm: float64 (n,), spacing of each toolpath in the order of printing: the bead's height,
            unless the profile says another.
        tile: int32 (n, 2), (col, row) of each toolpath in the order of printing, for messages.
        body: the nozzle under which the plan was made; None for a point.

    Raises:
        BuildVolumeError: a position is outside the machine.
    """
    height = bead_height_mm(profile.material, spacing_mm)
    volume.check_sheet(plan.toolpaths, height, profile, tile, plan.order, body)
    volume.check_travels(plan, height, profile, tile)
    return lay_out(plan, profile, spacing_mm, body)


def lay_out(
    plan: "Plan", profile: Profile, spacing_mm: NDArray[np.float64], body: "NozzleBody | None" = None
) -> Program:
    """The same without asking whether the machine can reach it: to compare plans by their times."""
    material = profile.material
    height = bead_height_mm(material, spacing_mm)
    shift = volume.shift_mm(plan.toolpaths, height, profile)
    rate = feed_per_mm(material, height)
    primed = profile.motion.prime_mm * float(rate[0]) if len(rate) else 0.0
    length = np.hypot(*(plan.toolpaths[:, 1] - plan.toolpaths[:, 0]).T)
    joins = _join_mm(plan)
    moves = list(_Writer(profile, shift, body).moves(plan, rate * length, rate * joins, height, primed))
    seconds = seconds_as_read(moves, profile)
    return Program(
        moves=moves,
        height_mm=height,
        shift_mm=shift,
        feed_mm=float((rate * (length + joins)).sum()),
        primed_mm=primed,
        material_ul=float((bead_area_mm2(material, height) * (length + joins)).sum()) * material.flow,
        move_seconds=seconds,
        times=times_of(moves, seconds),
        profile=profile,
    )


def _join_mm(plan: "Plan") -> NDArray[np.float64]:
    """float64 (n,), the length of the hop to each toolpath where it is extruded, else 0."""
    joins = np.zeros(len(plan.toolpaths))
    if len(joins):
        joins[1:] = np.hypot(*(plan.toolpaths[1:, 0] - plan.toolpaths[:-1, 1]).T)
    return np.where(plan.joined, joins, 0.0)


def _when_due(lines: list[str], flavor: Flavor) -> list[str]:
    """The lines that turn a valve, behind a wait for the moves before them where one is needed."""
    codes = [code_of(clean(line, flavor)) for line in lines]
    immediate = next((k for k, code in enumerate(codes) if code in flavor.immediate_outputs), None)
    if immediate is None or set(codes[:immediate]) & flavor.empties_queue:
        return lines
    return [flavor.wait, *lines]


class _Writer:
    """Keeps where the nozzle is and whether material flows, and yields moves."""

    def __init__(self, profile: Profile, shift: tuple[float, float], body: "NozzleBody | None") -> None:
        self.profile = profile
        self.body = body
        self.shift = shift
        self.depth = profile.machine.fixed_mm
        self.limits = AxisLimits.of(profile)
        self.top = profile.machine.build_corner_mm[2] + profile.machine.build_volume_mm[2]
        self.open_lines = _when_due(render(profile.gcode.valve_open, profile.values), profile.flavor)
        self.close_lines = _when_due(render(profile.gcode.valve_close, profile.values), profile.flavor)
        self.x = self.y = math.nan
        self.toolpath = -1
        self.flowing = profile.material.feed != "pneumatic"  # a loaded feed is ready; a valve starts closed

    def moves(
        self,
        plan: "Plan",
        feed: NDArray[np.float64],
        join_feed: NDArray[np.float64],
        height: NDArray[np.float64],
        primed: float,
    ) -> Iterator[Move]:
        profile = self.profile
        yield self._comment("TYPE:Custom")
        yield from self._commands(render(profile.gcode.start, profile.values))
        yield from self._commands(profile.settings_lines)
        if len(plan.toolpaths):
            if profile.motion.prime_mm:
                where = volume.prime_line(plan.toolpaths, height, profile, self.shift, self.body)
                yield from self._prime(*where, float(height[0]), primed)
            yield from self._print(plan, feed, join_feed, height)
        yield self._comment("TYPE:Custom")
        yield from self._commands(render(profile.gcode.end, profile.values))

    def _print(
        self,
        plan: "Plan",
        feed: NDArray[np.float64],
        join_feed: NDArray[np.float64],
        height: NDArray[np.float64],
    ) -> Iterator[Move]:
        toolpaths = (plan.toolpaths + np.array(self.shift)).tolist()
        via = (plan.via + np.array(self.shift)).tolist()
        via_start = plan.via_start.tolist()
        heights, feeds, join_feeds = height.tolist(), feed.tolist(), join_feed.tolist()
        highest = float(plan.toolpaths[:, :, 1].max()) + self.shift[1]
        yield from self._arrive(*toolpaths[0][0])
        bead_height = math.nan
        for k, (start, end) in enumerate(toolpaths):
            self.toolpath = k
            yield self._comment(f"TOOLPATH {k}")
            if k and not plan.joined[k]:
                yield from self._travel([*via[via_start[k] : via_start[k + 1]], start])
            if k == 0:
                yield self._comment("TYPE:Internal infill")
                yield self._comment(f"WIDTH:{plain(self.profile.material.width_mm)}")
            if heights[k] != bead_height:
                bead_height = heights[k]
                yield self._comment(f"HEIGHT:{plain(bead_height)}")
            if plan.joined[k]:  # a hop is as high as the toolpath that it leads to
                yield from self._join(start, join_feeds[k])
            yield from self._open()
            yield self._to(end[0], end[1], self.profile.motion.print_speed_mm_s, feeds[k])
        self.toolpath = -1
        yield from self._close(away=True)
        # Straight up no body comes nearer to the print, and above its highest line it is clear of all of it.
        yield self._to(self.x, min(self.top, highest + self.profile.motion.approach_mm))
        if self.profile.motion.park_mm is not None:
            yield self._to(self.profile.motion.park_mm, self.y)

    def _prime(self, start: float, end: float, height: float, feed: float) -> Iterator[Move]:
        """Fill the nozzle along a line on the bed, and leave it upwards."""
        on_bed = self.profile.machine.bed_z_mm + height / 2
        yield self._comment("TYPE:Skirt/Brim")
        yield self._comment(f"WIDTH:{plain(self.profile.material.width_mm)}")
        yield self._comment(f"HEIGHT:{plain(height)}")
        yield from self._arrive(start, on_bed)
        yield from self._open()
        yield self._to(end, on_bed, self.profile.motion.print_speed_mm_s, feed)
        yield from self._close(away=True)
        yield self._to(end, min(self.top, on_bed + self.profile.motion.approach_mm))

    def _arrive(self, x: float, y: float) -> Iterator[Move]:
        """From wherever the start block left the nozzle: up, over, and down to the first toolpath."""
        above = min(self.top, y + self.profile.motion.approach_mm)
        speed = self.profile.motion.travel_speed_mm_s
        if not math.isnan(self.x):  # from the line that filled the nozzle
            yield self._to(self.x, max(above, self.y))
            yield self._to(x, self.y)
            yield self._to(x, y)
            return
        yield Move(Kind.TRAVEL, math.nan, above, math.nan, speed_mm_s=self.limits.slowed(speed, 0, 1))
        self.x, self.y = x, above
        # The way over is sideways in two axes of which neither start is known: the slower one limits.
        sideways = min(speed, self.limits.x_mm_s, self.limits.depth_mm_s)
        yield Move(Kind.TRAVEL, x, above, self.depth, speed_mm_s=sideways)
        yield self._to(x, y)

    def _travel(self, points: list[list[float]]) -> Iterator[Move]:
        length, x, y = 0.0, self.x, self.y
        for px, py in points:
            length += math.hypot(px - x, py - y)
            x, y = px, py
        if length <= STILL_MM:
            return
        yield from self._close(away=length >= self.profile.motion.retract_from_mm)
        for x, y in points:
            yield self._to(x, y)

    def _join(self, point: list[float], feed: float) -> Iterator[Move]:
        """Let the bead go on to where the next toolpath begins."""
        yield from self._open()
        yield self._comment("JOIN")
        yield self._to(point[0], point[1], self.profile.motion.print_speed_mm_s, feed)

    def _open(self) -> Iterator[Move]:
        """Make material flow, unless it does."""
        if self.flowing:
            return
        self.flowing = True
        motion = self.profile.motion
        if self.profile.material.feed == "pneumatic":
            yield from self._commands(self.open_lines)
            yield from self._dwell(motion.valve_open_s)
        elif motion.firmware_retraction:
            yield self._here(Kind.FIRMWARE_PRIME)
        else:
            yield self._feed(motion.retract_mm + motion.retract_extra_mm)

    def _close(self, *, away: bool) -> Iterator[Move]:
        """Stop the flow: a valve for any travel at all, a feed only for one that is worth it."""
        motion = self.profile.motion
        if self.profile.material.feed == "pneumatic":
            yield from self._commands(self.close_lines)
            yield from self._dwell(motion.valve_close_s)
        elif away and motion.firmware_retraction:
            yield self._here(Kind.FIRMWARE_RETRACT)
        elif away and motion.retract_mm > 0:
            yield self._feed(-motion.retract_mm)
        else:
            return
        self.flowing = False

    def _to(self, x: float, y: float, speed: float | None = None, feed: float | None = None) -> Move:
        dx, dy = x - self.x, y - self.y
        self.x, self.y = x, y
        if feed is None:
            slow = self.limits.slowed(self.profile.motion.travel_speed_mm_s, dx, dy)
            return Move(Kind.TRAVEL, x, y, self.depth, speed_mm_s=slow, toolpath=self.toolpath)
        slow = self.limits.slowed(speed or 0.0, dx, dy, feed)
        return Move(Kind.EXTRUDE, x, y, self.depth, feed, slow, toolpath=self.toolpath)

    def _feed(self, e_mm: float) -> Move:
        speed = min(self.profile.motion.retract_speed_mm_s, self.limits.e_mm_s)
        return Move(Kind.FEED, self.x, self.y, self.depth, e_mm, speed, toolpath=self.toolpath)

    def _here(self, kind: Kind, text: str = "", seconds: float = 0.0) -> Move:
        depth = math.nan if math.isnan(self.x) else self.depth  # before it has arrived, none is known
        return Move(kind, self.x, self.y, depth, seconds=seconds, text=text, toolpath=self.toolpath)

    def _dwell(self, seconds: float) -> Iterator[Move]:
        if seconds > 0:
            yield self._here(Kind.DWELL, seconds=seconds)

    def _comment(self, text: str) -> Move:
        return self._here(Kind.COMMENT, text)

    def _commands(self, lines: list[str]) -> Iterator[Move]:
        for line in lines:
            yield self._here(Kind.COMMAND, line)
