"""Programs on standard input and from devices, and numbers that leave, on the command line."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from making import make_grid, make_lines

import profiles
from dialect.reader import clean
from printer.safety import extrusion, feed, feed_of, number
from vslice.commands.send import settings_of

SHEET = make_grid([[-45, -20]], spacing=0.25)


def vslice(*arguments, stdin=b""):
    return subprocess.run(
        [sys.executable, "-c", "from vslice.cli import main; main()", *arguments],
        input=stdin,
        capture_output=True,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="module")
def program():
    return "\n".join(make_lines(SHEET)).encode()


def test_check_reads_standard_input(program):
    ended = vslice("check", "-", stdin=program)
    assert (ended.returncode, ended.stdout) == (0, b"")
    assert b"no violations" in ended.stderr
    assert vslice("check", "-", stdin=b"G1 X").returncode == 2


def test_preview_reads_standard_input_and_wants_a_name(program, tmp_path):
    picture = tmp_path / "part.png"
    assert vslice("preview", "-", "-o", str(picture), stdin=program).returncode == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    nameless = vslice("preview", "-", stdin=program)
    assert (nameless.returncode, b"give -o" in nameless.stderr) == (2, True)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there are no such devices here")
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/urandom"])
def test_an_endless_device_ends_with_words(device):
    for ended in (vslice("check", device), vslice("send", device, "--dry-run", "-p", "marlin-generic")):
        assert ended.returncode == 2
        assert re.search(rb"is no text|UTF-16|is no ordinary", ended.stderr)


LEAVES = re.compile(r"[GM][0-9]+(?: [A-Z](?:-?[0-9]+(?:\.[0-9]+)?)?)*")
TINY = st.floats(1e-5, 20).map(lambda value: float(f"{value:.3g}"))


@settings(max_examples=60, deadline=None)
@given(TINY, TINY, st.floats(0.01, 20))
def test_no_emitter_writes_an_exponent(retract, temperature, speed):
    profile = profiles.load(
        "marlin-generic",
        [
            f"motion.retract_mm={retract!r}",
            f"motion.retract_speed_mm_s={speed!r}",
            f"material.nozzle_temperature_c={temperature!r}",
        ],
    )
    leaving = settings_of(profile).safety
    shown = profiles.render(profile.gcode.start, profile.values)
    lines = [
        *leaving.close_lines,
        *leaving.stop_lines,
        *shown,
        f"G1 {feed_of(-retract)} {feed(speed)} X{number(retract)}",
    ]
    for line in lines:
        assert LEAVES.fullmatch(line)
        assert clean(line) == line
        assert " E-0" not in line or float(line.split(" E")[1].split()[0]) < 0


def test_a_tiny_retraction_is_drawn_back_as_it_was_asked_for():
    safety = settings_of(profiles.load("marlin-generic", ["motion.retract_mm=0.00008"])).safety
    assert safety.close_lines == ("G1 E-0.00008 F1800",)
    assert extrusion(safety.close_lines[0]) == -0.00008
    assert feed_of(0.00008) == "E0.00008"
