"""A print that was stopped and resumed, replayed with the nozzle's body: lift, way over, descent and the rest."""

import re
from pathlib import Path

import pytest

from gcode.check import check
from gcode.parse import read_moves
from printer.commands import read_program
from printer.records import Entry, JobRecord
from printer.replay import drawn_back
from printer.resume import plan_resume
from printer.safety import leave
from vslice import api
from vslice.commands.send import settings_of

SHEET = '{"tile_mm": 2.0, "spacing_mm": 0.4, "angles_deg": [[-80, 0, 35], [0, -75, 88]]}'
NO_MOVE = re.compile(r"M(104|109|140|190|84|400)\b")


@pytest.mark.parametrize("machine", ["marlin-generic", "marlin-syringe"])
def test_the_body_is_clear_on_the_way_back_wherever_a_job_was_stopped(machine, tmp_path):
    grid, part, whole = tmp_path / "grid.json", tmp_path / "part.gcode", tmp_path / "whole.gcode"
    grid.write_text(SHEET)
    # Uphill alone: a tip that has come down stands in its own bead, which the check excuses but after a stop.
    settings = ["motion.join_spacings=2", "nozzle.downhill_deg=0"]
    made = api.slice_grid(grid, machine, nozzle="22G", settings=settings, method="greedy")
    api.write_program(made, part)
    program, profile = read_program(part), made.profile
    assert len(program.starts) > len(program.toolpaths) + 2, "some hops are extruded"
    safety = settings_of(profile).safety
    height = ";HEIGHT:0.4"
    stops = {*range(program.toolpaths[2], len(program) - 8, 5), *program.starts[2:]}
    for stop in sorted(stops):
        entry = Entry(JobRecord("", program.sha256, "", ""), program.acknowledged_line(stop), "stopped")
        plan = plan_resume(program, entry, safety, rebooted=False)
        left = leave(safety, drawn_back(program.commands, stop))
        lines = [*program.commands[:stop], *left, *plan.before, *program.commands[plan.start_at :]]
        whole.write_text("\n".join([height, *(line for line in lines if not NO_MOVE.match(line))]) + "\n")
        moves = read_moves(Path(whole), plane=profile.machine.plane, flavor=profile.flavor)
        wrong = [v for v in check(moves, profile).violations if v.kind in ("nozzle", "collision")]
        assert not wrong, (stop, program.commands[stop - 1], str(wrong[0]))
