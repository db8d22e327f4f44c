"""A dry run of a program for another firmware goes on, and names what the emulated Marlin does not know."""

import pytest

from printer import Job, Settings, StreamError, make_program
from printer.dry_run import dry_run
from printer.ports import open_port

PRINT = ["G28", "G90", "M83", "M302 P1", "G0 X1 Y1 Z1 F600", ";TOOLPATH 0", "G1 X9 E1"]
OF_MARLIN = ["M413 S1", "M122", "G60", "M119", "M412 S1", "M7", "M8", "M9", "M150 R255", "M504", "G27"]
OF_OTHERS = ['M862.3 P "MK3S"', "M566 X600", "G80", "BED_MESH_CLEAR", "PRINT_START BED=60"]


@pytest.mark.parametrize("command", OF_MARLIN)
def test_the_emulated_marlin_knows_what_a_real_one_knows(command):
    report = dry_run(make_program([command, *PRINT])).report
    assert report.refused == ()
    assert report.acknowledged == len(PRINT)  # one line is a comment


def test_a_dry_run_names_the_commands_of_other_firmwares_and_goes_on():
    ended = dry_run(make_program([*OF_OTHERS, *OF_OTHERS, *PRINT]))
    assert ended.report.unknown == tuple(OF_OTHERS)
    assert len(ended.report.refused) == 2 * len(OF_OTHERS)
    assert ended.position["X"] == 9


@pytest.mark.parametrize("command", ["G80", "BED_MESH_CLEAR", "PRINT_START BED=60"])
def test_a_printer_that_does_not_know_what_may_move_or_heat_ends_the_job(command):
    port = open_port("marlin://?clock=fast", 9600)
    with pytest.raises(StreamError, match="which is needed"):
        Job(make_program([command, *PRINT]), port, Settings(boot_wait_s=0.1)).run()


def test_what_only_checks_or_tunes_is_counted():
    port = open_port("marlin://?clock=fast", 9600)
    report = Job(make_program([*OF_OTHERS[:2], *PRINT]), port, Settings(boot_wait_s=0.1)).run()
    assert len(report.refused) == 2
