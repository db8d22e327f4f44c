"""The ``Move`` record: one thing that the machine does, in the plane of the sheet."""

from enum import IntEnum
from typing import NamedTuple


class Kind(IntEnum):
    """What a move is."""

    TRAVEL = 0  # the nozzle moves and nothing comes out
    EXTRUDE = 1  # the nozzle lays material
    FEED = 2  # only the feed moves: it draws back or primes
    FIRMWARE_RETRACT = 3
    FIRMWARE_PRIME = 4
    DWELL = 5
    COMMAND = 6  # a line of G-code as it stands in ``text``
    COMMENT = 7  # likewise, without the semicolon


class Move(NamedTuple):
    """One thing that the machine does.

    Positions are those after the move. ``x_mm`` runs along the sheet and ``y_mm`` upwards, both in
    machine coordinates; ``depth_mm`` is the axis across the sheet. What has not been set yet, as after
    homing, is NaN.

    Attributes:
        kind: what it is.
        e_mm: how far the feed advances; negative draws back.
        speed_mm_s: along the path, or of the feed where only that moves.
        seconds: of a dwell.
        text: of a command or comment.
        line: line number in the program that it was read from, from 1; 0 where it was not read.
        toolpath: its place in the sequence, -1 where it belongs to none.
        rapid: whether it was written as G0.
    """

    kind: Kind
    x_mm: float
    y_mm: float
    depth_mm: float
    e_mm: float = 0.0
    speed_mm_s: float = 0.0
    seconds: float = 0.0
    text: str = ""
    line: int = 0
    toolpath: int = -1
    rapid: bool = False
