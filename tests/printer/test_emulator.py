"""The emulated printer answers as the natively built Marlin of docs/streaming.md did, line by line."""

import pytest
import serial

import printer  # noqa: F401 - teaches pyserial marlin://
from printer.emulator.build import Options
from printer.emulator.faults import Faults
from printer.emulator.firmware import BOOT, Firmware
from printer.emulator.planner import Move
from printer.errors import PrinterError
from printer.protocol import frame


class Talk:
    """Send lines, get the replies as a list."""

    def __init__(self, **options):
        self.firmware = Firmware(Options(**options))
        self.firmware.read()

    def __call__(self, *lines: bytes, wait: float = 0.0) -> list[str]:
        for line in lines:
            self.firmware.receive(line + b"\n")
        self.firmware.advance(self.firmware.now + wait)
        return self.firmware.read().decode().splitlines()


@pytest.fixture
def talk():
    return Talk()


def numbered(talk, *commands, first=1):
    return talk(*(frame(first + k, command)[:-1] for k, command in enumerate(commands)))


def test_boot():
    assert Firmware().read().decode().splitlines() == list(BOOT)


def test_numbering_and_temperatures(talk):
    assert talk(b"N0 M110 N0*125") == ["ok"]
    assert talk(b"N1 M105*38") == ["ok T:20.00 /0.00 B:20.00 /0.00 @:0 B@:0"]


def test_a_bad_checksum(talk):
    talk(b"N1 M105*38")
    assert talk(b"N2 M105*99") == ["Error:checksum mismatch, Last Line: 1", "Resend: 2", "ok"]


def test_a_number_too_high(talk):
    numbered(talk, "M105", "M105")
    assert talk(frame(5, "M105")[:-1]) == [
        "Error:Line Number is not Last Line Number+1, Last Line: 2",
        "Resend: 3",
        "ok",
    ]


def test_no_checksum(talk):
    numbered(talk, "M105", "M105")
    assert talk(b"N3 M105") == ["Error:No Checksum with line number, Last Line: 2", "Resend: 3", "ok"]


def test_the_last_two_lines_again_are_dropped_in_silence_and_older_ones_are_not(talk):
    numbered(talk, *["M105"] * 5)
    assert talk(frame(5, "M105")[:-1]) == []
    assert talk(frame(4, "M105")[:-1]) == []
    assert talk(frame(3, "M105")[:-1])[1:] == ["Resend: 6", "ok"]


def test_busy_every_two_seconds(talk):
    assert talk(b"G4 P2500", wait=3) == ["echo:busy: processing", "ok"]
    assert talk(b"M113 S1", b"G4 S3.5", wait=4) == ["ok", *["echo:busy: processing"] * 3, "ok"]


def test_waiting_for_a_heater_reports_each_second(talk):
    replies = talk(b"M109 S60", wait=60)
    assert replies[0].startswith(" T:")
    assert replies[0].endswith("W:?")
    assert replies[-1] == "ok"
    assert "echo:busy: processing" not in replies
    readings = [float(reply.split(":")[1].split()[0]) for reply in replies[:-1]]
    assert readings == sorted(readings)
    assert readings[-1] == pytest.approx(60, abs=0.5)


def test_automatic_temperature_reports(talk):
    assert talk(b"M155 S1", wait=2.5) == ["ok", *[" T:20.00 /0.00 B:20.00 /0.00 @:0 B@:0"] * 2]


def test_position_is_the_planned_one(talk):
    assert talk(b"G1 X10 Z5 F60", b"M114") == [
        "ok",
        "X:10.00 Y:0.00 Z:5.00 E:0.00 Count X:800 Y:0 Z:2000",
        "ok",
    ]
    assert talk.firmware.path.count == 0


def test_capabilities(talk):
    replies = talk(b"M115")
    assert replies[0].startswith("FIRMWARE_NAME:Marlin")
    assert "Cap:EMERGENCY_PARSER:0" in replies
    assert replies[-1] == "ok"


def test_homing_takes_28_seconds(talk):
    assert talk(b"G28", wait=27.9) == ["echo:busy: processing"] * 13
    assert talk(wait=0.2)[-1] == "ok"


def test_cold_extrusion_moves_without_material(talk):
    assert talk(b"G1 X1 E5 F600", wait=1) == ["echo: cold extrusion prevented", "ok"]
    assert talk.firmware.path.moves == [Move(1, 0, 0, 0)]
    assert talk(b"M302 P1", b"G1 X2 E6", wait=1) == ["ok", "ok"]
    assert talk.firmware.path.material == 1


def test_material_that_is_drawn_back_and_fed_again_counts_once(talk):
    program = [b"M302 P1", b"M83", b"G1 X1 E3 F6000", b"G1 E-1", b"G1 X2", b"G1 E1", b"G1 X3 E2", b"G1 E-1"]
    talk(*program, wait=5)
    assert talk.firmware.path.material == 5


@pytest.mark.parametrize("line", [b"FOO", b"g1 x3"])
def test_unknown_commands_are_acknowledged(talk, line):
    assert talk(line) == [f'echo:Unknown command: "{line.decode()}"', "ok"]


@pytest.mark.parametrize("line", [b"", b"  ", b"; a comment"])
def test_lines_without_a_command_are_not_answered(talk, line):
    assert talk(line) == []


def test_advanced_ok():
    talk = Talk(advanced_ok=True)
    assert numbered(talk, "G1 X1 F60") == ["ok N1 P14 B3"]
    assert talk(b"G21") == ["ok P14 B3"]
    assert talk(b"M105")[0].startswith("ok T:")


def test_m112_and_silence_after_it(talk):
    assert talk(b"M112") == ["echo:M112 Shutdown", "Error:Printer halted. kill() called!"]
    assert talk(b"M105", wait=100) == []


def test_m112_waits_for_room_without_the_emergency_parser_and_not_with_it():
    dwells = [frame(k, "G4 S3")[:-1] for k in (1, 2, 3, 4)]
    assert Talk()(*dwells, b"M112") == []
    assert Talk()(*dwells, b"M112", wait=3.1)[-1] == "Error:Printer halted. kill() called!"
    assert Talk(emergency_parser=True)(*dwells, b"M112")[-1] == "Error:Printer halted. kill() called!"


def test_m410_drops_what_was_planned(talk):
    talk(b"G1 X60 F60", b"G1 X120", wait=1)
    talk(b"M410")
    talk(wait=200)
    assert talk.firmware.path.count == 0


def test_host_prompts(talk):
    assert talk(b"M118 A1 action:pause") == ["//action:pause", "ok"]
    assert talk(b"M0 Fill it", wait=1) == [
        "echo:Fill it",
        "//action:prompt_begin Fill it",
        "//action:prompt_button Continue",
        "//action:prompt_show",
    ]
    assert talk(wait=1.5) == ["echo:busy: paused for user"]
    assert talk(b"M108") == ["//action:prompt_end", "ok", "ok"]


def test_m110_in_any_numbered_line_sets_the_counter(talk):
    numbered(talk, "M117 M110 N77")
    assert talk.firmware.last_number == 77


def test_sixteen_moves_are_planned_and_the_next_waits(talk):
    numbered(talk, *[f"G1 X{k} F60" for k in range(1, 17)])
    assert talk(frame(17, "G1 X17")[:-1]) == []
    assert talk(wait=1.01) == ["ok"]


def test_four_commands_are_queued_and_then_the_receive_buffer_overruns(talk):
    lines = [frame(k, "G4 S9")[:-1] for k in range(1, 5)]
    assert talk(*lines) == []
    talk(b"x" * 127)
    assert talk.firmware.bytes_lost == 0
    talk(b"yz")
    assert talk.firmware.bytes_lost == 3


def test_an_error_flushes_the_receive_buffer(talk):
    talk.firmware.receive(b"N7 M105*1\n" + frame(1, "G21"))
    assert talk() == ["Error:Line Number is not Last Line Number+1, Last Line: 0", "Resend: 1", "ok"]
    assert talk.firmware.last_number == 0


@pytest.mark.parametrize(
    ("kind", "replies"),
    [
        ("resend", ["Error:checksum mismatch, Last Line: 1", "Resend: 2", "ok"]),
        ("resend-of-unknown-line", ["Error:checksum mismatch, Last Line: 1", "Resend: 1002", "ok"]),
        ("reset", list(BOOT)),
        (
            "kill",
            ["Error:Heating failed, system stopped! Heater_ID: 0", "Error:Printer halted. kill() called!"],
        ),
        ("silence", []),
    ],
)
def test_scripted_faults(kind, replies):
    faults = Faults()
    faults.script(f"{kind}@2")
    talk = Talk(faults=faults)
    numbered(talk, "G21")
    assert numbered(talk, "G21", first=2) == replies
    assert faults.at_line(2) is None


def test_a_fault_that_does_not_exist_is_refused():
    with pytest.raises(PrinterError, match="KIND@LINE"):
        Faults().script("fire@3")


def test_byte_faults_come_at_their_rate_and_again_with_the_same_seed():
    def damaged(seed):
        faults = Faults(seed=seed, corrupt=0.01, drop=0.01)
        return b"".join(faults.to_printer(bytes(100)) for _ in range(1000))

    assert damaged(3) == damaged(3) != damaged(4)
    dropped = 100_000 - len(damaged(3))
    changed = sum(byte != 0 for byte in damaged(3))
    assert dropped == pytest.approx(1000, rel=0.15)
    assert changed == pytest.approx(1000, rel=0.15)


def test_a_port_for_pyserial():
    with serial.serial_for_url("marlin://?clock=fast", timeout=5) as port:
        assert port.read_until(b"start\n") == b"start\n"
        port.write(b"G4 S100\n")
        port.read_until(b"ok\n")
        assert port.clock() >= 100


def test_a_named_printer_stays_on_when_the_port_is_closed():
    url = "marlin://kept?clock=fast"
    with serial.serial_for_url(url, timeout=1) as port:
        port.write(b"G1 X5 F6000\nM400\n")
        port.read_until(b"ok\nok\n")
    with serial.serial_for_url(url, timeout=1) as port:
        assert port.firmware.path.moves == [Move(5, 0, 0, 0)]


def test_an_unknown_option_is_refused():
    with pytest.raises(serial.SerialException, match="corrpt"):
        serial.serial_for_url("marlin://?corrpt=1")
