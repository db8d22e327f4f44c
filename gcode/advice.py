"""Settings that can be carried out and yet make no sense together: a sentence for each, with both numbers."""

import numpy as np
from numpy.typing import NDArray

from dialect.numbers import plain
from gcode.bead import feed_area_mm2
from gcode.moves import Kind
from gcode.program import Program
from profiles import Profile
from profiles.sections import Material

FILLED = (0.5, 1.25)
"""How much of the room that spacing and width leave them beads may fill."""
WIDTHS = (0.5, 10.0)
"""How many spacings wide a line may be."""
FEED_STEP_MM = {"filament": 0.0025, "syringe": 0.000125}
"""Smallest step of a feed: 400 steps a mm; a 2 mm screw behind a 5:1 gear at 3200 steps a turn."""
SLOWEST_MM_S = 0.1 / 60
"""The last decimal of F."""


def advice(
    program: Program, profile: Profile, spacing_mm: NDArray[np.float64], length_mm: NDArray[np.float64]
) -> list[str]:
    """What a user should think about before printing.

    Args:
        program: what was made of the toolpaths.
        spacing_mm, length_mm: float64 (n,), of each toolpath; both in the same order.
    """
    return [
        *_filled(program, profile.material, spacing_mm, length_mm),
        *_width(profile.material, spacing_mm),
        *_short(profile.material, length_mm),
        *_steps(program, profile),
        *_slow(program),
    ]


def _filled(
    program: Program, material: Material, spacing_mm: NDArray[np.float64], length_mm: NDArray[np.float64]
) -> list[str]:
    room = float((length_mm * spacing_mm).sum()) * material.width_mm
    if FILLED[0] <= program.material_ul / room <= FILLED[1]:
        return []
    return [
        f"the beads fill {program.material_ul / room:.0%} of the room that spacing and width leave them, "
        f"{program.material_ul:.4g} of {room:.4g} µL. "
        "See [material] bead_shape, width_mm, height_mm and flow."
    ]


def _width(material: Material, spacing_mm: NDArray[np.float64]) -> list[str]:
    ratio = material.width_mm / spacing_mm
    far = (ratio < WIDTHS[0]) | (ratio > WIDTHS[1])
    if not far.any():
        return []
    worst = int(np.argmax(np.abs(np.log(ratio))))
    return [
        f"{_of(far)} are {plain(material.width_mm)} mm wide ([material] width_mm) at a spacing of "
        f"{spacing_mm[worst]:.4g} mm, {ratio[worst]:.3g} times it; lines are {WIDTHS[0]:g} to {WIDTHS[1]:g} "
        "times as wide as they lie apart."
    ]


def _short(material: Material, length_mm: NDArray[np.float64]) -> list[str]:
    short = length_mm < material.width_mm
    if not short.any():
        return []
    return [
        f"{_of(short)} are shorter, the shortest {length_mm.min():.3f} mm, than a line is wide, "
        f"{plain(material.width_mm)} mm ([material] width_mm): they come out as dots. "
        "min_length_mm in the grid leaves them out."
    ]


def _steps(program: Program, profile: Profile) -> list[str]:
    material = profile.material
    if feed_area_mm2(material) is None:
        return []
    step = material.feed_step_mm or FEED_STEP_MM[material.feed]
    said = f"the smallest step of the feed, {plain(step)} mm ([material] feed_step_mm)"
    finer = "a narrower syringe or a finer drive" if material.feed == "syringe" else "a finer drive"
    feed = np.array([move.e_mm for move in program.moves if move.kind == Kind.EXTRUDE and move.toolpath >= 0])
    found = []
    if (feed < step).any():
        found.append(
            f"{_of(feed < step)} take less, the least {feed.min():.3g} mm, than {said}: their material comes "
            f"with a later one. Use {finer}, or print wider or longer lines."
        )
    if 0 < profile.motion.retract_mm < step and not profile.motion.firmware_retraction:
        found.append(f"[motion] retract_mm, {plain(profile.motion.retract_mm)} mm, is less than {said}.")
    return found


def _slow(program: Program) -> list[str]:
    speed = np.array(
        [m.speed_mm_s for m in program.moves if m.kind in (Kind.EXTRUDE, Kind.TRAVEL, Kind.FEED)]
    )
    slow = speed < SLOWEST_MM_S
    if not slow.any():
        return []
    return [
        f"{_of(slow, 'moves')} are slower, the slowest {speed.min():.2g} mm/s, than F can say, "
        f"{SLOWEST_MM_S:.2g} mm/s, at which they will be made: an axis exceeds its limit."
    ]


def _of(which: NDArray[np.bool_], what: str = "toolpaths") -> str:
    return f"{int(which.sum())} of {len(which)} {what}"
