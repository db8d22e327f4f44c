"""A state machine of grbl that others wrote goes where the check says, in a process of its own.

No grbl itself can be had here as a package; what judges is gcode-machine, of a sender for grbl.
"""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from making import make_grid, make_lines, read_lines

from dialect.flavor import GRBL
from gcode.moves import Kind

PEER = Path(__file__).parent / "peers" / "grbl_machine.py"
PYTHON = os.environ.get("VSLICE_GRBL_PYTHON", "")
SHEET = make_grid([[-45, -20], [30, 90]])
pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        not PYTHON, reason="VSLICE_GRBL_PYTHON names no interpreter of an environment with gcode-machine"
    ),
]


def grbl(lines):
    program = "\n".join(lines) + "\n"
    done = subprocess.run([PYTHON, str(PEER)], input=program, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", ["grbl-pneumatic", "grbl-syringe"])
def test_it_goes_where_the_check_says(name):
    lines = make_lines(SHEET, name)
    found = grbl(lines)
    assert found["unsupported"] == []
    moves = read_lines(lines, flavor=GRBL)
    own = [[m.x_mm, m.depth_mm, m.y_mm] for m in moves if m.kind in (Kind.TRAVEL, Kind.EXTRUDE, Kind.FEED)]
    np.testing.assert_allclose(found["places"], np.nan_to_num(own), atol=1e-9)


def test_it_does_not_take_what_is_written_for_others():
    assert "M83" in grbl(make_lines(SHEET, "marlin-syringe"))["unsupported"]
