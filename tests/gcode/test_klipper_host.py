"""Klipper's whole host prints our programs, to the last step of each motor, in its file-output mode."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.estimate import seconds_of
from gcode.moves import Kind

PEER = Path(__file__).parent / "peers" / "klipper_host.py"
PYTHON = os.environ.get("VSLICE_KLIPPER_PYTHON", "")
SHEET = make_grid([[-45, -20], [30, 90]])
TURN_MM = {"x": 40.0, "y": 40.0, "z": 8.0, "e": 4.0}
STEPS = 200 * 16
pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        not PYTHON, reason="VSLICE_KLIPPER_PYTHON names no interpreter of an environment with Klipper"
    ),
]


def printer_cfg(profile):
    """A printer.cfg as docs/hosts.md wants it for this profile."""
    machine, motion, material = profile.machine, profile.motion, profile.material
    high = np.add(machine.build_corner_mm, machine.build_volume_mm)
    text = f"""
[force_move]
enable_force_move: True
[mcu]
serial: /none
[printer]
kinematics: cartesian
max_velocity: {machine.max_speed_mm_s[0]}
max_z_velocity: {machine.max_speed_mm_s[2]}
max_accel: {motion.print_acceleration_mm_s2}
max_z_accel: {machine.max_acceleration_mm_s2[2]}
square_corner_velocity: {machine.square_corner_velocity_mm_s}
"""
    for k, axis in enumerate("xyz"):
        text += f"""
[stepper_{axis}]
step_pin: P{3 * k}
dir_pin: P{3 * k + 1}
endstop_pin: P{3 * k + 2}
microsteps: 16
rotation_distance: {TURN_MM[axis]}
position_endstop: 0
position_max: {high[k]}
homing_speed: 100
homing_retract_dist: 0
"""
    if material.feed == "pneumatic":
        return text + "\n[output_pin valve]\npin: P20\n"
    diameter = material.syringe_bore_mm if material.feed == "syringe" else material.filament_diameter_mm
    text += f"""
[extruder]
step_pin: P9
dir_pin: P10
microsteps: 16
rotation_distance: {TURN_MM["e"]}
nozzle_diameter: 0.4
filament_diameter: {diameter}
max_extrude_only_velocity: {machine.max_speed_mm_s[3]}
max_extrude_only_accel: {motion.retract_acceleration_mm_s2}
max_extrude_only_distance: 100
min_extrude_temp: 0
{_heater(11)}
[heater_bed]
{_heater(13)}
[firmware_retraction]
retract_length: {motion.retract_mm}
retract_speed: {motion.retract_speed_mm_s}
unretract_speed: {motion.retract_speed_mm_s}
"""
    return text


def _heater(pin):
    return (
        f"heater_pin: P{pin}\nsensor_pin: P{pin + 1}\nsensor_type: EPCOS 100K B57560G104F\n"
        "control: watermark\nmin_temp: 0\nmax_temp: 300"
    )


# How far the host homes before it finds that nobody presses a switch depends on the clock of the wall.
HOMED = {"G28": "SET_KINEMATIC_POSITION X=0 Y=0 Z=0"}


def klipper(lines, profile):
    """What Klipper's host makes of lines, from a machine that is at home already."""
    lines = [HOMED.get(line, line) for line in lines]
    before = None
    for _ in range(
        6
    ):  # on a machine at its limits the host may end before it has sent its last steps, or any
        done = subprocess.run(
            [PYTHON, str(PEER), printer_cfg(profile)],
            input="\n".join(lines) + "\n",
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        if found["turns"] == before and any(len(turned) > 1 for turned in before):
            break
        before = found["turns"]
    return found


def turns(places, least):
    """Where a sequence of places turns back, leaving out what is less than ``least`` away."""
    found = [places[0]]
    for place in places[1:]:
        if len(found) > 1 and (found[-1] - found[-2]) * (place - found[-1]) > 0:
            found[-1] = place
        elif abs(place - found[-1]) > least:
            found.append(place)
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("klipper-generic", ()),
        ("klipper-generic", ("motion.firmware_retraction=true",)),
        ("klipper-syringe", ()),
        ("klipper-pneumatic", ()),
    ],
    ids=str,
)
def test_each_motor_steps_to_where_the_check_reads_the_program_to_go(name, settings):
    profile = profiles.load(name, [POINT, *settings])
    lines = make_lines(SHEET, name, *settings)
    found = klipper(lines, profile)
    assert "Unknown command" not in found["log"]
    assert "Error" not in found["log"]
    moves = read_lines(lines, profile.machine.plane, profile.flavor)
    places, e = [(0.0, 0.0, 0.0, 0.0)], 0.0
    for move in moves:
        back = profile.motion.retract_mm
        e += {Kind.FIRMWARE_RETRACT: -back, Kind.FIRMWARE_PRIME: back}.get(move.kind, move.e_mm)
        place = np.nan_to_num([move.x_mm, move.depth_mm, move.y_mm])
        places.append((*place, e))
    for k, (axis, stepped) in enumerate(zip("xyze", found["turns"], strict=False)):
        step = TURN_MM[axis] / STEPS
        own = turns([place[k] for place in places], 1.5 * step)
        theirs = turns(np.array(stepped) * step, 1.5 * step)
        np.testing.assert_allclose(theirs, own, atol=1.01 * step, err_msg=axis)
    seconds = seconds_of(moves, profile)
    moving = np.flatnonzero([move.kind in (Kind.TRAVEL, Kind.EXTRUDE, Kind.FEED) for move in moves])
    took = found["last_s"] - found["first_s"]
    assert took == pytest.approx(seconds[moving[0] : moving[-1] + 1].sum(), rel=0.005, abs=0.02)


def test_a_valve_turns_when_the_estimate_says():
    profile = profiles.load("klipper-pneumatic", [POINT])
    lines = make_lines(SHEET, "klipper-pneumatic")
    found = klipper(lines, profile)
    moves = read_lines(lines, flavor=profile.flavor)
    passed = np.concatenate(([0.0], np.cumsum(seconds_of(moves, profile))))
    begins = next(k for k, move in enumerate(moves) if move.kind == Kind.TRAVEL)
    said, state = [], 0
    for k, move in enumerate(moves[begins:], begins):
        if move.text.startswith("SET_PIN") and int(move.text[-1]) != state:
            state = int(move.text[-1])
            said.append((passed[k] - passed[begins], state))
    done = [
        (s - found["first_s"], int(ticks > 0)) for _, s, ticks in found["outputs"] if s > found["first_s"]
    ]
    assert len(said) > 6
    assert [state for _, state in done] == [state for _, state in said]
    np.testing.assert_allclose([s for s, _ in done], [s for s, _ in said], rtol=0.005, atol=0.02)


@pytest.mark.parametrize("line", ["M205 X8", "M201 X100"])
def test_it_says_what_it_does_not_know(line):
    profile = profiles.load("klipper-generic", [POINT])
    assert "Unknown command" in klipper(["G28", line], profile)["log"]
