"""What hangs, held against Shapely's buffers."""

import numpy as np
import pytest
from shapely.geometry import LineString, box

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.support import SLACK_MM, hanging, hanging_of
from slicer.travel import plan


def by_buffers(toolpaths, height):
    lowest = toolpaths[:, :, 1].min()
    length, bridge = [], []
    for k, line in enumerate(toolpaths):
        reach = height[k] + SLACK_MM
        left = LineString(line) - box(-1e3, -1e3, 1e3, lowest + reach)
        for earlier in toolpaths[:k]:
            left = left - LineString(earlier).buffer(reach, quad_segs=500)
        parts = [part for part in getattr(left, "geoms", [left]) if part.length > 1e-6]
        length.append(sum(part.length for part in parts))
        bridge.append(max((part.length for part in parts), default=0.0))
    return np.array(length), np.array(bridge)


@pytest.mark.parametrize("seed", range(6))
def test_what_hangs_is_what_no_buffer_reaches(seed):
    random = np.random.default_rng(seed)
    toolpaths = hatch(random_walk(2, 2, seed=seed)).segments
    toolpaths = toolpaths[random.permutation(len(toolpaths))]
    height = random.choice([0.05, 0.1, 0.2], len(toolpaths))
    found = hanging(toolpaths, height)
    length, bridge = by_buffers(toolpaths, height)
    assert found.length_mm == pytest.approx(length, abs=2e-4)
    assert found.bridge_mm == pytest.approx(bridge, abs=2e-4)
    assert found.length_mm.max() > 0.1


def test_level_toolpaths_from_the_bed_upwards_do_not_hang():
    rows = np.array([[[0.0, y], [1.0, y]] for y in np.arange(10) * 0.1])
    assert hanging(rows, np.full(10, 0.1)).length_mm.max() == 0


def test_the_first_above_the_bed_is_a_bridge_where_nothing_is_under_it():
    lines = np.array([[[0.0, 0.0], [0.3, 0.0]], [[0.0, 0.1], [1.0, 0.1]], [[0.2, 0.5], [0.8, 0.5]]])
    found = hanging(lines, np.full(3, 0.1))
    assert found.length_mm == pytest.approx([0, 0, 0.6], abs=1e-6)
    lines[1, :, 1] = 0.15
    found = hanging(lines, np.full(3, 0.1))
    assert found.bridge_mm == pytest.approx([0, 1, 0.6], abs=1e-6)
    assert found.pieces == pytest.approx(lines[1:], abs=1e-6)


def test_a_hop_that_is_extruded_carries_what_comes_later():
    lines = np.array([[[0.0, 0.0], [0.1, 0.0]], [[0.15, 0.4], [0.3, 0.4]], [[0.05, 0.1], [0.05, 0.4]]])
    height = np.full(3, 0.1)
    apart = plan(lines, [0, 1, 2], [0, 0, 0])
    assert hanging_of(apart, height).length_mm == pytest.approx(hanging(lines, height).length_mm)
    made = plan(lines, [0, 1, 2], [0, 0, 0], join_mm=0.45)
    assert made.joined.tolist() == [False, True, False]
    found = hanging_of(made, height)
    # The hop hangs above the bed, and then carries the beginning of the line that it leads to, and the last.
    hop = np.array([lines[0], [[0.1, 0.0], [0.15, 0.4]], *lines[1:]])
    alone = hanging(hop, np.full(4, 0.1)).length_mm
    assert found.length_mm == pytest.approx([alone[0], alone[1] + alone[2], alone[3]])
    assert alone[1] > 0.2
    assert alone[3] < hanging_of(apart, height).length_mm[2] - 0.1
    assert found.bridge_mm[1] == pytest.approx(max(alone[1:3]), abs=1e-3)
    empty = plan(lines[:0], [], [])
    assert len(hanging_of(empty, np.empty(0)).length_mm) == 0


def test_the_pieces_are_what_hangs():
    toolpaths = hatch(random_walk(2, 2, seed=3)).segments[::-1]
    found = hanging(toolpaths, np.full(len(toolpaths), 0.05))
    assert np.hypot(*(found.pieces[:, 1] - found.pieces[:, 0]).T).sum() == pytest.approx(
        found.length_mm.sum(), abs=0.001 * len(toolpaths)
    )
    assert len(found.pieces) > 5


def test_nothing_hangs_in_an_empty_print():
    assert len(hanging(np.empty((0, 2, 2)), np.empty(0)).length_mm) == 0
