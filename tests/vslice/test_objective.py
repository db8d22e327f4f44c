"""From a machine to an objective: the numbers of each shipped profile, and travel times by hand."""

from pathlib import Path

import numpy as np
import pytest

import profiles
from gcode import program
from gcode.estimate import START_DELAY_S
from slicer import grid, travel
from slicer.hatch import hatch
from slicer.sequence import Problem, solve
from slicer.sequence.problem.sequence_cost import true_cost
from slicer.sequence.problem.travel_cost import direct_cost
from vslice.objective import objective_name, objective_of

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))
# travel speed, x, y of the sheet; the same of accelerations; fixed time, and from which length on
SHIPPED = {
    "paper": ((100, 200, 10), (500, 1000, 100), 2 * (1 / 30 + 0.01), 1.5),
    # Speeds and accelerations of the schema's defaults; 1 mm back and 1 mm forth at 30 mm/s and 3000 mm/s².
    "marlin-generic": ((100, 200, 10), (500, 1000, 100), 2 * (1 / 30 + 0.01), 1.5),
    # The valve opens in 0.06 s and closes in 0.04 s, around every travel that there is.
    "marlin-pneumatic": ((60, 100, 10), (300, 500, 100), 0.1 + START_DELAY_S, 1e-6),
    # 0.05 mm of plunger back and forth at 2 mm/s and 500 mm/s².
    "marlin-syringe": ((60, 100, 10), (300, 500, 100), 0.05 + 2 * 2 / 500, 2.0),
    # Klipper has one acceleration: 1000 mm/s² of filament, 300 mm/s² of the plunger.
    "klipper-generic": ((100, 200, 10), (1000, 1000, 100), 2 * (1 / 30 + 0.03), 1.5),
    "klipper-syringe": ((60, 100, 10), (300, 500, 100), 0.05 + 2 * 2 / 300, 2.0),
    # No other firmware holds a move back.
    "klipper-pneumatic": ((60, 100, 10), (300, 500, 100), 0.1, 1e-6),
    "reprapfirmware-generic": ((100, 200, 10), (500, 1000, 100), 2 * (1 / 30 + 0.01), 1.5),
    "reprapfirmware-syringe": ((60, 100, 10), (300, 500, 100), 0.05 + 2 * 2 / 500, 2.0),
    "reprapfirmware-pneumatic": ((60, 100, 10), (300, 500, 100), 0.1, 1e-6),
    "grbl-syringe": ((60, 100, 10), (300, 500, 100), 0.05 + 2 * 2 / 500, 2.0),
    "grbl-pneumatic": ((60, 100, 10), (300, 500, 100), 0.1, 1e-6),
}
TRAVELS = {
    # 100 mm/s at 500 mm/s²: 0.2 s and 10 mm up and down each, 20 mm at full speed; up: 10 mm/s at 100 mm/s²;
    # the short one is below retract_from_mm and never at full speed: 2 * √(1 / 500)
    ("marlin-generic", 40.0, 0.0): 0.2 + 20 / 100 + 0.2 + 2 / 30 + 0.02,
    ("marlin-generic", 0.0, 40.0): 0.1 + 39 / 10 + 0.1 + 2 / 30 + 0.02,
    ("marlin-generic", 1.0, 0.0): 0.0894427191,
    # y allows 10 / 0.8 = 12.5 mm/s and 100 / 0.8 = 125 mm/s²
    ("marlin-generic", 30.0, 40.0): 0.1 + 48.75 / 12.5 + 0.1 + 2 / 30 + 0.02,
    # 60 mm/s at 300 mm/s²: 0.2 s and 6 mm up and down each
    ("marlin-pneumatic", 40.0, 0.0): 0.2 + 28 / 60 + 0.2 + 0.1 + START_DELAY_S,
    ("marlin-pneumatic", 0.0, -40.0): 0.1 + 39 / 10 + 0.1 + 0.1 + START_DELAY_S,
    ("marlin-pneumatic", 0.01, 0.0): 2 * 0.0057735027 + 0.1 + START_DELAY_S,
    ("marlin-pneumatic", 0.0, 0.0): 0.0,
    ("marlin-syringe", 40.0, 0.0): 0.2 + 28 / 60 + 0.2 + 0.058,
    ("marlin-syringe", 0.0, 1.9): 0.1 + 0.9 / 10 + 0.1,
    ("marlin-syringe", 0.0, 2.1): 0.1 + 1.1 / 10 + 0.1 + 0.058,
}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_profile_gives_its_own_numbers(name):
    speed, acceleration, fixed, fixed_from = SHIPPED[name]
    objective = objective_of(profiles.load(name), "time")
    assert objective.name == "time"
    assert objective.clearance_mm == 0.2
    assert objective.speed_mm_s == speed
    assert objective.acceleration_mm_s2 == acceleration
    assert objective.fixed_s == pytest.approx(fixed)
    assert objective.fixed_from_mm == fixed_from


def test_no_shipped_profile_is_left_out():
    assert set(SHIPPED) == set(profiles.shipped())


@pytest.mark.parametrize(("name", "dx", "dy"), TRAVELS)
def test_a_travel_takes_as_long_as_worked_out_by_hand(name, dx, dy):
    objective = objective_of(profiles.load(name), "time")
    expected = TRAVELS[name, dx, dy]
    assert direct_cost(objective.cost_model, dx, dy) == pytest.approx(expected)
    # The same as a travel between two uprights that nothing stands between.
    ends = np.array([[[0.0, 49.0], [0.0, 50.0]], [[dx, 50.0 + dy], [dx, 51.0 + dy]]])
    if dx:
        assert true_cost(Problem.build(ends), objective, np.array([0, 2], np.int32)) == pytest.approx(
            expected
        )


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ([], 2 * (1 / 30 + 30 / 3000)),  # 1 mm from stop to stop, back and forth
        (["motion.retract_mm=0"], 0.0),
        (["motion.retract_mm=0", "motion.retract_extra_mm=0.5"], 0.0),
        (["motion.retract_extra_mm=0.5"], 2.5 / 30 + 2 * 30 / 3000),
        (["motion.retract_speed_mm_s=10"], 2 * (1 / 10 + 10 / 3000)),
        (["motion.retract_speed_mm_s=80"], 2 * (1 / 50 + 50 / 3000)),  # the extruder's own limit
        (["motion.retract_acceleration_mm_s2=100"], 2 * 2 * (1 / 100) ** 0.5),  # it never comes to its speed
        (["machine.max_acceleration_mm_s2=[500, 500, 100, 400]"], 2 * 2 * (1 / 400) ** 0.5),
        (["motion.firmware_retraction=true"], 2 * (1 / 30 + 30 / 3000)),
        (["motion.firmware_retraction=true", "motion.retract_extra_mm=0.5"], 2 * (1 / 30 + 30 / 3000)),
        (["motion.valve_open_s=9"], 2 * (1 / 30 + 30 / 3000)),  # there is no valve
    ],
)
def test_retraction_takes_its_way_from_stop_to_stop(settings, expected):
    profile = profiles.load("marlin-generic", settings)
    assert objective_of(profile, "time").fixed_s == pytest.approx(expected)


@pytest.mark.parametrize(("plane", "along"), [("XZ", 0), ("YZ", 1)])
def test_the_sheets_x_runs_along_the_axis_of_its_plane(plane, along):
    settings = [
        f'machine.plane="{plane}"',
        "machine.max_speed_mm_s=[11, 22, 33, 44]",
        "machine.max_acceleration_mm_s2=[110, 220, 330, 440]",
    ]
    objective = objective_of(profiles.load("marlin-generic", settings), "routed")
    assert objective.name == "routed"
    assert objective.speed_mm_s == (100, (11, 22)[along], 33)
    assert objective.acceleration_mm_s2 == (500, (110, 220)[along], 330)


def test_an_objectives_name_is_read():
    assert [objective_name(name) for name in ("straight", "routed", "time")] == ["straight", "routed", "time"]
    with pytest.raises(ValueError, match="beauty"):
        objective_name("beauty")


def test_klipper_holds_no_move_back_behind_a_dwell():
    marlin, klipper = (
        objective_of(profiles.load("marlin-pneumatic", [f'machine.planner="{planner}"']), "time").fixed_s
        for planner in ("marlin", "klipper")
    )
    assert marlin == pytest.approx(klipper + START_DELAY_S)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_where_every_travel_is_from_stop_to_stop_the_objective_is_the_estimated_time(example):
    """A valve stops the machine around each travel; elsewhere it rounds corners, and the objective is above."""
    sheet = grid.read(example)
    lines = hatch(sheet)
    problem = Problem.build(lines.segments, first=0)
    result = solve(problem, method="greedy")
    oriented = (2 * result.order + result.flipped).astype(np.int32)
    tile = lines.tile[result.order]
    for name in ("marlin-pneumatic", "marlin-generic", "marlin-syringe"):
        profile = profiles.load(name)
        counted = true_cost(problem, objective_of(profile, "time"), oriented)
        clearance = profile.motion.clearance_mm
        plan = travel.plan(problem.segments, result.order, result.flipped, clearance_mm=clearance)
        made = program.lay_out(plan, profile, sheet.spacing_mm[tile[:, 1], tile[:, 0]])
        if name == "marlin-pneumatic":
            assert counted == pytest.approx(made.times.travel_s, rel=0.05)
        assert counted > 0.98 * made.times.travel_s
