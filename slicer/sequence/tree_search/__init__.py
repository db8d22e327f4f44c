"""Sequences built toolpath by toolpath, again and again: Monte Carlo tree search and ant colonies."""

from slicer.sequence.tree_search.ant_colony import aco
from slicer.sequence.tree_search.monte_carlo import mcts
from slicer.sequence.tree_search.passes import STRIDE, improve_by_trees

__all__ = [
    "STRIDE",
    "aco",
    "improve_by_trees",
    "mcts",
]
