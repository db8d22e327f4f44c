"""Lines out and replies in, as a real Marlin wants and gives them."""

import pytest
from hypothesis import given
from hypothesis import settings as search
from hypothesis import strategies as st

from printer.commands import make_program
from printer.emulator.lines import kept
from printer.errors import ProtocolError
from printer.protocol import (
    HELLO,
    Action,
    Busy,
    Capability,
    Error,
    Ok,
    Other,
    Position,
    Reading,
    Resend,
    Start,
    Temperature,
    checksum,
    clean,
    fault_of,
    frame,
    parse_reply,
)

TRANSCRIPT = [
    (b"ok\n", Ok()),
    (b"ok", Ok()),
    (b"ok\r\n", Ok()),
    (b"ok N5 P12 B3\n", Ok(5, 12, 3)),
    (b"ok P15 B3\n", Ok(None, 15, 3)),
    (b"ok T:19.38 /0.00 B:19.38 /0.00 @:0 B@:0\n",
     Ok(readings={"T": Reading(19.38, 0), "B": Reading(19.38, 0)})),
    (b"ok X:1.50 Y:0.0 Z:0.0 E:2.0 Count: A:1 B:2 C:3\n", Ok(axes={"X": 1.5, "Y": 0, "Z": 0, "E": 2})),
    (b"ok N1 P4 T:21.30/ 0.00 @:64\n", Ok(1, 4, None, {"T": Reading(21.3, 0)})),
    (b"ok N7 P4 X:1.50 Y:0.0 Count: A:1\n", Ok(7, 4, None, None, {"X": 1.5, "Y": 0})),
    (b"Resend: 2\n", Resend(2)),
    (b"Resend:3\n", Resend(3)),
    (b"Resend:0\n", Resend(0)),
    (b"Resend: \n", Resend(None)),
    (b"rs 7\n", Resend(7)),
    (b"Error:checksum mismatch, Last Line: 1\n", Error("checksum mismatch, Last Line: 1", True, 1)),
    (
        b"Error:Line Number is not Last Line Number+1, Last Line: 2\n",
        Error("Line Number is not Last Line Number+1, Last Line: 2", True, 2),
    ),
    (b"Error: Missing checksum\n", Error("Missing checksum", True)),
    (b"Error:Printer halted. kill() called!\n", Error("Printer halted. kill() called!", False, fatal=True)),
    (b"Error:Heating failed, system stopped! Heater_ID: 0\n",
     Error("Heating failed, system stopped! Heater_ID: 0", False, fatal=True)),
    (b"!! halted\n", Error("!! halted", False, fatal=True)),
    (b"echo:busy: processing\n", Busy("processing")),
    (b"busy:processing\n", Busy("processing")),
    (b"echo:busy processing\n", Busy("processing")),
    (b"Error: expected line 3 got 7\n", Error("expected line 3 got 7", True)),
    (b"echo:busy: paused for user\n", Busy("paused for user")),
    (b" T:27.87 /60.00 B:19.38 /0.00 @:127 B@:0 W:?\n",
     Temperature({"T": Reading(27.87, 60), "B": Reading(19.38, 0)}, waiting=True)),
    (b" T:27.87 /60.00 @:127\n", Temperature({"T": Reading(27.87, 60)}, waiting=False)),
    (b"X:0.00 Y:0.00 Z:5.00 E:0.00 Count X:0 Y:0 Z:2000\n", Position({"X": 0, "Y": 0, "Z": 5, "E": 0})),
    (b"X:-1.50 Y:2.00 Z:5.00 E:0.00 Count X:0 Y:0 Z:2000\n", Position({"X": -1.5, "Y": 2, "Z": 5, "E": 0})),
    (b"Cap:EMERGENCY_PARSER:1\n", Capability("EMERGENCY_PARSER", True)),
    (b"//action:pause\n", Action("pause", "")),
    (b"//action:prompt_begin Insert the syringe\n", Action("prompt_begin", "Insert the syringe")),
    (b"start\n", Start()),
    (b'echo:Unknown command: "FOO"\n', Other('echo:Unknown command: "FOO"')),
    (b"okay, that is no ok\n", Other("okay, that is no ok")),
    (b"started\n", Other("started")),
    (b"\xff\xfe\n", Other("\ufffd\ufffd")),
]  # fmt: skip


@pytest.mark.parametrize(("line", "meaning"), TRANSCRIPT, ids=[repr(line) for line, _ in TRANSCRIPT])
def test_a_reply_means_what_the_transcript_says(line, meaning):
    assert parse_reply(line) == meaning


@search(deadline=None)
@given(st.one_of(st.binary(), st.builds(lambda head, tail: head + tail,
       st.sampled_from([line for line, _ in TRANSCRIPT]), st.binary())))  # fmt: skip
def test_any_bytes_have_a_meaning(line):
    known = Ok | Resend | Error | Busy | Temperature | Action | Start | Position | Capability | Other
    assert isinstance(parse_reply(line), known)


@search(deadline=None)
@given(st.data())
def test_a_damaged_reply_has_a_meaning(data):
    line = bytearray(data.draw(st.sampled_from([line for line, _ in TRANSCRIPT])))
    line[data.draw(st.integers(0, len(line) - 1))] = data.draw(st.integers(0, 255))
    parse_reply(bytes(line))


def test_the_checksums_are_those_of_the_transcript():
    assert frame(1, "M105") == b"N1 M105*38\n"
    assert frame(0, "M110 N0") == HELLO


@search(deadline=None)
@given(st.integers(0, 10**7), st.text(st.characters(codec="utf-8", exclude_characters="\n\r"), max_size=40))
def test_a_framed_line_arrives_with_its_own_checksum(number, text):
    try:
        command = clean(text)
    except ProtocolError:
        return
    if not command or "M110" in command:
        return
    line = frame(number, command)[:-1]
    if len(line) < 90:  # what is longer than the printer's buffer is cut
        content, _, check = kept(line).rpartition(b"*")
        assert int(check) == checksum(content)


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("g1 x3 ; go", "G1 X3"),
        ("  G28\r", "G28"),
        ("; only a comment", ""),
        ("   ", ""),
        ("m117 Hello World ; greet", "M117 Hello World"),
        (r"M117 a\;b ; c", r"M117 a\;b"),
        ("M118 A1 action:pause", "M118 A1 action:pause"),
        ("M0 Fill the Syringe", "M0 Fill the Syringe"),
    ],
)
def test_cleaning_a_line(line, command):
    assert clean(line) == command


def test_an_escape_is_not_part_of_the_checksum():
    assert frame(7, r"M117 a\;b") == b"N7 M117 a\\;b*%d\n" % checksum(b"N7 M117 a;b")


def test_the_longest_line_just_fits():
    room = 95 - len("N1230 *255")
    assert fault_of("M117 " + "x" * (room - 5), 1230) is None
    assert "95" not in (fault_of("M117 " + "x" * (room - 4), 1230) or "")
    assert f"at most {room}" in (fault_of("M117 " + "x" * (room - 4), 1230) or "")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("M117 " + "x" * 100, "105 bytes"),
        ("M117 M110 N77", "M110"),
        ("M110 N5", "M110"),
        ("G1 X1\x00", "binary"),
        ("M117 " + "ä" * 45, "95 bytes"),
    ],
)
def test_a_line_that_marlin_cannot_take_is_refused_with_its_number(line, words):
    with pytest.raises(ProtocolError, match=r"part\.gcode: line 3: .*" + words):
        make_program(["G28", "; comment", line, "G1 X1"], name="part.gcode")
