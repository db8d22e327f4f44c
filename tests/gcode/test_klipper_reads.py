"""Klipper's own G-code code makes the same moves of our programs as the check, in a process of its own."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.moves import Kind

PEER = Path(__file__).parent / "peers" / "klipper_reads.py"
PYTHON = os.environ.get("VSLICE_KLIPPER_PYTHON", "")
SHEET = make_grid([[-45, -20], [30, 90]])
pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        not PYTHON, reason="VSLICE_KLIPPER_PYTHON names no interpreter of an environment with Klipper"
    ),
]


def klipper(lines):
    program = "\n".join(lines) + "\n"
    done = subprocess.run([PYTHON, str(PEER)], input=program, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", [name for name in profiles.shipped() if name.startswith("klipper")])
@pytest.mark.parametrize(
    "more", [(), ("motion.retract_mm=0.0",), ("motion.firmware_retraction=true",)], ids=str
)
def test_klipper_moves_as_the_check_reads(name, more):
    if name == "klipper-pneumatic" and more:
        pytest.skip("a valve draws nothing back")
    lines = make_lines(SHEET, name, *more)
    found = klipper(lines)
    assert found["said"] == []  # no "Unknown command", no error
    profile = profiles.load(name, [POINT, *more])
    own, e = [], 0.0
    for move in read_lines(lines, flavor=profile.flavor):
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE, Kind.FEED):
            e += move.e_mm
            place = np.nan_to_num([move.x_mm, move.depth_mm, move.y_mm])  # homing ended at 0
            own.append([*place, e, move.speed_mm_s])
    np.testing.assert_allclose(np.array(found["moves"]), np.array(own), atol=1e-9)
    dwells = [move.seconds for move in read_lines(lines, flavor=profile.flavor) if move.kind == Kind.DWELL]
    assert found["dwell"] == pytest.approx(sum(dwells))
    if name == "klipper-pneumatic":
        turns = [value for pin, value in found["pins"] if pin == "valve"]
        assert turns[:2] == [0.0, 1.0]
        assert turns[-1] == 0.0


@pytest.mark.parametrize("command", ["M302 P1", "M201 X500", "M205 X8", "M203 X100"])
def test_klipper_knows_none_of_what_the_check_names(command):
    assert any(command.split()[0] in line for line in klipper([command])["said"])
    code = command.split()[0]
    assert profiles.load("klipper-generic").flavor.unknown(code) == "is no command of Klipper"
