"""Random numbers: what one seed gives to each kind and stream, nobody else gets."""

import itertools

import pytest
from calling import from_python

from slicer.sequence.problem import random_numbers
from slicer.sequence.problem.random_numbers import Draws, random_state

draw = from_python(random_numbers.draw)


def test_no_two_kinds_streams_or_seeds_draw_the_same():
    keys = list(itertools.product((0, 1, 2**32, 2**63 + 1), Draws, (None, 0, 1, 2, 3)))
    states = {int(random_state(*key)[0]) for key in keys}
    assert len(states) == len(keys)


def test_the_same_key_draws_the_same():
    first, again = random_state(7, Draws.TREES, 2), random_state(7, Draws.TREES, 2)
    numbers = [draw(first) for _ in range(1000)]
    assert numbers == [draw(again) for _ in range(1000)]
    assert min(numbers) >= 0.0
    assert max(numbers) < 1.0
    assert sum(numbers) / len(numbers) == pytest.approx(0.5, abs=0.05)
