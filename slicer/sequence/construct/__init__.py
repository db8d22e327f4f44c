"""Sequences from nothing: hill climbing, greedy along levels, and the first incumbent."""

from slicer.sequence.construct.hill_climbing import first_hill_climb, greedy, hill_climbs
from slicer.sequence.construct.initial import initial_incumbent
from slicer.sequence.construct.levels import level_start
from slicer.sequence.construct.multi_start import multistart

__all__ = [
    "first_hill_climb",
    "greedy",
    "hill_climbs",
    "initial_incumbent",
    "level_start",
    "multistart",
]
