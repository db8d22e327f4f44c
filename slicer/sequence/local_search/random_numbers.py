"""Random numbers inside kernels: their seeds, and the generator."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel


def random_state(seed: int, *stream: int) -> NDArray[np.uint64]:
    """uint64 (1,), the state of ``draw``; ``stream`` tells apart several searches with one seed."""
    return np.random.SeedSequence([seed, *stream]).generate_state(1, np.uint64).astype(np.uint64)


@bare_kernel
def draw(state: NDArray[np.uint64]) -> float:
    """The next random number in [0, 1): splitmix64 (Steele, Lea and Flood, OOPSLA 2014)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)
