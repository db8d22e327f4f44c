"""How the nozzle leaves a standing print."""

import re

from printer.protocol import clean
from printer.settings import Safety

EXTRUSION = re.compile(r"\s*G0*[01]\b.*?E\s*([-+]?(?:\d+\.?\d*|\.\d+))")


def number(value: float) -> str:
    """A number as G-code wants it: at most three decimals, and no exponent."""
    return f"{value:.3f}".rstrip("0").rstrip(".")


def feed(speed_mm_s: float) -> str:
    """The F word for a speed in mm/s: Marlin wants mm/min."""
    return f"F{number(speed_mm_s * 60)}"


def extrusion(line: str) -> float:
    """The material in mm that a line of relative extrusion feeds; 0 if it is no such move."""
    match = EXTRUSION.match(line.upper())
    return float(match[1]) if match else 0.0


def lift(safety: Safety) -> list[str]:
    """Away from the print along the build direction, wherever the nozzle is; ends in absolute mode."""
    return ["G91", f"G0 {safety.build_axis}{number(safety.lift_mm)} {feed(safety.lift_speed_mm_s)}", "G90"]


def leave(safety: Safety) -> list[str]:
    """The lines of a controlled stop, after the queue has ended.

    Material stops first, for a nozzle that is lifted while it flows draws a thread; heaters come last.
    """
    lines = ["M83", *safety.close_lines, *lift(safety), *safety.stop_lines]
    return [command for line in lines if (command := clean(line))]
