"""The estimated time against the emulated printer, whose planner shares nothing with it."""

from pathlib import Path

import pytest

import profiles
from gcode.estimate import seconds_of
from gcode.parse import read_moves
from printer import read_program
from printer.dry_run import dry_run
from vslice.commands.send import settings_of
from vslice.terminal.dry_running import motion_of

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))
PROFILES = ["marlin-generic", "marlin-syringe", "marlin-pneumatic"]


def both(path, profile):
    """Seconds of a program as estimated, and as the emulated printer takes, homing and heating apart."""
    ended = dry_run(read_program(path), settings_of(profile), motion=motion_of(profile))
    emulated = ended.time_s - ended.homing_s - ended.heating_s
    return float(seconds_of(read_moves(path, plane=profile.machine.plane), profile).sum()), emulated


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_emulated_printer_takes_what_was_estimated(run, example, name):
    # A wide nozzle cuts this one into tens of thousands of pieces, which take long and show nothing new.
    words = ("--nozzle", "25G") if example.stem == "ihc_16x16" else ()
    assert run(example, "-o", "part.gcode", "-p", name, "--method", "greedy", *words)[0] == 0
    estimated, emulated = both(Path("part.gcode"), profiles.load(name))
    assert estimated == pytest.approx(emulated, rel=0.005)  # 0.03 is promised
    said = next(line for line in Path("part.gcode").read_text().splitlines() if line.startswith(";TIME:"))
    assert int(said[6:]) == pytest.approx(emulated, rel=0.03)


@pytest.mark.parametrize(
    "settings",
    [
        ["motion.firmware_retraction=true"],
        ["machine.junction_deviation_mm=0.2"],
        ["motion.print_speed_mm_s=100.0", "motion.print_acceleration_mm_s2=5000.0"],
        ["machine.max_acceleration_mm_s2=[500.0, 500.0, 20.0, 100.0]"],
        ['machine.plane="YZ"'],
        [
            "machine.junction_deviation_mm=5.0",  # corners are hardly a reason to slow down, lengths are
            "motion.print_speed_mm_s=200.0",
            "machine.max_speed_mm_s=[200.0, 200.0, 200.0, 50.0]",
        ],
        ['gcode.start=["M302 P1", "G28", "M204 P80 T90 R100", "M205 J0.1", "M201 Z30", "M203 X40"]'],
    ],
    ids=lambda settings: settings[0][:40],
)
def test_they_agree_on_other_machines_too(run, settings):
    words = [word for setting in settings for word in ("--set", setting)]
    assert run(EXAMPLES[3], "-o", "part.gcode", "--method", "greedy", *words)[0] == 0
    estimated, emulated = both(Path("part.gcode"), profiles.load("marlin-generic", settings))
    assert estimated == pytest.approx(emulated, rel=0.005)
