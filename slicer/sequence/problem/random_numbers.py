"""Random numbers and hashes inside kernels: their seeds, the generator, and what mixes the bits of both.

The generator is splitmix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA
2014).
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel

INCREMENT = np.uint64(0x9E3779B97F4A7C15)


class Draws(IntEnum):
    """What random numbers are drawn for: one seed gives each kind a sequence of its own."""

    ANNEALING = 0
    REFINEMENT = 1
    TREES = 2
    ANTS = 3
    RURAL_POSTMAN = 4


def random_state(seed: int, draws: Draws, stream: int | None = None) -> NDArray[np.uint64]:
    """uint64 (1,), the state of ``draw``; ``stream`` tells apart several runs of one kind.

    Each is a child of the seed's own sequence, by the spawn keys of numpy's ``SeedSequence``.
    """
    key = (int(draws),) if stream is None else (int(draws), stream)
    return np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64).astype(np.uint64)


@inner_kernel
def draw(state: NDArray[np.uint64]) -> float:
    """The next random number in [0, 1)."""
    state[0] += INCREMENT
    return float(_mixed(state[0]) >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@inner_kernel
def scrambled(number: int) -> np.uint64:
    """A well mixed 64-bit number."""
    return _mixed(np.uint64(number) * INCREMENT)


@inner_kernel
def _mixed(z: np.uint64) -> np.uint64:
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
