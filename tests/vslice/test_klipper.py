"""The estimated time of a machine with Klipper against Klipper's own planner, in a process of its own."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import profiles
from gcode.estimate import seconds_of
from gcode.moves import Kind
from gcode.parse import read_moves

PEER = Path(__file__).parent / "peers" / "klipper_planner.py"
PYTHON = os.environ.get("VSLICE_KLIPPER_PYTHON", "")
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))
ACCELERATION = ["print", "travel", "retract"]  # Klipper has one for all
OTHERS = [
    ["machine.square_corner_velocity_mm_s=1.0"],
    ["machine.square_corner_velocity_mm_s=20.0", "motion.print_speed_mm_s=100.0"],
    ["machine.minimum_cruise_ratio=0.0"],
    ["machine.minimum_cruise_ratio=0.9"],
    ["machine.max_acceleration_mm_s2=[300.0, 300.0, 20.0, 500.0]"],
    ["machine.max_speed_mm_s=[30.0, 200.0, 5.0, 25.0]"],
    ["motion.retract_mm=0.0"],
    ['machine.plane="YZ"'],
]
pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        not PYTHON, reason="VSLICE_KLIPPER_PYTHON names no interpreter of an environment with Klipper"
    ),
]


def settings(*more, acceleration=1000.0):
    same = [f"motion.{kind}_acceleration_mm_s2={acceleration}" for kind in ACCELERATION]
    return ['machine.planner="klipper"', 'gcode.start=["G28"]', *same, *more]


def klipper(program, profile):
    """Seconds of extruding moves, of other moves, and of dwells."""
    machine = profile.machine
    corner, size = machine.build_corner_mm, machine.build_volume_mm
    top = corner[2] + size[2] if profile.printer.build_axis_homes_up else corner[2]
    limits = {
        "home": [corner[0], corner[1], top, 0.0],
        "max_accel": profile.motion.print_acceleration_mm_s2,
        "max_extrude_only_accel": profile.motion.retract_acceleration_mm_s2,
        "max_speed": machine.max_speed_mm_s,
        "max_acceleration": machine.max_acceleration_mm_s2,
        "square_corner_velocity": machine.square_corner_velocity_mm_s,
        "minimum_cruise_ratio": machine.minimum_cruise_ratio,
    }
    done = subprocess.run(
        [PYTHON, str(PEER), json.dumps(limits)], input=program, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def compare(run, example, name, changed):
    words = [word for setting in changed for word in ("--set", setting)]
    if example.stem == "ihc_16x16":  # a wide nozzle cuts it into tens of thousands of pieces
        words += ["--nozzle", "25G"]
    assert run(example, "-o", "part.gcode", "-p", name, "--method", "greedy", *words)[0] == 0
    agree(Path("part.gcode"), profiles.load(name, changed))


def agree(path, profile):
    """The estimate of a program against Klipper's, in all and by kind of move."""
    moves = read_moves(path, plane=profile.machine.plane, flavor=profile.flavor)
    own = {"extruding": 0.0, "other": 0.0, "dwell": 0.0}
    for move, took in zip(moves, seconds_of(moves, profile), strict=True):
        kind = {Kind.EXTRUDE: "extruding", Kind.DWELL: "dwell"}.get(move.kind, "other")
        own[kind] += float(took)
    theirs = klipper(path.read_text(), profile)
    assert sum(own.values()) == pytest.approx(sum(theirs.values()), rel=0.005)  # 0.03 is promised
    for kind, took in theirs.items():
        assert own[kind] == pytest.approx(took, rel=0.005, abs=0.05), kind


@pytest.mark.parametrize("name", ["marlin-generic", "marlin-syringe", "marlin-pneumatic", "klipper-generic"])
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_klipper_takes_what_was_estimated(run, example, name):
    compare(run, example, name, settings())


@pytest.mark.parametrize("more", OTHERS, ids=lambda more: more[0][:40])
def test_they_agree_on_other_machines_too(run, more):
    compare(run, EXAMPLES[3], "marlin-generic", settings(*more, acceleration=700.0))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("step", [0.2, 2.0, 20.0])
def test_they_agree_on_moves_of_all_kinds_and_lengths(tmp_path, step, seed):
    random = np.random.default_rng(seed)
    place, lines = np.array([100.0, 100.0]), ["G28", "G90", "M83", "G1 X100 Y100 Z100 F3000"]
    for _ in range(1000):
        place = np.clip(place + random.normal(0, step, 2), 1, 199)
        e = random.choice(["", f" E{random.uniform(0, step / 10):.4f}"])
        lines.append(f"G1 X{place[0]:.3f} Z{place[1]:.3f}{e} F{random.choice([300, 1200, 6000, 12000])}")
        if random.random() < 0.02:
            lines.append("G4 P20")
    path = tmp_path / "random.gcode"
    path.write_text("\n".join(lines) + "\n")
    agree(path, profiles.load("marlin-generic", settings(acceleration=[500.0, 1000.0, 3000.0][seed])))
