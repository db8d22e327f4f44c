"""What several tests of the sequencer share: small random sheets, and the optimum by brute force."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from slicer import grid
from slicer.hatch import hatch
from slicer.sequence import Problem
from slicer.sequence.cost import Objective, direct_cost

Sheet = Callable[..., NDArray[np.float64]]
Optimum = Callable[..., float]


@pytest.fixture(scope="session")
def sheet() -> Sheet:
    """Segments of a random sheet of all tilts, with null tiles and uprights; at most so many toolpaths."""

    def build(seed: int, most: int, least: int = 1) -> NDArray[np.float64]:
        random = np.random.default_rng(seed)
        while True:
            cols, rows = random.integers(1, 6), random.integers(1, 3)
            tilts = random.uniform(-89.9, 90.0, (rows, cols))
            special = random.random((rows, cols)) < 0.4
            tilts[special] = random.choice([0.0, 90.0, -45.0], special.sum())
            angles = [[None if random.random() < 0.15 else float(a) for a in row] for row in tilts]
            tile = float(random.uniform(0.5, 3.0))
            spacing = float(tile * random.uniform(0.35, 0.9))
            if all(a is None for row in angles for a in row):
                continue
            text = json.dumps({"tile_mm": tile, "spacing_mm": spacing, "angles_deg": angles})
            segments = hatch(grid.loads(text)).segments
            if least <= len(segments) <= most:
                return segments

    return build


@pytest.fixture(scope="session")
def optimum() -> Optimum:
    """The least direct cost over all linear extensions and directions, by exhaustive dynamic programming.

    The last toolpath may be given; the precedence is taken from the problem, the columns are not used.
    """

    def search(problem: Problem, objective: Objective | None = None, last: int | None = None) -> float:
        parameters = (objective or Objective()).parameters()
        n, segments = problem.n, problem.segments
        under = [
            sum(1 << int(p) for p in problem.pred[problem.pred_start[s] : problem.pred_start[s + 1]])
            for s in range(n)
        ]
        layer = {(1 << (int(u) >> 1), int(u)): 0.0 for u in problem.starts}
        for _ in range(n - 1):
            following: dict[tuple[int, int], float] = {}
            for (printed, u), cost in layer.items():
                end = segments[u >> 1, 1 - (u & 1)]
                for s in range(n):
                    if printed >> s & 1 or under[s] & ~printed:
                        continue
                    for f in range(2):
                        dx, dy = segments[s, f] - end
                        total = cost + direct_cost(parameters, float(dx), float(dy))
                        node = (printed | 1 << s, 2 * s + f)
                        if total < following.get(node, np.inf):
                            following[node] = total
            layer = following
        return min((cost for (_, u), cost in layer.items() if last in (None, u)), default=np.inf)

    return search


@pytest.fixture(scope="session")
def reference() -> Callable[[str], tuple[Problem, float]]:
    """A reference instance by name: the problem, and the least travel known."""
    folder = Path(__file__).parents[1] / "data" / "reference"
    known = json.loads((folder / "reference.json").read_text())["best_known"]

    def read(name: str) -> tuple[Problem, float]:
        instance = json.loads((folder / f"{name}.json").read_text())
        return Problem.build(np.array(instance["segments"], float), first=instance["first"]), known[name]

    return read
