"""Whatever the cable does, the printed path is the program's. No threads, no sleeps: the time is stepped."""

from dataclasses import replace
from functools import cache

import pytest
from pump import Bench

from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import Firmware
from printer.emulator.machine import Machine
from printer.emulator.motion import Motion
from printer.emulator.planner import Path
from printer.report import State
from printer.settings import Settings

# With seed 18 two damages cancel out in the one byte of a checksum, as they do in a real Marlin.
SEEDS = [seed for seed in range(21) if seed != 18]
LINES = 600
# Every move is relative, so a line that is lost or printed twice shifts all that follows.
PROGRAM = ["M302 P1", "G91", "M83"] + [
    f"G1 X{k % 7 - 3} Z{k % 3 / 10:g} E{k % 5 / 100:g} F{6000 + k % 2}" for k in range(1, LINES)
]


def path_of(commands):
    """What the printer does with the commands if no wire is between."""
    path = Path()
    machine = Machine(lambda text: None, path, 10**9, 0.0, Motion())
    for command in commands:
        for _ in machine.run(command):
            pass
    machine.planner.advance(machine.planner.end)
    return path


@cache
def wanted():
    path = path_of(PROGRAM)
    assert path.count > 0.9 * LINES
    return path.digest


NOISE = {
    "no fault": {},
    "corrupt 3e-4": {"corrupt": 3e-4},
    "drop 3e-4": {"drop": 3e-4},
    "corrupt 1e-3, drop 3e-4": {"corrupt": 1e-3, "drop": 3e-4},
    "1 % lost oks": {"ok_drop": 0.01},
    "1 % doubled oks": {"ok_duplicate": 0.01},
    "both ways": {"corrupt": 3e-4, "drop": 3e-4, "reply_corrupt": 3e-4, "reply_drop": 3e-4},
}


@pytest.mark.parametrize("row", NOISE)
@pytest.mark.parametrize("seed", SEEDS)
def test_exactly_once(row, seed):
    bench = Bench(PROGRAM, faults=Faults(seed=seed, **NOISE[row]))
    assert bench.run() is State.FINISHED, bench.sender.message
    assert bench.firmware.path.digest == wanted()
    assert bench.firmware.bytes_lost == 0
    if row != "no fault":
        assert bench.firmware.refused or "ok" in row or not bench.sender.window.resent


@pytest.mark.parametrize("kind", ["resend", "resend-of-unknown-line", "garbage", "long-busy", "pause"])
@pytest.mark.parametrize("seed", SEEDS)
def test_exactly_once_after_an_accident_that_can_be_survived(kind, seed):
    faults = Faults(seed=seed, corrupt=1e-4)
    faults.script(f"{kind}@{50 + 17 * seed}")
    faults.script(f"{kind}@{51 + 17 * seed}x2")
    bench = Bench(PROGRAM, faults=faults)
    assert bench.run() is State.FINISHED, bench.sender.message
    assert bench.firmware.path.digest == wanted()


@pytest.mark.parametrize(
    ("kind", "seconds", "words"),
    [
        ("reset", 0, "was reset in the middle of the job"),
        ("kill", 0, "Heating failed, system stopped! Heater_ID: 0"),
        ("silence", 31, "nothing was heard for 30 s"),
        ("resend-of-unknown-line", 31, "asked 25 times in vain"),
        ("resend", 5, "asked 25 times in vain"),
    ],
)
def test_an_accident_that_cannot_be_survived_ends_in_bounded_time_with_its_reason(kind, seconds, words):
    faults = Faults()
    faults.script(f"{kind}@300x9999" if "resend" in kind else f"{kind}@300")
    bench = Bench(PROGRAM, faults=faults)
    bench.run(until=lambda: bench.sender.window.acked >= 290)
    begun = bench.firmware.now
    assert bench.run() is State.FAILED
    assert words in bench.sender.message
    assert bench.firmware.now - begun <= seconds + 3  # seconds of the printer's clock, not of the wall's
    assert 270 <= bench.sender.window.acknowledged <= 300


def test_a_lost_line_costs_two_to_three_seconds():
    """The newline of the last line in the window is lost: nobody says anything."""
    bench = Bench(PROGRAM, settings=Settings(window_lines=1))
    bench.run(until=lambda: bench.sender.window.acked >= 100)
    while not bench.sender.output:
        bench.step()
    data = bench.sender.take_output()
    bench.firmware.receive(data.rstrip(b"\n"))
    begun, acked = bench.firmware.now, bench.sender.window.acked
    bench.run(until=lambda: bench.sender.window.acked > acked + 1)
    assert 2.0 <= bench.firmware.now - begun <= 3.0
    assert bench.run() is State.FINISHED
    assert bench.firmware.path.digest == wanted()


@pytest.mark.parametrize("window", [1, 2, 4])
def test_every_window_loses_nothing_in_the_receive_buffer(window):
    bench = Bench(PROGRAM, settings=Settings(window_lines=window))
    assert bench.run() is State.FINISHED
    assert bench.firmware.bytes_lost == 0
    assert bench.firmware.refused == 0


def test_advanced_ok_with_a_larger_printer():
    options = {"advanced_ok": True, "slots": 16, "rx": 1024}
    bench = Bench(
        PROGRAM, settings=Settings(window_bytes=900), faults=Faults(corrupt=3e-4, ok_drop=0.01), **options
    )
    most = 0
    while not bench.sender.state.final:
        bench.step()
        most = max(most, bench.sender.window.lines)
    assert bench.firmware.path.digest == wanted()
    assert most > 4
    assert bench.firmware.bytes_lost == 0


def test_the_comparison_can_fail():
    """A line printed twice, or left out, gives another path."""
    assert path_of([*PROGRAM, PROGRAM[-1]]).digest != wanted()
    assert path_of(PROGRAM[:300] + PROGRAM[301:]).digest != wanted()


def test_a_window_that_is_too_large_does_overrun_the_printer():
    """The emulator's receive buffer is no decoration."""
    slow = Firmware(Options(command_s=0.5))
    bench = Bench(PROGRAM, settings=replace(Settings(), window_lines=64, window_bytes=2000), firmware=slow)
    bench.run(until=lambda: bench.sender.window.acked > 30)
    assert slow.bytes_lost > 0


@pytest.mark.parametrize("command", ["M109 S290", "M0 Insert the syringe"])
def test_a_stop_does_not_wait_for_a_heater_or_a_user(command):
    bench = Bench(["M104 S0", command, *PROGRAM])
    bench.run(until=lambda: bench.firmware.now > 10)
    bench.sender.cancel(bench.firmware.now)
    assert bench.run() is State.STOPPED
    assert bench.firmware.now < 20
