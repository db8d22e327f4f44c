"""Moves that a firmware says it did not make end the job; a printer that lost its position is known to have."""

import pytest
from pump import Bench
from sheet import SAFETY, sheet

from printer import Job, Journal, ResumeError, Settings, State, StreamError
from printer.dry_run import interrupted_printer
from printer.emulator.build import Options
from printer.emulator.firmware import Firmware
from printer.journal import read_journal
from printer.ports import open_port
from printer.records import JobRecord
from printer.resume import plan_resume

NOT_MADE = [
    "Error: G1: target position not reachable from current position",
    "Error: G0: intermediate position outside machine limits",
    "Error: G1: target position is outside the bed",
    "!! Move out of range: 250.000 10.000 5.000 [0.000]",
    "Error:G2/G3 bad parameters",
]
CUT_SHORT = ["echo:endstops hit:  X:10.00", "Error: Endstop Z was hit during a move"]


def saying(words, at=60):
    """A printer that says something at one line, and takes it."""

    class Says(Firmware):
        def _accident(self, number):
            if number == at:
                self.say(words)
            return super()._accident(number)

    return Says(Options())


@pytest.mark.parametrize("words", [*NOT_MADE, *CUT_SHORT])
def test_a_move_that_was_not_made_ends_the_job(words):
    bench = Bench(sheet().commands, Settings(safety=SAFETY), firmware=saying(words))
    assert bench.run() is State.FAILED
    assert words.removeprefix("Error:").strip() in bench.sender.message
    assert bench.sender.window.acknowledged < 62
    assert bench.sender.forgot == (words in CUT_SHORT)


@pytest.mark.parametrize(
    "words",
    [
        "echo:?Target temp out of range",
        "Error: M104 value out of range",
        "echo:x_min: TRIGGERED",
        "echo:endstops: on",
        "echo:Position saved",
        "echo:moves finished within the limits of the area",
    ],
)
def test_what_tells_of_no_move_does_not_end_it(words):
    bench = Bench(sheet().commands, Settings(safety=SAFETY), firmware=saying(words))
    assert bench.run() is State.FINISHED, bench.sender.message


@pytest.mark.parametrize(("fault", "lost"), [("reset", True), ("kill", True), ("disconnect", False)])
def test_a_dry_run_of_resume_refuses_what_the_printer_would_refuse(tmp_path, fault, lost):
    """A job whose journal says that the printer lost its position goes on with a height, in both."""
    program, path = sheet(), tmp_path / "journal"
    journal = Journal(path)
    journal.begin(JobRecord("sheet.gcode", program.sha256, "marlin://", "lab"))
    port = open_port(f"marlin://?clock=fast&fault={fault}@222", 9600)
    settings = Settings(boot_wait_s=0.1, safety=SAFETY)
    with pytest.raises(StreamError):
        Job(program, port, settings, journal=journal).run()
    journal.close()
    job = read_journal(path)
    assert job.lost == lost
    if not lost:
        with interrupted_printer(program, job, settings) as (plan, _):
            assert "G28 X Y" not in plan.before
        return
    with pytest.raises(ResumeError, match="--height"), interrupted_printer(program, job, settings):
        pass
    with pytest.raises(ResumeError, match="--height"):
        plan_resume(program, job, SAFETY, rebooted=False)
    with interrupted_printer(program, job, settings, height_mm=3) as (plan, go_on):
        assert "G28 X Y" in plan.before
        assert go_on(None).report.state is State.FINISHED


def test_a_halt_that_was_asked_for_loses_the_position_too():
    bench = Bench(sheet().commands, Settings(safety=SAFETY))
    bench.run(until=lambda: bench.sender.window.acknowledged > 100)
    bench.sender.abort(bench.firmware.now)
    assert bench.run() is State.KILLED
    assert bench.sender.forgot
