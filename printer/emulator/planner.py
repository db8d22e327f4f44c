"""The planner's queue of moves, and the path of those that were carried out."""

import hashlib
import struct
from array import array
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple


class Move(NamedTuple):
    """One straight move to absolute x, y, z in mm; ``e`` is the material fed during it, in mm."""

    x: float
    y: float
    z: float
    e: float


class Path:
    """What the nozzle did. With ``keep`` false only its digest, count and material are kept.

    ``material`` is what was fed in mm; what is drawn back and fed forward again counts once.
    """

    def __init__(self, keep: bool = True) -> None:
        self.keep = keep
        self.count, self.material = 0, 0.0
        self._drawn_back = 0.0
        self._numbers = array("d")
        self._digest = hashlib.sha256()

    def add(self, move: Move) -> None:
        """Append a move that was carried out."""
        self.count += 1
        self._drawn_back -= move.e
        if self._drawn_back < 0:
            self.material, self._drawn_back = self.material - self._drawn_back, 0.0
        self._digest.update(struct.pack("<4q", *(round(value * 1e5) for value in move)))
        if self.keep:
            self._numbers.extend(move)

    @property
    def moves(self) -> list[Move]:
        """All moves, if they were kept."""
        return [Move(*self._numbers[k : k + 4]) for k in range(0, len(self._numbers), 4)]

    @property
    def digest(self) -> str:
        """A fingerprint of all moves to 0.01 um, in order."""
        return self._digest.hexdigest()


@dataclass(slots=True)
class Block:
    """A planned move with the time at which it ends, in s."""

    move: Move
    end: float


class Planner:
    """At most ``size`` moves, one after the other; a move leaves when it has been carried out."""

    def __init__(self, path: Path, size: int = 16) -> None:
        self.path, self.size = path, size
        self.blocks: deque[Block] = deque()
        self.end = 0.0  # when the last block ends

    def advance(self, now: float) -> None:
        """Carry out what ends by ``now``."""
        while self.blocks and self.blocks[0].end <= now:
            self.path.add(self.blocks.popleft().move)

    def free_at(self, now: float) -> float:
        """When there is room for one more."""
        return self.blocks[-self.size].end if len(self.blocks) >= self.size else now

    def add(self, move: Move, duration_s: float, now: float) -> None:
        """Plan one more move."""
        self.end = max(self.end, now) + duration_s
        self.blocks.append(Block(move, self.end))

    def drop(self) -> None:
        """Forget the moves that were not carried out (a reset, a halt, M410)."""
        self.blocks.clear()
        self.end = 0.0
