"""From a machine to what a sequence is optimised for."""

from typing import cast, get_args

import numpy as np

from gcode.estimate import START_DELAY_S
from profiles import Profile
from slicer.sequence.problem import Objective, ObjectiveName


def objective_name(text: str) -> ObjectiveName:
    """An option's text as the name of an objective."""
    for name in get_args(ObjectiveName):
        if name == text:
            return cast(ObjectiveName, name)
    raise ValueError(f"there is no objective '{text}'")


def objective_of(profile: Profile, name: ObjectiveName) -> Objective:
    """The objective of a name under the limits of a machine.

    Retraction and priming take their lengths at their speed; a valve takes its two dwells, around every
    travel that there is, and the time for which Marlin holds back a move that comes alone after a dwell.
    Every travel counts from stop to stop, although the machine rounds short ones.
    """
    motion, machine = profile.motion, profile.machine
    along = 0 if machine.plane == "XZ" else 1
    fixed_from = motion.retract_from_mm
    if profile.material.feed == "pneumatic":
        fixed, fixed_from = motion.valve_open_s + motion.valve_close_s, 0.0
        if machine.planner == "marlin" and motion.valve_close_s > 0:
            fixed += START_DELAY_S
    elif motion.firmware_retraction or motion.retract_mm > 0:
        speed = min(motion.retract_speed_mm_s, machine.max_speed_mm_s[3])
        fixed = (2 * motion.retract_mm + motion.retract_extra_mm) / speed
    else:
        fixed = 0.0
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
    )
