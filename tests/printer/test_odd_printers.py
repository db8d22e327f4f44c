"""Printers that answer in other ways than a common Marlin: each is served, and as quickly."""

import pytest
from pump import Bench

from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import Firmware
from printer.emulator.odd import ODD as ODD_WAYS
from printer.report import State
from printer.settings import Settings

PROGRAM = ["M302 P1", "G91", "M83"] + [
    f"G1 X{k % 7 - 3} E{k % 5 / 100:g} F{6000 + k % 2}" for k in range(300)
]
DAMAGED = range(40, 300, 30)  # nine lines that arrive damaged


class Odd(Firmware):
    """A Marlin whose words ``say_instead`` turns into other bytes."""

    end = b"\n"

    def __init__(self, faults=None, **options):
        self.executed = []
        super().__init__(Options(faults=faults or Faults(), **options))
        run = self.machine.run

        def noted(text):
            self.executed.append(text)
            return run(text)

        self.machine.run = noted

    def say(self, text):
        for line in self.say_instead(text):
            self._output.append((self.now + self.options.delay_s, line.encode() + self.end))

    def say_instead(self, text):
        return [text]


class CarriageReturn(Odd):
    end = b"\r"


class LineFeedFirst(Odd):
    end = b"\n\r"


class BothEnds(Odd):
    end = b"\r\n"


class Capitals(Odd):
    def say_instead(self, text):
        return [text.replace("ok", "OK", 1)] if text.startswith("ok") else [text]


class TemperaturesBehindEveryOk(Odd):
    def say_instead(self, text):
        return ["ok T:200.0 /200.0 B:60.0 /60.0 @:0"] if text == "ok" else [text]


class NoOkBehindResend(Odd):
    def say_instead(self, text):
        if text.startswith("Resend"):
            self.mute = True
        elif text == "ok" and getattr(self, "mute", False):
            self.mute = False
            return []
        return [text]


class NoSensors(Odd):
    def say_instead(self, text):
        if text.startswith("ok T:"):
            return ["Error:No thermistors - no temperature", "ok"]
        return [text]


class NoTemperaturesAtAll(Odd):
    def say_instead(self, text):
        return ["ok"] if text.startswith("ok T:") else [text]


class PositionBehindOk(NoSensors):
    """As Smoothieware: the position stands behind the ok."""

    def say_instead(self, text):
        if text.startswith("X:"):
            self.place = text
            return []
        if text == "ok" and getattr(self, "place", ""):
            place, self.place = self.place, ""
            return [f"ok C: {place}"]
        return super().say_instead(text)


class TellsNoPosition(NoOkBehindResend):
    """M114 is answered with ok alone, and no ok follows a resend: what is proved hangs on M105 alone."""

    def say_instead(self, text):
        return [] if text.startswith("X:") else super().say_instead(text)


class LateStart(Odd):
    def say_instead(self, text):
        return ["Error:EEPROM datasize error.", "start"] if text == "start" else [text]


ODD = [
    Odd, CarriageReturn, LineFeedFirst, BothEnds, Capitals, TemperaturesBehindEveryOk, NoOkBehindResend, NoSensors,
    NoTemperaturesAtAll, PositionBehindOk, LateStart, TellsNoPosition,
]  # fmt: skip


def run(kind, window_lines=4, damaged=DAMAGED):
    faults = Faults()
    for number in damaged:
        faults.script(f"resend@{number}")
    bench = Bench(PROGRAM, Settings(window_lines=window_lines), firmware=kind(faults))
    state = bench.run()
    bench.settle()
    return bench, state


def of_program(executed):
    own = ("M115", "M105", "M114", "M400", "M110")
    return [command for command in executed if not command.startswith(own)]


@pytest.mark.parametrize("kind", ODD)
@pytest.mark.parametrize("window_lines", [1, 4])
def test_each_line_once_and_every_damaged_one_is_mended_in_less_than_a_second(kind, window_lines):
    plain, _ = run(Odd, window_lines, damaged=())
    bench, state = run(kind, window_lines)
    assert state is State.FINISHED, bench.sender.message
    assert of_program(bench.firmware.executed) == PROGRAM
    assert bench.sender.window.resent >= len(DAMAGED)
    extra_s = bench.firmware.now - plain.firmware.now
    greeting_s = 3 * bench.sender.settings.probe_after_s if kind is NoTemperaturesAtAll else 0.5
    assert extra_s - greeting_s < 0.5 * len(DAMAGED)


def test_recovery_is_twenty_times_faster_than_a_silence_where_no_ok_follows_a_resend():
    plain, _ = run(Odd, damaged=())
    bench, _ = run(NoOkBehindResend)
    assert bench.firmware.now - plain.firmware.now < 3.0 * len(DAMAGED) / 20


def test_a_board_without_sensors_has_unknown_temperatures():
    bench, state = run(NoSensors)
    assert state is State.FINISHED
    assert bench.sender.printer_status.temperatures == {}
    assert any("temperatures are unknown" in warning for warning in bench.sender.printer_status.warnings)


class SilentDwell(Odd):
    """No word while a dwell lasts."""

    def __init__(self, faults=None, **options):
        super().__init__(faults, **options)
        self.machine.keepalive_s = 0.0


def test_a_dwell_of_forty_seconds_on_a_printer_that_keeps_silent():
    from printer.busy_times import durations

    program = [*PROGRAM[:50], "G4 S40", *PROGRAM[50:]]
    bench = Bench(program, firmware=SilentDwell())
    bench.sender.busy_times.blocks_s = durations(program)
    assert bench.run() is State.FINISHED, bench.sender.message
    assert of_program(bench.firmware.executed) == program


class LosesItsPlace(Odd):
    """It is reset at line 150, and nobody hears it say so."""

    def say_instead(self, text):
        if self.last_number == 0 and not text.startswith(("Error", "Resend", "ok")):
            return [] if getattr(self, "silent", False) else [text]
        return [text]

    def _accident(self, number):
        if number == 150 and not getattr(self, "silent", False):
            self.silent = True
            self.machine.planner.advance(self.now)
            self.boot()
            return True
        return super()._accident(number)


@pytest.mark.parametrize("command_s", [0.0, 0.05])
def test_a_printer_that_was_reset_unheard_ends_the_job_with_nothing_printed_twice(command_s):
    bench = Bench(PROGRAM, firmware=LosesItsPlace(command_s=command_s))
    assert bench.run() is State.FAILED
    assert "asks for line 1, although it has taken" in bench.sender.message
    done = of_program(bench.firmware.executed)
    assert done == PROGRAM[: len(done)]


class AsksForAnOldLine(Odd):
    """At line 153 it asks for line 20, and would take it."""

    def _accident(self, number):
        if number == 153 and not getattr(self, "asked", False):
            self.asked = True
            self.last_number = 19
            self._refuse("Line Number is not Last Line Number+1")
            return True
        return super()._accident(number)


def test_a_printer_that_asks_for_an_old_line_ends_the_job_with_nothing_printed_twice():
    bench = Bench(PROGRAM, firmware=AsksForAnOldLine())
    assert bench.run() is State.FAILED
    assert "asks for line 20, although it has taken" in bench.sender.message
    done = of_program(bench.firmware.executed)
    assert done == PROGRAM[: len(done)]


# --- the same printers as options of the emulator ------------------------------------------------------


@pytest.mark.parametrize("way", ODD_WAYS)
def test_every_odd_printer_of_the_emulator_is_served(way):
    faults = Faults()
    for number in DAMAGED:
        faults.script(f"resend@{number}")
    firmware = Firmware(Options(faults=faults, odd=frozenset({way})))
    program = [*PROGRAM[:20], "M109 S60", *PROGRAM[20:]]
    bench = Bench(program, firmware=firmware)
    state = bench.run()
    bench.settle()
    assert state is State.FINISHED, bench.sender.message
    plain = Bench(program)
    plain.run()
    plain.settle()
    assert firmware.path.count == plain.firmware.path.count
    assert firmware.path.material == plain.firmware.path.material


def test_an_odd_printer_says_what_its_way_says():
    def said(way, *commands):
        firmware = Firmware(Options(odd=frozenset({way})))
        firmware.read()
        for command in commands:
            firmware.receive(command.encode() + b"\n")
            firmware.advance(firmware.now + 8)
        return firmware.read()

    assert said("cr", "M110") == b"ok\r"
    assert said("cr-lf", "M110") == b"ok\r\n"
    assert said("lf-cr", "M110") == b"ok\n\r"
    assert said("capital-ok", "M110") == b"OK\n"
    assert said("temperatures-behind-ok", "M110") == b"ok T:200.0 /200.0 B:60.0 /60.0 @:0\n"
    assert said("no-ok-behind-resend", "N5 M105*1").endswith(b"Resend: 1\n")
    assert said("no-sensors", "M105") == b"Error:No thermistors - no temperature\nok\n"
    assert said("silent", "G4 S6") == b"ok\n"
    assert b"\nT:" in said("temperatures-while-heating", "M105", "M109 S90")
