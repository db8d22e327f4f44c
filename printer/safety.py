"""How the nozzle leaves a standing print."""

import re
from collections.abc import Sequence
from dataclasses import replace

from dialect.numbers import FEED_DECIMALS, POSITION_DECIMALS, plain
from printer.protocol import clean
from printer.settings import Safety

EXTRUSION = re.compile(r"\s*G0*[01]\b.*?E\s*([-+]?(?:\d+\.?\d*|\.\d+))")


def number(value: float, decimals: int = POSITION_DECIMALS) -> str:
    """A coordinate or a speed in its shortest form."""
    return plain(value, decimals)


def feed_of(mm: float) -> str:
    """The E word for ``mm`` of material; "" if its digits say nothing. Each word that this package sends has
    these digits, and `extrusion` reads them, so that what is primed is what was drawn back."""
    text = number(mm, FEED_DECIMALS)
    return "" if text == "0" else f"E{text}"


def feed(speed_mm_s: float) -> str:
    """The F word for a speed in mm/s: Marlin wants mm/min."""
    return f"F{number(speed_mm_s * 60)}"


def extrusion(line: str) -> float:
    """The material in mm that a line of relative extrusion feeds; 0 if it is no such move."""
    match = EXTRUSION.match(clean(line))
    return float(match[1]) if match else 0.0


def lift(safety: Safety) -> list[str]:
    """Away from the print along the build direction, wherever the nozzle is; ends in absolute mode."""
    return ["G91", f"G0 {safety.build_axis}{number(safety.lift_mm)} {feed(safety.lift_speed_mm_s)}", "G90"]


def closing(close_lines: Sequence[str], drawn_back_mm: float = 0.0) -> list[str]:
    """The lines that stop the material where ``drawn_back_mm`` of it are drawn back already, by the program
    or by an earlier stop: only what is missing is drawn back, for too much of it brings air into a nozzle."""
    lines = []
    for line in map(clean, close_lines):
        drawn_mm = -extrusion(line)
        if drawn_mm > 0:
            already = min(drawn_mm, drawn_back_mm)
            drawn_back_mm -= already
            if already:
                word = feed_of(already - drawn_mm)
                line = re.sub(r"E\s*[-+.\d]+", word, line, count=1) if word else ""
        if line:
            lines.append(line)
    return lines


def left(safety: Safety, drawn_back_mm: float | None) -> list[str]:
    """What a controlled stop did, where it drew back so much in all; None if that is unknown."""
    if drawn_back_mm is None:
        return leave(safety)
    lines = [line for line in safety.close_lines if not extrusion(line)]
    word = feed_of(-drawn_back_mm)
    drawn = [f"G1 {word} {feed(safety.retract_speed_mm_s)}"] if word else []
    return leave(replace(safety, close_lines=(*drawn, *lines)))


def leave(safety: Safety, drawn_back_mm: float = 0.0) -> list[str]:
    """The lines of a controlled stop, after the queue has ended; ``drawn_back_mm`` as for `closing`.

    Lengths are in mm here, whatever the program's are in. Material stops first, for a nozzle that is lifted
    while it flows draws a thread; heaters come last.
    """
    lines = ["G21", "M83", *closing(safety.close_lines, drawn_back_mm), *lift(safety), *safety.stop_lines]
    return [command for line in lines if (command := clean(line))]
