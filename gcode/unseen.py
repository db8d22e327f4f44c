"""Travels of which an end is not known, as after homing: what they may run into."""

import math

from dialect.commands import code_of
from dialect.words import values_of
from gcode.moves import Kind, Move
from gcode.violation import Violation


def unseen_collisions(moves: list[Move], printing: list[bool], resolution_mm: float) -> list[Violation]:
    """Name what may run into the sheet from a place, or to a place, that the program does not tell.

    Where it is beside or over the sheet is unknown, so all that counts is the height: it must be above all
    that stands, or rise. Homing sideways is such a travel too. (Homing downwards is named by ``followed``,
    and what goes from one known place to another is compared with the outline of the print.)

    Args:
        printing: for each move, whether it lays material.
    """
    found = []
    top, before = -math.inf, None
    for move, prints in zip(moves, printing, strict=True):
        if before is not None and top > -math.inf:
            height = _lowest_sideways(before, move)
            if height is not None and height < top - resolution_mm:
                what = f"{move.text} moves" if move.kind == Kind.COMMAND else "moves"
                text = (
                    f"{what} at a height of {height:.3f} mm, from or to a place that is not known here; the "
                    f"print stands up to {top:.3f} mm"
                )
                found.append(Violation(move.line, "collision", text))
        if prints:
            ends = (move.y_mm, math.nan if before is None else before.y_mm)
            top = max([top, *(y for y in ends if not math.isnan(y))])
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE, Kind.COMMAND):
            before = move
    return found


def _lowest_sideways(before: Move, move: Move) -> float | None:
    """How low a move may come while it goes sideways or down, if one of its ends is not known; else None."""
    if move.kind == Kind.COMMAND:
        axes = values_of(move.text).keys() & set("XYZ")
        sideways = code_of(move.text) == "G28" and axes != {"Z"}
        return before.y_mm if sideways and not math.isnan(before.y_mm) else None
    ends = (before.x_mm, move.x_mm, before.y_mm, move.y_mm)
    if move.kind != Kind.TRAVEL or not any(map(math.isnan, ends)):
        return None
    if math.isnan(before.x_mm) and math.isnan(move.x_mm) and move.y_mm >= before.y_mm:
        return None  # straight up
    heights = [y for y in (before.y_mm, move.y_mm) if not math.isnan(y)]
    return min(heights) if heights else None
