"""Proofs and bounds against all linear extensions and directions: random fields, machines and nozzles by the dozen.

``VSLICE_EXHAUSTIVE_CASES=3000``, or ``1000:2000`` for a part of them, in the environment runs these instead of the few
that the suite has time for; docs/results.md says what that came to.
"""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
from counted import relaxed
from exhaustive import least_cost, travel_cost
from fields import allowed_by, hindered, random_body
from printed import over_what_is_printed

from slicer import grid
from slicer.errors import CycleError
from slicer.hatch import hatch
from slicer.nozzle import POINT
from slicer.sequence import Problem, solve
from slicer.sequence.bound import step_lengths
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.streamed_bound import StreamedBound
from slicer.sequence.bound.tree_bound import TreeBound
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states import all_down_sets, cover, relaxed_columns
from slicer.sequence.states.corridor import widest_corridor
from slicer.sequence.states.section import Section

CASES = range(*map(int, os.environ.get("VSLICE_EXHAUSTIVE_CASES", "32").split(":")))
MOST = 8
TILTS = {"level": (-25.0, 25.0), "steep": (65.0, 115.0), "any": (-89.9, 90.0)}
MACHINES = {
    "even": {"speed_mm_s": (30.0, 30.0, 30.0), "acceleration_mm_s2": (500.0, 500.0, 500.0)},
    "slow up": {"speed_mm_s": (30.0, 50.0, 2.0), "acceleration_mm_s2": (500.0, 500.0, 20.0)},
    "slow across": {"speed_mm_s": (30.0, 2.0, 50.0), "acceleration_mm_s2": (500.0, 20.0, 500.0)},
    "slow to speed up": {"speed_mm_s": (80.0, 80.0, 80.0), "acceleration_mm_s2": (20.0, 500.0, 500.0)},
    "no ramps": {"speed_mm_s": (10.0, 20.0, 4.0)},
}
GOALS = ("straight", "routed", "time", "retracting", "joining")


def field(random, tilt):
    """Some toolpaths of a small sheet, at most ``MOST``, in any order and direction."""
    cols, rows = random.integers(1, 5), random.integers(1, 4)
    angles = (random.uniform(*TILTS[tilt], (rows, cols)) + 90.0) % 180.0 - 90.0
    described = {
        "tile_mm": 1.0,
        "spacing_mm": float(random.uniform(0.2, 0.7)),
        "angles_deg": np.where(angles <= -90.0, 90.0, angles).tolist(),
    }
    segments = hatch(grid.loads(json.dumps(described))).segments
    chosen = random.permutation(len(segments))[: random.integers(2, MOST + 1)]
    return segments[chosen], random.random(len(chosen)) < 0.5


def machine(random):
    """A machine's objective, and what it is called."""
    name, limits = list(MACHINES.items())[random.integers(len(MACHINES))]
    goal = GOALS[random.integers(len(GOALS))]
    clearance = float(random.choice([0.0, 0.15]))
    if goal in ("straight", "routed"):
        return Objective(goal, clearance), goal
    more = {"fixed_s": 0.05, "fixed_from_mm": 0.3} if goal == "retracting" else {}
    if goal == "joining":
        more = {"fixed_s": 0.02, "join_mm": 0.6, "join_speed_mm_s": float(random.choice([1.0, 20.0]))}
        more["join_downhill_deg"] = float(random.choice([90.0, 40.0, 0.0]))
    return Objective("time", clearance, **limits, **more), f"{goal}, {name}"


def nozzled(random, segments):
    """A problem under a point or a nozzle with a body, its start free or fixed; None where it cannot be printed."""
    body, down = POINT, 90.0
    if random.random() < 0.5:
        body = random_body(random, float(random.choice([0.03, 0.1, 0.3])))
        down = float(random.choice([90.0, 90.0, 30.0]))
    try:
        problem = Problem.build(segments, body=body, downhill_deg=down)
    except CycleError:
        return None
    if random.random() < 0.5:
        start = int(random.choice(problem.starts))
        flipped = bool(start & 1) if random.random() < 0.5 else None
        problem = Problem.build(
            segments, body=body, downhill_deg=down, first=start >> 1, first_flipped=flipped
        )
    return problem, hindered(segments, body), allowed_by(segments, down)


def least(problem, goal, before, allowed):
    """The optimum, and the least cost of travels that nothing is in the way of."""
    about = {
        "first": problem.first,
        "first_flipped": problem.first_flipped,
        "before": before,
        "allowed": allowed,
    }
    n, ends = problem.n, problem.segments.reshape(-1, 2)
    direct = np.array(
        [[least_of_travel(goal, ends[u ^ 1], ends[v]) for v in range(2 * n)] for u in range(2 * n)]
    ).tolist()
    straight = least_cost(goal, problem.segments, **about, travel=lambda _, u, v: direct[u][v])
    if not goal.routed:
        return straight, straight
    over = None if problem.body.half_width == 0 else over_what_is_printed(problem, goal)
    return least_cost(goal, problem.segments, **about, travel=over), straight


def least_of_travel(goal, start, end):
    """A hop that rises over something is not joined, and may then be quicker."""
    apart = replace(goal, join_mm=0.0)
    return min(travel_cost(one, [], start, end, skyline=False) for one in (goal, apart))


def bounds(problem, goal, order, best, random):
    """Every bound there is, raised and then with other multipliers, by its name."""
    section = Section.whole(problem, goal)
    with pytest.MonkeyPatch.context() as patch:
        if random.random() < 0.5:
            patch.setattr("slicer.sequence.states.corridor.MERGED_STATES", 0)
        corridor = widest_corridor(section, order, 10**6)
        patch.setattr(relaxed_columns, "MOST_DOWN_SETS", 0)
        # Few travels: a single group a column, as a rule.
        sets, together, never = relaxed(section, int(random.choice([0, 10**6])))
    pairs = {
        "pairs": PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed),
        "counts": PairBound.over(section, sets, cover(sets), together, never),
    }
    for name, bound in pairs.items():
        bound.improve(1.1 * best, step_lengths(20))
        yield name, bound.bound
        bound.best += random.normal(0.0, 0.3, len(bound.best))
        bound.use_best_multipliers()
        yield f"{name}, disturbed", bound.bound
    tree = TreeBound(problem, goal.cost_model)
    for _ in range(30):
        tree.improve(1.1 * best)
    yield "tree", tree.bound
    tree.multiplier = tree.multiplier + random.normal(0.0, 0.3, len(tree.multiplier))
    yield "tree, disturbed", tree.evaluate()[0]
    if not goal.routed and section.columns > 1:
        streamed = StreamedBound(section, all_down_sets(section, 10**4))
        for _ in range(10):
            streamed.step(0.05 * best, lambda: False)
        yield "streamed", streamed.bound


def test_nothing_is_below_a_bound_and_exact_finds_the_least():
    wrong, printable, bounded = [], 0, 0
    for case in CASES:
        random = np.random.default_rng(case)
        tilt = list(TILTS)[case % len(TILTS)]
        segments, turned = field(random, tilt)
        goal, called = machine(random)
        nozzle = nozzled(random, np.where(turned[:, None, None], segments[:, ::-1], segments))
        if nozzle is None:
            continue
        problem, before, allowed = nozzle
        best, direct = least(problem, goal, before, allowed)
        where = f"case {case}: {problem.n} toolpaths, {tilt}, {called}"
        printable += 1
        with pytest.MonkeyPatch.context() as patch:
            if case % 2:  # one block holds all of such small sheets
                patch.setattr("slicer.sequence.layered.exact_search.holds_whole", lambda bound: False)
            found = solve(problem, method="exact", effort="quick", objective=goal)
        if found.cost != pytest.approx(best, abs=1e-7):
            wrong.append(f"{where}: exact found {found.cost}, the least is {best}")
        cheap = solve(problem, method="greedy", objective=goal).lower_bound
        told = {"exact": found.lower_bound, "greedy": cheap}
        for name, bound in told.items():
            if bound is not None and bound > best + 1e-7:
                wrong.append(f"{where}: {name} claims {bound}, the least is {best}")
        for name, bound in bounds(problem, goal, found.order.astype(np.int32), best, random):
            bounded += 1
            # That over pairs of columns knows what surely stands under a nozzle with a body.
            above = best if name.startswith(("pairs", "counts")) else direct
            if bound > above + 1e-7:
                wrong.append(f"{where}: bound by {name} {bound}, the least is {above}")
    print(f"{printable} of {len(CASES)} fields, {bounded} bounds, {len(wrong)} wrong")
    assert not wrong, "\n".join(wrong[:20])
    assert printable > 0.7 * len(CASES)
