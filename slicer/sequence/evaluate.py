"""What a plan costs under an objective, from its routes alone."""

import numpy as np

from slicer.sequence.cost import Objective, leg_cost
from slicer.travel import Plan


def cost_of(plan: Plan, objective: Objective) -> float:
    """Millimetres of straight or routed travel, or the seconds of all routed travels.

    A travel's seconds are those of its legs, each from rest to rest, and the fixed time of retraction or
    valve where the travel is longer than ``objective.fixed_from_mm``.

    Args:
        plan: a sequence with its routes; for "routed" and "time" its clearance should be that of the
            objective.
    """
    if objective.name == "straight":
        return plan.straight_mm
    if objective.name == "routed":
        return plan.routed_mm
    parameters = objective.parameters()
    total = 0.0
    for k in range(1, len(plan.toolpaths)):
        via = plan.via[plan.via_start[k] : plan.via_start[k + 1]]
        legs = np.diff(np.vstack([plan.toolpaths[k - 1, 1], via, plan.toolpaths[k, 0]]), axis=0)
        total += sum(leg_cost(parameters, dx, dy) for dx, dy in legs.tolist())
        if np.hypot(*legs.T).sum() > objective.fixed_from_mm:
            total += objective.fixed_s
    return total
