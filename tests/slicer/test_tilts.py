"""Fibre angles are axial: what is folded, and what is doubted."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slicer import grid
from slicer.generate import random_walk
from slicer.tilts import fold

CASES = Path(__file__).parents[1] / "data" / "cases"


@pytest.mark.parametrize(
    ("angle", "folded"),
    [(-90, 90), (90, 90), (180, 0), (-180, 0), (91, -89), (-91, 89), (135, -45), (-0.0, 0), (270, 90), (-270, 90),
     (360, 0), (1e6, -80)],
)  # fmt: skip
def test_angles_are_folded(angle, folded):
    found, said = fold(np.array([[float(angle)]]))
    assert found[0, 0] == folded
    assert math.copysign(1, found[0, 0]) == math.copysign(1, folded) or folded
    assert bool(said) == (abs(angle) > 180)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_finite_angle_has_its_place(angle):
    found = fold(np.array([[angle]]))[0][0, 0]
    assert -90 < found <= 90
    if abs(angle) < 1e6:
        off = (angle - found) / 180
        assert off == pytest.approx(round(off), abs=1e-9)


@pytest.mark.parametrize("case", ["angle_minus_90", "angle_180"])
def test_cases_are_read(case):
    read = grid.read(CASES / f"{case}.json")
    assert set(read.angles_deg.flat) == {0.0, 90.0}
    assert read.warnings == ()


def test_angles_beyond_a_half_turn_are_doubted_with_place_and_number():
    text = '{"tile_mm": 1, "spacing_mm": 0.1, "angles_deg": [[0, 10], [null, 225], [-190, 180]]}'
    read = grid.loads(text, source="lab.json")
    assert read.warnings == (
        "lab.json: angles_deg[1][1]: tile (1, 1): angle 225 is beyond ±180 and was taken as 45; 1 more are beyond it. "
        "Degrees or radians?",
    )


def test_fields_that_look_like_radians_are_doubted():
    for seed in range(5):
        walk = random_walk(4, 4, seed=seed).angles_deg
        assert fold(walk)[1] == []
        assert "Degrees or radians?" in fold(np.radians(walk))[1][0]


@pytest.mark.parametrize(
    "angles",
    [[[0, 0], [0, 0]], [[1e-7, -1e-7]], [[1, -1], [0, 1]], [[1.5]], [[1.5, 1.5]], [[0.3, -0.7], [0.2, 0.1]],
     [[np.nan, np.nan]], [[0.8, 45.5]]],
)  # fmt: skip
def test_sheets_that_are_level_or_nearly_so_are_not(angles):
    assert fold(np.array(angles, float))[1] == []
