"""From a machine to what a sequence is optimised for."""

import math
from typing import cast, get_args

import numpy as np
from numpy.typing import NDArray

from gcode.estimate import START_DELAY_S
from profiles import Profile
from slicer.sequence.problem import Objective, ObjectiveName


def objective_name(text: str) -> ObjectiveName:
    """An option's text as the name of an objective."""
    for name in get_args(ObjectiveName):
        if name == text:
            return cast(ObjectiveName, name)
    raise ValueError(f"there is no objective '{text}'")


def join_mm(profile: Profile, spacing_mm: NDArray[np.float64]) -> float:
    """The longest hop that is extruded in a sheet with these spacings, in mm; 0 for none."""
    return profile.motion.longest_join_mm(spacing_mm.tolist())


def objective_of(profile: Profile, name: ObjectiveName, join_mm: float = 0.0) -> Objective:
    """The objective of a name under the limits of a machine; hops of up to ``join_mm`` are extruded.

    Retraction and priming go from stop to stop within their speed and acceleration; a valve takes its two
    dwells, around every travel that there is, and the time for which Marlin holds back a move that comes
    alone after a dwell. Every travel counts from stop to stop, although the machine rounds short ones.
    """
    motion, machine = profile.motion, profile.machine
    along = 0 if machine.plane == "XZ" else 1
    fixed_from = motion.retract_from_mm
    if profile.material.feed == "pneumatic":
        fixed, fixed_from = motion.valve_open_s + motion.valve_close_s, 0.0
        if machine.planner == "marlin" and motion.valve_close_s > 0:
            fixed += START_DELAY_S
    else:
        fixed = _retraction_s(profile)
    return Objective(
        name=name,
        clearance_mm=motion.clearance_mm,
        speed_mm_s=(motion.travel_speed_mm_s, machine.max_speed_mm_s[along], machine.max_speed_mm_s[2]),
        acceleration_mm_s2=(
            motion.travel_acceleration_mm_s2,
            machine.max_acceleration_mm_s2[along],
            machine.max_acceleration_mm_s2[2],
        ),
        fixed_s=fixed,
        # The last decimal: what begins where the other ended is no travel.
        fixed_from_mm=float(np.maximum(fixed_from, 1e-6)),
        join_mm=join_mm,
        join_speed_mm_s=motion.print_speed_mm_s,
        join_downhill_deg=profile.nozzle.downhill_deg,
    )


def _retraction_s(profile: Profile) -> float:
    """Seconds of drawing back before a travel and of priming after it."""
    motion, machine = profile.motion, profile.machine
    if motion.retract_mm <= 0:
        return 0.0
    speed = min(motion.retract_speed_mm_s, machine.max_speed_mm_s[3])
    acceleration = min(motion.retract_acceleration_mm_s2, machine.max_acceleration_mm_s2[3])
    # What the firmware draws back by itself, it primes by itself, without anything extra.
    extra = 0.0 if motion.firmware_retraction else motion.retract_extra_mm
    return sum(
        _stop_to_stop_s(length, speed, acceleration)
        for length in (motion.retract_mm, motion.retract_mm + extra)
    )


def _stop_to_stop_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Seconds of a move that begins and ends standing: a trapezoid of speed, or a triangle if it is short."""
    if length_mm * acceleration_mm_s2 >= speed_mm_s**2:
        return length_mm / speed_mm_s + speed_mm_s / acceleration_mm_s2
    return 2.0 * math.sqrt(length_mm / acceleration_mm_s2)
