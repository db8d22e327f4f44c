"""A nozzle and how deep a print pushes into it, in words."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # numpy and pydantic, which `vslice --help` does not take
    from gcode.pressing import Pressing
    from profiles import Profile


def nozzle_name(profile: "Profile") -> str:
    """What a nozzle is called in messages: by its name, or by its width."""
    nozzle = profile.nozzle
    if nozzle.tip_width_mm <= 0:
        return "a point"
    if nozzle.name:
        return nozzle.name
    cone = f", cone {nozzle.cone_deg:g} degrees" if nozzle.cone_deg else ""
    return f"{nozzle.tip_width_mm:g} mm wide{cone}"


def pressed(pressing: "Pressing", profile: "Profile") -> str:
    """A nozzle, the deepest press of a program and what is allowed."""
    deepest = pressing.deepest
    allowed = f"allowed {pressing.allowed_mm:.2f}"
    if deepest is None:
        return f"{nozzle_name(profile)}: presses nothing; {allowed}"
    lines = f", line {deepest.line} against line {deepest.against}" if deepest.line else ""
    return f"{nozzle_name(profile)}: presses at most {deepest.depth_mm:.2f} mm{lines}; {allowed}"
