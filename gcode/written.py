"""Moves become lines, the only place where axis letters and number formats exist, and what these take."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from dialect.flavor import Flavor
from dialect.numbers import feed, position, rate
from gcode.estimate import seconds_of
from gcode.moves import Kind, Move
from gcode.parse import parse
from profiles import Profile

E_STEP = 1e-5
"""The last decimal of E."""


def written(moves: Sequence[Move], profile: Profile) -> Iterator[tuple[int, str]]:
    """(which move, its line) of each move that is written; one that only rounding made is not.

    Positions have three decimals and E has five; what an axis already has is left out.
    """
    horizontal, across = ("X", "Y") if profile.machine.plane == "XZ" else ("Y", "X")
    letters = (across, horizontal, "Z")  # the axis across the sheet is named once, at the first move
    at = ["", "", ""]
    speed = ""
    axis = _FeedAxis(profile.flavor)
    for number, move in enumerate(moves):
        kind = move.kind
        if kind in (Kind.TRAVEL, Kind.EXTRUDE):
            words = []
            for k, value in enumerate((move.depth_mm, move.x_mm, move.y_mm)):
                if not math.isnan(value) and (text := position(value)) != at[k]:
                    at[k] = text
                    words.append(letters[k] + text)
            if not words:
                continue
            if kind == Kind.EXTRUDE and move.e_mm:
                words.append(axis.extruded(move.e_mm))
            if (text := rate(move.speed_mm_s)) != speed:
                speed = text
                words.append("F" + text)
            yield number, ("G0 " if kind == Kind.TRAVEL else "G1 ") + " ".join(words)
        elif kind == Kind.FEED:
            speed = rate(move.speed_mm_s)
            yield number, f"G1 {axis.fed(move.e_mm)} F{speed}"
        else:
            yield number, _plain(move, profile.flavor)


def seconds_as_read(moves: Sequence[Move], profile: Profile) -> NDArray[np.float64]:
    """Estimated seconds of each move (n,), as whoever reads their text finds them.

    So heads, tables and hosts say what a check of the finished program says: rounding, and moves in a start
    block of the user's own, are in it.
    """
    which: list[int] = []

    def lines() -> Iterator[str]:
        for number, line in written(moves, profile):
            which.append(number)
            yield line

    read = list(parse(lines(), plane=profile.machine.plane, name="the program", flavor=profile.flavor))
    owner = np.array(which, np.intp)[np.array([move.line for move in read], np.intp) - 1]
    seconds = np.zeros(len(moves))
    np.add.at(seconds, owner, seconds_of(read, profile))
    return seconds


class _FeedAxis:
    """The axis that pushes material, from where it is or from the start of the program."""

    def __init__(self, flavor: Flavor) -> None:
        self._letter, self._relative = flavor.feed_letter, flavor.relative_feed
        self._debt = 0.0  # feed that was due and lost to rounding
        self._at = 0  # in the last decimal of E

    def extruded(self, mm: float) -> str:
        """The word of a toolpath; what rounding takes is given to the next."""
        text = feed(max(mm + self._debt, E_STEP))  # what extrudes must not become a travel
        self._debt += mm - float(text)
        return self._word(text)

    def fed(self, mm: float) -> str:
        """The word of a movement of the feed alone."""
        return self._word(feed(mm))

    def _word(self, text: str) -> str:
        if self._relative:
            return self._letter + text
        self._at += round(float(text) / E_STEP)
        return self._letter + feed(self._at * E_STEP)


def _plain(move: Move, flavor: Flavor) -> str:
    match move.kind:
        case Kind.FIRMWARE_RETRACT:
            return "G10"
        case Kind.FIRMWARE_PRIME:
            return "G11"
        case Kind.DWELL:
            return flavor.dwell(move.seconds)
        case Kind.COMMENT:
            return ";" + move.text
        case _:
            return move.text
