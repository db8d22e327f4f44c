"""The first incumbent: the sequence that was given, or one that greedy finds."""

from slicer.sequence.construct.hill_climbing import hill_climbs
from slicer.sequence.problem import Incumbent, Options, Problem


def initial_incumbent(problem: Problem, options: Options) -> Incumbent:
    """An incumbent that starts as ``options.initial``, or as the best of greedy's sequences.

    Unlike the method, it lets Ctrl-C through, which must end what comes after too.
    """
    start = options.initial
    if start is None:
        start = min(hill_climbs(problem, options), key=lambda run: run.travel_mm).oriented
    return Incumbent(problem, options, start)
