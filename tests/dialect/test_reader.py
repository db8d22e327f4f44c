"""One reader: every form of a program has the same commands, for whoever reads it."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dialect import numbers
from dialect.errors import ReadError
from dialect.reader import checksum, clean, read
from dialect.source import MAX_BYTES, from_bytes, load_stream
from gcode.errors import ParseError
from gcode.parse import parse, read_moves
from printer.commands import make_program, read_program
from printer.errors import ProtocolError

COMMANDS = ["G28", "G1 X10.5 E0.1 F600", "G0 Z-0.25", "M104 S200", "G29 A", "M117 Hi (You)", "M83", "M400"]
NOTES = [b"", b";caf\xe9", "; \u2028 \x85 G1 X9".encode(), b"; a (b", b" ;\x0c\x0b", "; ä (*) \\".encode()]


@st.composite
def written(draw, command):
    """A command in one of its forms, as bytes without a line end."""
    text = command
    if not command.startswith("M117"):
        if draw(st.booleans()):
            text = text.lower()
        blank = draw(st.sampled_from([" ", "  ", "\t", ""]))
        text = text.replace(" ", blank)
        if draw(st.booleans()):
            text = f"{text} (note (*;\\) " if draw(st.booleans()) else f"(G1 X7) {text}"
    data = text.encode()
    if draw(st.booleans()):
        data = b"N%d %s" % (draw(st.integers(0, 9999)), data)
        if draw(st.booleans()):
            data += b"*%d" % checksum(data)
    return draw(st.sampled_from([b"", b"  ", b"\t"])) + data + draw(st.sampled_from(NOTES))


@st.composite
def programs(draw):
    """(commands, bytes of a file that says them)."""
    commands = draw(st.lists(st.sampled_from(COMMANDS), max_size=8))
    end = draw(st.sampled_from([b"\n", b"\r\n", b"\r"]))
    lines = [draw(written(command)) for command in commands]
    for _ in range(draw(st.integers(0, 3))):
        lines.insert(
            draw(st.integers(0, len(lines))), draw(st.sampled_from([b"", b"  ", b";x", b"(x)", b"%"]))
        )
    return commands, draw(st.sampled_from([b"", b"\xef\xbb\xbf"])) + end.join(lines) + draw(
        st.sampled_from([b"", end])
    )


@settings(max_examples=300, deadline=None)
@given(programs())
def test_every_form_of_a_program_has_the_same_commands(program):
    commands, data = program
    source = from_bytes(data, "part.gcode")
    assert [line.command for line in read(source.lines) if line.command] == commands
    assert read_program(source).commands == commands
    assert [move.line for move in read_moves(source) if move.text == "G28"] == [
        line for line, command in zip(read_program(source).lines, commands, strict=True) if command == "G28"
    ]


@settings(max_examples=500, deadline=None)
@given(st.lists(st.text("GMNTXYZEFPS0123456789.-+*;()\\ \tgxe\u2028é\x0b", max_size=25), max_size=4))
def test_what_one_refuses_the_other_refuses_in_the_same_words(lines):
    said = []
    for reading, refusal in (
        (lambda: list(parse(lines, name="p")), ParseError),
        (lambda: make_program(lines, name="p"), ProtocolError),
    ):
        try:
            reading()
            said.append(None)
        except refusal as error:
            said.append(str(error))
    assert said[0] == said[1]


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("g01 x 1y+.5", "G1 X1 Y+.5"),
        ("G01.0 X1", "G1 X1"),
        ("G1\tX1", "G1 X1"),
        ("M104S200", "M104 S200"),
        ("G28 X", "G28 X"),
        ("G29 A", "G29 A"),
        ("m117 Hello (World) ; x", "M117 Hello (World)"),
        (r"M117 a\;b ; c", r"M117 a\;b"),
        ("M486 AName", "M486 ANAME"),
        ('M862.3 P "Mk3"', 'M862.3 P "Mk3"'),
        ("start_print Bed=60", "START_PRINT Bed=60"),
        ("N3", ""),
        ("N3G1 X1", "G1 X1"),
        ("g1x1e3", "G1 X1 E3"),
        ("M117 é", "M117 é"),
    ],
)
def test_a_line_has_one_form(line, command):
    assert clean(line) == command


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("G1 X1e-05", "has an exponent"),
        ("G1 X--5", "is no word"),
        ("G1 X 1 0", "is no word"),
        ("G1 X10Y", "Y has no number"),
        ("G1 X", "X has no number"),
        ("G4 P", "P has no number"),
        ("G92 E", "E has no number"),
        ("G1 X1 X2", "X stands twice"),
        ("M104 S0 S200", "S stands twice"),
        ("M220 S0 S100", "S stands twice"),
        ("M205 X5 S0 X8", "X stands twice"),
        ('M104 S0 "S200"', "is no word of a letter and a number"),
        ("M106 S255 fan!", "is no word of a letter and a number"),
        ("G90 G1 X1", "G1 in the same line"),
        ("G53 G1 X1", "G1 in the same line"),
        ("M83 G1 X1", "G1 in the same line"),
        ("G1 X1*4*5", "its text gives"),
        ("G1 X1*", "is no checksum"),
        ("N G1 X1", "no G-code command"),
        ("N-1 G1 X1", "has words but no G0"),
        ("NG1 X1", "no G-code command"),
        ("/G1 X1", "no G-code command"),
        ("@pause", "no G-code command"),
        ("A5", "has words but no G0"),
        ("T-1", "has words but no G0"),
        ("G1 (a (b) c) X1", "no other half"),
        ("G1 (a X1", "no other half"),
        (r"G1 \X1", "backslash"),
        ("G1 X\u0661", "is no letter of G-code"),
        ("G1 X1\x0c", "control character"),
        ("G1 X1\x0b", "control character"),
        ("G1 X1\x08", "control character"),
        ("G1 X1\u2028Y2", "is no letter of G-code"),
        ("G1 X1\x85Y2", "is no letter of G-code"),
        ("G1 X1234567890", "more than 9 digits"),
        ("M117 M110", "M110"),
        ("M117 " + "x" * 95, "Marlin takes at most"),
        ("G1 X1\0", "binary"),
        ("G1 ; " + "x" * 100_001, "binary or has"),
    ],
)
def test_what_marlin_would_skip_or_guess_is_refused(line, says):
    with pytest.raises(ReadError, match=says):
        clean(line)


class Endless:
    def __init__(self, what):
        self.what, self.given = what, 0

    def read(self, count):
        self.given += count
        assert self.given < 2 * MAX_BYTES
        return self.what * (count // len(self.what))


@pytest.mark.parametrize(
    ("what", "says"), [(b"\0", "is zero"), (b"G1 X1;   \n", "more than 128 MB"), (b"\xff\xfe", "UTF-16")]
)
def test_an_endless_device_ends_in_words(what, says):
    with pytest.raises(ReadError, match=f"dev: .*{says}"):
        load_stream(Endless(what), "dev")


@pytest.mark.parametrize(
    ("data", "says"),
    [("G28\n".encode("utf-16"), "UTF-16"), ("G28\n".encode("utf-16-le"), "zero"), (b' {"a": 1}', "JSON")],
)
def test_what_is_no_program_is_named(data, says):
    with pytest.raises(ReadError, match=says):
        from_bytes(data, "part.gcode")


@given(st.floats(-1e6, 1e6), st.integers(0, 9))
def test_numbers_have_no_exponent_and_no_negative_zero(value, decimals):
    for text in (
        numbers.fixed(value, decimals),
        numbers.plain(value, decimals),
        numbers.position(value),
        numbers.feed(value),
        numbers.rate(abs(value)),
    ):
        assert "e" not in text.lower()
        assert clean(f"G29 X{text}")
        assert not (text.startswith("-") and float(text) == 0)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_is_no_number_is_never_written(value):
    with pytest.raises(ValueError, match="cannot be written"):
        numbers.plain(value)
