"""A replay with the nozzle's body: the deepest press of every move, what is excused, and a planner that errs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from making import FACTS, make_grid, make_lines, read_lines

import profiles
from gcode import emit, program
from gcode.check import check
from gcode.nozzle_body import depths, parts_of
from gcode.pressing import check_nozzle, presses
from gcode.strokes import Stroke
from profiles.sections import Nozzle
from slicer import hatch, sequence, travel
from slicer.errors import CycleError
from slicer.generate import random_walk
from slicer.nozzle import NozzleBody

NEEDLE = Nozzle(tip_width_mm=0.8)
CONE = Nozzle(tip_width_mm=0.4, cone_deg=40, length_mm=2.0, shoulder_width_mm=4.0)


def stroke(x0, y0, x1, y1, line, prints=True):
    return Stroke(x0, y0, x1, y1, line, line, prints, 0.0, 0.0)


def path(*points, prints):
    """Strokes along a polyline; their lines count from 1."""
    return [
        stroke(*a, *b, k + 1, on)
        for k, (a, b, on) in enumerate(zip(points, points[1:], prints, strict=False))
    ]


@pytest.mark.parametrize("nozzle", [NEEDLE, CONE], ids=["needle", "cone"])
@pytest.mark.parametrize("enough", [0.0, 0.1])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_every_move_has_the_deepest_press_of_all_that_was_printed_before(nozzle, enough, seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 12, (300, 2)) * [1, 0.4]
    laid = path(*points, prints=[k % 2 == 0 for k in range(299)])
    lines = np.array([s[:4] for s in laid])
    found = dict(presses(laid, nozzle, enough))
    deepest = 0.0
    for k, move in enumerate(laid):
        # A travel begins in the bead just laid; see the tests below.
        before = [j for j in range(k) if laid[j].prints and (move.prints or j < k - 1)]
        own = [] if move.prints else [k - 1]
        depth = depths(
            parts_of(nozzle), lines[before], np.repeat(lines[k : k + 1], len(before), axis=0)
        ).depth
        if own:
            last = depths(parts_of(nozzle), lines[own], lines[k : k + 1]).depth.max()
            there = depths(parts_of(nozzle), lines[own], np.tile(lines[k, :2], 2)[None]).depth.max()
            depth = np.append(depth, last if last > there + 0.002 else -np.inf)
        if depth.max(initial=-np.inf) > min(enough, deepest):
            assert found[k].depth_mm == pytest.approx(depth.max())
            deepest = max(deepest, depth.max())
        else:
            assert k not in found


def pressed(laid, nozzle=NEEDLE, allowed=0.1):
    violations, pressing = check_nozzle(laid, nozzle, allowed, 0.001)
    return [(v.line, v.kind) for v in violations], pressing


def test_a_toolpath_is_no_obstacle_to_itself_and_may_be_left():
    # Down at 45 degrees: the rear edge of the flat is 0.4 deep in the bead.
    down = path((0, 3), (3, 0), (3, 5), prints=[True, False])
    assert pressed(down)[0] == []
    in_pieces = path(*[(k / 10, 3 - k / 10) for k in range(31)], (3, 5), prints=[True] * 30 + [False])
    assert pressed(in_pieces)[0] == []


def test_what_is_left_may_be_entered_no_deeper():
    # Back along the bead and below its end: it stands in the way like any other.
    laid = path((0, 3), (3, 0), (2.5, 0), prints=[True, False])
    violations, pressing = pressed(laid)
    assert violations == [(2, "nozzle")]
    assert pressing.deepest.depth_mm == pytest.approx(0.4)
    again = path((0, 3), (3, 0), (3, 5), (2, 5), (2, 1), prints=[True, False, False, False])
    assert [line for line, _ in pressed(again, allowed=0.1)[0]] == []
    assert [line for line, _ in pressed([*again, stroke(2, 1, 2.1, 1, 5)], allowed=0.1)[0]] == [5]


def test_the_message_has_depth_lines_place_and_what_is_allowed():
    laid = [
        stroke(0.3, 0.0, 0.3, 2.0, 7),
        stroke(0.3, 2.0, 0.3, 3.0, 8, False),
        stroke(0, 3, 0, 0.5, 9, False),
    ]
    violations, pressing = check_nozzle([*laid, stroke(0, 0.5, -1, 0.5, 10)], NEEDLE, 0.05, 0.001)
    assert [str(v) for v in violations] == [
        "line 9: nozzle: travel to (0.000, 0.500) drives the nozzle 0.100 mm into what line 7 printed, its tip at "
        "(0.000, 0.500); 0.050 mm are allowed",
        "line 10: nozzle: extrusion to (-1.000, 0.500) drives the nozzle 0.100 mm into what line 7 printed, its "
        "tip at (0.000, 0.500); 0.050 mm are allowed",
    ]
    assert (pressing.deepest.line, pressing.deepest.against, pressing.allowed_mm) == (9, 7, 0.05)


def test_a_point_presses_nothing():
    laid = path((0, 3), (3, 0), (2.5, 0), prints=[True, True])
    assert check_nozzle(laid, Nozzle(cone_deg=30), 0.0, 0.001) == ([], None)


@pytest.mark.parametrize(("limit", "wrong"), [(90, False), (46, False), (44, True), (0, True)])
def test_no_extrusion_goes_downhill_more_steeply_than_the_profile_allows(limit, wrong):
    down = path((0, 3), (3, 0), (3, 5), prints=[True, False])
    violations, _ = check_nozzle(down, Nozzle(downhill_deg=limit), 0.0, 0.001)
    assert [(v.line, v.kind) for v in violations] == ([(1, "nozzle")] if wrong else [])
    up = path((3, 0), (0, 3), (0, 0), prints=[True, False])
    assert check_nozzle(up, Nozzle(downhill_deg=limit), 0.0, 0.001)[0] == []


BODY = ["nozzle.tip_width_mm=0.4", "nozzle.cone_deg=10.0", "motion.prime_mm=0"]
PRESS_MM = 0.05


def extrusions_into_the_printed(sheet, planned_width):
    """How many extrusions push too deep where the order was planned for a tip of this width; None for a cycle."""
    lines = hatch.hatch(sheet)
    body = NozzleBody.of(planned_width, 10.0, press_mm=PRESS_MM)
    try:
        problem = sequence.Problem.build(lines.segments, body=body)
    except CycleError:
        return None
    chosen = sequence.solve(problem, method="greedy")
    plan = travel.plan(lines.segments, chosen.order, chosen.flipped, clearance_mm=0.2)
    tile = lines.tile[chosen.order]
    profile = profiles.load("marlin-generic", [*BODY, f"nozzle.press_mm={PRESS_MM}"])
    made = program.build(plan, profile, sheet.spacing_mm[tile[:, 1], tile[:, 0]], tile)
    found = check(read_lines(list(emit.emit(made, profile, FACTS))), profile, sheet).violations
    return sum(v.kind == "nozzle" and "extrusion" in v.message for v in found)


def test_a_planner_whose_body_is_a_tenth_too_narrow_is_caught():
    right, narrow = [], []
    for seed in range(14):
        walk = random_walk(4, 4, seed=seed)
        sheet = make_grid(walk.angles_deg / 2, spacing=0.2)
        right.append(extrusions_into_the_printed(sheet, 0.4))
        narrow.append(extrusions_into_the_printed(sheet, 0.36))
    assert sum(found is not None for found in right) > 4
    assert not any(right)
    assert any(narrow)


def test_half_a_bead_may_be_pressed_unless_the_profile_says():
    lines = make_lines(make_grid([[0, 0]], spacing=0.25), "marlin-generic", "nozzle.tip_width_mm=0.3")
    for said, allowed in (([], 0.125), (["nozzle.press_mm=0.03"], 0.03), (["material.height_mm=0.2"], 0.1)):
        profile = profiles.load("marlin-generic", ["nozzle.tip_width_mm=0.3", *said])
        assert check(read_lines(lines), profile).pressing.allowed_mm == pytest.approx(allowed)
    bare = [line for line in lines if not line.startswith(";")]
    profile = profiles.load("marlin-generic", ["nozzle.tip_width_mm=0.3"])
    assert check(read_lines(bare), profile).pressing.allowed_mm == 0.0


def test_the_line_that_fills_the_nozzle_counts_too():
    sheet = make_grid([[0]], spacing=0.2)
    settings = [
        "motion.prime_mm=10",
        "nozzle.tip_width_mm=1.0",
        "nozzle.length_mm=1.0",
        "nozzle.shoulder_width_mm=8.0",
    ]
    profile = profiles.load("marlin-generic", settings)
    lines = make_lines(sheet, "marlin-generic", *settings)
    assert check(read_lines(lines), profile).violations == []
    high = lines.copy()
    high[high.index("G0 Z0.100 F600")] = "G0 Z1.500 F600"  # that of the prime line comes first
    assert "nozzle" in {v.kind for v in check(read_lines(high), profile).violations}
