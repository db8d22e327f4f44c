"""What several tests of the sequencer share: small random sheets, and the optimum by brute force."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from exhaustive import least_cost
from numpy.typing import NDArray

from slicer import grid
from slicer.hatch import hatch
from slicer.sequence import Problem
from slicer.sequence.problem.objective import Objective

Sheet = Callable[..., NDArray[np.float64]]
Optimum = Callable[..., float]


@pytest.fixture(scope="session")
def sheet() -> Sheet:
    """Segments of a random sheet of all tilts, with null tiles, uprights and outlines; at most so many."""

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
            described = {"tile_mm": tile, "spacing_mm": spacing, "angles_deg": angles}
            if random.random() < 0.4:
                described["outline_mm"] = [_outline(random, cols * tile, rows * tile)]
            segments = hatch(grid.loads(json.dumps(described))).segments
            if least <= len(segments) <= most:
                return segments

    return build


def _outline(random: np.random.Generator, width: float, height: float) -> list[list[list[float]]]:
    """A ring about the sheet with its corners pushed in, and now and then a hole in it."""
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    inset = random.uniform(0.0, 0.3, (4, 2))
    ring = [(abs(x - dx), abs(y - dy)) for (x, y), (dx, dy) in zip(corners, inset, strict=True)]
    rings = [ring]
    if random.random() < 0.5:
        x, y = random.uniform(0.4, 0.5, 2)
        rings.append([(x, y), (x + 0.1, y), (x + 0.05, y + 0.15)])
    return [[[float(x * width), float(y * height)] for x, y in points] for points in rings]


@pytest.fixture(scope="session")
def optimum() -> Optimum:
    """The least direct cost of a problem by brute force; see ``exhaustive.least_cost``.

    Of the problem it takes the toolpaths and the start alone: neither precedence nor columns.
    """

    def search(problem: Problem, objective: Objective | None = None, last: int | None = None) -> float:
        start = {"first": problem.first, "first_flipped": problem.first_flipped}
        return least_cost(objective or Objective(), problem.segments, **start, last=last, skyline=False)

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
