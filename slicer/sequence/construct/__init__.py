"""Sequences from nothing: hill climbing, greedy along levels, and the first incumbent; and one that follows
another as far as precedence lets it.
"""

from slicer.sequence.construct.followed import followed
from slicer.sequence.construct.hill_climbing import greedy, hill_climbs
from slicer.sequence.construct.initial import start_along_levels, start_greedily
from slicer.sequence.construct.levels import level_start
from slicer.sequence.construct.multi_start import multistart

__all__ = [
    "followed",
    "greedy",
    "hill_climbs",
    "level_start",
    "multistart",
    "start_along_levels",
    "start_greedily",
]
