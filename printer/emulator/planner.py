"""The planner's queue of moves, and the path of those that were carried out."""

import hashlib
import math
import struct
from array import array
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from printer.emulator.motion import Motion, Segment


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


class Block:
    """A planned move and the speed with which it begins, in mm/s."""

    __slots__ = ("entry", "move", "segment")

    def __init__(self, move: Move | None, segment: Segment) -> None:
        self.move, self.segment, self.entry = move, segment, 0.0


class Planner:
    """At most ``size`` moves, planned so that the last one ends at rest; one leaves when it has been carried
    out. The one under way is not planned again."""

    def __init__(self, path: Path, size: int = 16) -> None:
        self.path, self.size = path, size
        self.blocks: deque[Block] = deque()
        self._begun = False  # whether the first block is under way
        self._turn = 0.0  # when it ends, or may begin

    @property
    def end(self) -> float:
        """When all that is planned now has been carried out, in s."""
        end = self._turn  # added up as `advance` does, so that rounding is the same
        for k in range(self._begun, len(self.blocks)):
            end += self._duration(k, self.blocks[k])
        return end

    def _duration(self, k: int, block: Block) -> float:
        leave = self.blocks[k + 1].entry if k + 1 < len(self.blocks) else 0.0
        return block.segment.duration(block.entry, leave)

    def advance(self, now: float) -> None:
        """Carry out what ends by ``now``."""
        while self.blocks and self._turn <= now:
            if self._begun:
                move = self.blocks.popleft().move
                if move is not None:
                    self.path.add(move)
                self._begun = False
            if self.blocks:
                self._turn += self._duration(0, self.blocks[0])
                self._begun = True

    def free_at(self, now: float) -> float:
        """When there is room for one more."""
        self.advance(now)
        return self._turn if len(self.blocks) >= self.size else now

    def add(self, move: Move | None, delta: Sequence[float], speed_mm_s: float, motion: Motion) -> None:
        """Plan one more: by ``delta`` in x, y, z, e. Without a ``move`` it is one of the firmware's own."""
        block = Block(move, Segment(delta, speed_mm_s, motion))
        if self.blocks:
            block.segment.follow(self.blocks[-1].segment, motion)
        self.blocks.append(block)
        self._plan()

    def begin(self, now: float, delay_s: float) -> None:
        """After `add`: a queue that was empty waits for more for ``delay_s``, or until it holds three."""
        if len(self.blocks) == 1:
            self._turn, self._begun = now + delay_s, False
        elif len(self.blocks) == 3 and not self._begun:
            self._turn = min(self._turn, now)

    def _plan(self) -> None:
        """Slow down in time for what comes, then begin nothing faster than it can be reached."""
        blocks, first = self.blocks, 1 + self._begun
        leave = 0.0
        for k in range(len(blocks) - 1, first - 1, -1):
            block, segment = blocks[k], blocks[k].segment
            reach = math.sqrt(leave * leave + 2 * segment.acceleration * segment.length)
            block.entry = leave = min(segment.entry_limit, reach)
        # What is under way ends as it was planned when it began.
        for k in range(first, len(blocks)):
            before = blocks[k - 1]
            gain = 2 * before.segment.acceleration * before.segment.length
            blocks[k].entry = min(blocks[k].entry, math.sqrt(before.entry * before.entry + gain))

    def drop(self) -> None:
        """Forget the moves that were not carried out (a reset, a halt, M410)."""
        self.blocks.clear()
        self._begun, self._turn = False, 0.0
