"""What is asked and answered: problem, objective, the exact cost of a sequence, the result; the ``Search``
that a method is given, when it stops, and its random numbers. A problem takes the precedence as it comes
from ``slicer.precedence``, below all of this.
"""

from slicer.sequence.problem.ancestors import ancestors, is_ancestor
from slicer.sequence.problem.checks import real_number, whole_number
from slicer.sequence.problem.comparability import realizer
from slicer.sequence.problem.directions import directed, start_of
from slicer.sequence.problem.neighbour_lists import Neighbours, neighbours, pitch
from slicer.sequence.problem.objective import (
    CostModel,
    Objective,
    ObjectiveName,
    is_routed,
    is_timed,
    unit_of,
)
from slicer.sequence.problem.problem import REACH_MM, Problem, compressed
from slicer.sequence.problem.random_numbers import Draws, draw, random_state, scrambled
from slicer.sequence.problem.result import Result
from slicer.sequence.problem.search import EFFORTS, Method, Outcome, Progress, Search
from slicer.sequence.problem.sequence_cost import skyline_cost, string_cost, true_cost
from slicer.sequence.problem.travel_cost import (
    FORBIDDEN,
    arc_cost,
    costs_at_least,
    direct_cost,
    direct_sum,
    least_cost_per_mm,
    least_travel_cost,
    leg_cost,
)

__all__ = [
    "EFFORTS",
    "FORBIDDEN",
    "REACH_MM",
    "CostModel",
    "Draws",
    "Method",
    "Neighbours",
    "Objective",
    "ObjectiveName",
    "Outcome",
    "Problem",
    "Progress",
    "Result",
    "Search",
    "ancestors",
    "arc_cost",
    "compressed",
    "costs_at_least",
    "direct_cost",
    "direct_sum",
    "directed",
    "draw",
    "is_ancestor",
    "is_routed",
    "is_timed",
    "least_cost_per_mm",
    "least_travel_cost",
    "leg_cost",
    "neighbours",
    "pitch",
    "random_state",
    "real_number",
    "realizer",
    "scrambled",
    "skyline_cost",
    "start_of",
    "string_cost",
    "true_cost",
    "unit_of",
    "whole_number",
]
