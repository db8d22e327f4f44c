"""How the nozzle comes back to a print that stands, and finds everything as the program left it there."""

import re

from dialect.commands import IMMEDIATE_OUTPUTS, code_of
from dialect.numbers import FEED_DECIMALS, fixed
from printer.protocol import clean
from printer.replay import Replay
from printer.safety import feed, feed_of, number
from printer.settings import Safety


def approach(
    state: Replay, target: dict[str, float], origins: dict[str, float], safety: Safety, prime_mm: float
) -> list[str]:
    """Across above the print, then down, then every mode as the program left it."""
    axis = safety.build_axis
    others = {a: v for a, v in target.items() if a != axis}
    return [
        *([state.tool] if state.tool else []),
        *to_place(others, origins, safety.travel_speed_mm_s),
        f"G0 {axis}{number(target[axis])} {feed(safety.lift_speed_mm_s)}",
        *fed(prime_mm, safety),
        *(["M400"] if _acts_at_once(state) else []),
        *dict.fromkeys(state.outputs.values()),  # one command may decide two of them
        *_recovered(state, safety),
        f"G92 E{fixed(state.position.get('E', 0.0), FEED_DECIMALS)}",
        f"G1 {feed(state.feed_mm_s)}",
        "G90" if state.absolute else "G91",
        "M82" if state.absolute_e else "M83",
        *(["G20"] if state.unit_mm != 1.0 else []),
    ]


def to_place(place: dict[str, float], origins: dict[str, float], speed_mm_s: float) -> list[str]:
    """Move to a place of the program; where the origin was moved, go there in the machine's coordinates, and
    give the place the program's name then."""
    if not place:
        return []
    there = " ".join(f"{a}{number(v + origins.get(a, 0.0))}" for a, v in place.items())
    names = " ".join(f"{a}{number(v)}" for a, v in place.items() if a in origins)
    return [f"G0 {there} {feed(speed_mm_s)}", *([f"G92 {names}"] if names else [])]


def fed(mm: float, safety: Safety) -> list[str]:
    """Material fed, or drawn back where ``mm`` is negative."""
    word = feed_of(mm)
    return ["M83", f"G1 {word} {feed(safety.retract_speed_mm_s)}"] if word else []


def _acts_at_once(state: Replay) -> bool:
    """Whether an output would change when its command is read, before the moves ahead of it have ended."""
    return any(code_of(command) in IMMEDIATE_OUTPUTS for command in state.outputs.values())


def _recovered(state: Replay, safety: Safety) -> list[str]:
    """What the close lines let the firmware draw back, where the program had not spoken of that so far."""
    drawn_back = any(re.match(r"G10(?!\d)", clean(line)) for line in safety.close_lines)
    spoken_of = any(place.startswith("retraction") for place in state.outputs)
    return ["G11"] if drawn_back and not spoken_of else []
