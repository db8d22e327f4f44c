"""What a travel costs over what is printed, as sequences that print the same before tell."""

from functools import cache

import numpy as np

from slicer.sequence.problem.sequence_cost import true_cost


def over_what_is_printed(problem, goal):
    """Cost of a travel under a nozzle's body: what is added to a sequence that printed the same before.

    By the package's own cost, which tests/slicer/sequence/layered/test_routed.py holds against two others.
    """

    @cache
    def cost(printed, u, v):
        rest = [2 * s for s in range(problem.n) if printed >> s & 1 and s != u >> 1]
        return sum(
            sign * true_cost(problem, goal, np.array(sequence, np.int32))
            for sign, sequence in ((1, [*rest, u, v]), (-1, [*rest, u]))
        )

    return cost
