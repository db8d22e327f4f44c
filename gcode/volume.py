"""Whether a print fits into its machine. All but the ways of the travels is known before any order is."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dialect.numbers import plain
from gcode.errors import BuildVolumeError
from profiles import Profile

if TYPE_CHECKING:  # it imports what compiles the routing
    from slicer.nozzle import NozzleBody
    from slicer.travel import Plan

TOLERANCE_MM = 1e-6
"""A position that is farther out by less is one that arithmetic has moved."""


def shift_mm(
    toolpaths: NDArray[np.float64], height: NDArray[np.float64], profile: Profile
) -> tuple[float, float]:
    """What is added to a point of the sheet to get the machine's, in its plane.

    The lowest bead lies on the bed: its axis is half its height above it.

    Args:
        toolpaths: float64 (n, 2, 2).
        height: float64 (n,), that of each bead.
    """
    machine = profile.machine
    if len(toolpaths) == 0:
        return machine.offset_mm, machine.bed_z_mm
    lowest = float((toolpaths[:, :, 1].min(axis=1) - height / 2).min())
    return machine.offset_mm, machine.bed_z_mm - lowest


def check_machine(profile: Profile) -> None:
    """Raise ``BuildVolumeError`` if the profile puts the sheet or the parking place outside the machine."""
    machine, park = profile.machine, profile.motion.park_mm
    across, along = ("Y", "X") if machine.plane == "XZ" else ("X", "Y")
    for what, value, axis in (
        ("[machine] fixed_mm", machine.fixed_mm, across),
        ("[motion] park_mm", park, along),
    ):
        low, high = _range(profile, "XYZ".index(axis))
        if value is not None and not low <= value <= high:
            raise BuildVolumeError(
                f"{what} {value:g} is outside the build volume: {axis} runs from {low:g} to {high:g} mm"
            )


def check_sheet(
    toolpaths: NDArray[np.float64],
    height: NDArray[np.float64],
    profile: Profile,
    tile: NDArray[np.int32],
    number: NDArray[np.integer] | None = None,
    body: "NozzleBody | None" = None,
) -> None:
    """Whether the machine reaches the toolpaths, the line that fills the nozzle and the parking place.

    Args:
        toolpaths: float64 (n, 2, 2), in any order.
        height: float64 (n,), that of each bead.
        tile: int32 (n, 2), (col, row) of each toolpath.
        number: of each toolpath, for the message; by default its place.
        body: the nozzle, beside which the line that fills it must not stand; None for a point.

    Raises:
        BuildVolumeError: it does not; the text says where, by how much, and what to do.
    """
    check_machine(profile)
    if len(toolpaths) == 0:
        return
    shift = shift_mm(toolpaths, height, profile)
    points = toolpaths.reshape(-1, 2) + shift
    found = _first_outside(points, profile)
    if found is not None:
        k, side = found
        s = k // 2
        named = s if number is None else int(number[s])
        raise BuildVolumeError(
            f"tile ({tile[s, 0]}, {tile[s, 1]}), toolpath {named}: {_outside(points, k, side, profile)}. "
            f"{_what_to_do(points[:, side], side, profile)}"
        )
    if profile.motion.prime_mm:
        prime_line(toolpaths, height, profile, shift, body)


def check_travels(
    plan: "Plan", height: NDArray[np.float64], profile: Profile, tile: NDArray[np.int32]
) -> None:
    """Raise ``BuildVolumeError`` for the first way over the print that leaves the machine.

    Args:
        height, tile: of each toolpath in the order of printing, as for ``check_sheet``.
    """
    points = plan.via + shift_mm(plan.toolpaths, height, profile)
    found = _first_outside(points, profile)
    if found is None:
        return
    k, side = found
    s = int(np.repeat(np.arange(len(plan.toolpaths)), np.diff(plan.via_start))[k])
    raise BuildVolumeError(
        f"tile ({tile[s, 0]}, {tile[s, 1]}), the travel to toolpath {plan.order[s]}: "
        f"{_outside(points, k, side, profile)}. Travels pass [motion] clearance_mm "
        f"{profile.motion.clearance_mm:g} above the print: make it less, or the sheet lower."
    )


def prime_line(
    toolpaths: NDArray[np.float64],
    height: NDArray[np.float64],
    profile: Profile,
    shift: tuple[float, float],
    body: "NozzleBody | None" = None,
) -> tuple[float, float]:
    """Where on the sheet's horizontal axis the line that fills the nozzle begins and ends, in mm.

    It runs towards the sheet, on its left where there is room, else on its right. Where its bead is thicker
    than the lowest of the sheet, it stands in the way of a body that prints that one: so much farther off it
    is drawn.

    Raises:
        BuildVolumeError: there is no room on either side.
    """
    motion = profile.motion
    low, high = _range(profile, "XYZ".index(profile.machine.plane[0]))
    gap = motion.prime_gap_mm
    if body is not None:
        lowest = float(toolpaths[:, :, 1].min()) + shift[1] - profile.machine.bed_z_mm
        gap = max(gap, body.beside(float(height.max()) / 2 - lowest))
    left = float(toolpaths[:, :, 0].min()) + shift[0] - gap
    right = float(toolpaths[:, :, 0].max()) + shift[0] + gap
    if left - motion.prime_mm >= low:
        return left - motion.prime_mm, left
    if right + motion.prime_mm <= high:
        return right + motion.prime_mm, right
    raise BuildVolumeError(
        f"[motion] prime_mm {motion.prime_mm:g}: beside the sheet there are {max(0.0, left - low):.3f} mm on "
        f"the left and {max(0.0, high - right):.3f} mm on the right. Make prime_mm shorter, or move the "
        "sheet ([machine] offset_mm)."
    )


def _range(profile: Profile, axis: int) -> tuple[float, float]:
    """What the machine reaches along an axis, of X, Y and Z."""
    low = profile.machine.build_corner_mm[axis]
    return low, low + profile.machine.build_volume_mm[axis]


def _axis(side: int, profile: Profile) -> int:
    """The machine's axis along which x (0) or y (1) of the sheet runs."""
    return "XYZ".index(profile.machine.plane[side])


def _first_outside(points: NDArray[np.float64], profile: Profile) -> tuple[int, int] | None:
    """The first point, in machine coordinates, that is not reached, and in which coordinate of the plane."""
    low, high = np.array([_range(profile, _axis(side, profile)) for side in (0, 1)]).T
    outside = np.argwhere((points < low - TOLERANCE_MM) | (points > high + TOLERANCE_MM))
    return None if len(outside) == 0 else (int(outside[0, 0]), int(outside[0, 1]))


def _outside(points: NDArray[np.float64], k: int, side: int, profile: Profile) -> str:
    axis = _axis(side, profile)
    low, high = _range(profile, axis)
    return f"{'XYZ'[axis]} {points[k, side]:.3f} mm is outside the build volume, {low:g} to {high:g} mm"


def _what_to_do(places: NDArray[np.float64], side: int, profile: Profile) -> str:
    """By how much the sheet is too large for the machine along an axis, or where it fits."""
    axis = _axis(side, profile)
    name, (low, high) = "XYZ"[axis], _range(profile, axis)
    first, last = float(places.min()), float(places.max())
    sheet = f"The toolpaths take {name} {first:.3f} to {last:.3f} mm"
    if last - first > high - low + TOLERANCE_MM:
        return (
            f"{sheet}, {last - first - (high - low):.3f} mm more than the machine has: make the sheet "
            "smaller (fewer tiles, or a smaller tile_mm)."
        )
    if side == 0:
        now = profile.machine.offset_mm
        # Rounded inwards, so that what is said fits.
        least = math.ceil((now + low - first - TOLERANCE_MM) * 1000) / 1000
        most = math.floor((now + high - last + TOLERANCE_MM) * 1000) / 1000
        where = f"from {plain(least)} to {plain(most)}" if least < most else plain(most)
        return (
            f"{sheet}: it fits with [machine] offset_mm {where}, which is {now:g} now, or with another "
            "origin_mm in the grid."
        )
    beyond = max(low - first, last - high)
    return (
        f"{sheet}, {beyond:.3f} mm beyond it, since the bed is at [machine] bed_z_mm "
        f"{profile.machine.bed_z_mm:g}: see whether that is so, or make the sheet lower "
        "(fewer rows, or a smaller tile_mm)."
    )
