"""The same sender against a printer that others wrote: OctoPrint's virtual one, in a process of its own."""

import json
import os
import subprocess
from contextlib import contextmanager
from pathlib import Path

import pytest

from printer import Settings, State, StreamError, stream

PEER = Path(__file__).parent / "peers" / "octoprint_printer.py"
PYTHON = os.environ.get("VSLICE_OCTOPRINT_PYTHON", "")
pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        not PYTHON,
        reason="VSLICE_OCTOPRINT_PYTHON names no interpreter of an environment with OctoPrint",
    ),
]

COUNT = 300
# Relative moves of different lengths: a line lost or run twice changes the sum. M117 moves nothing.
PROGRAM = ["G91", "M83"] + [
    "M117 still" if k % 50 == 49 else f"G1 X{(k % 7) / 100:g} E{(k % 3) / 1000:g} F9000" for k in range(COUNT)
]
SUM_X = sum((k % 7) / 100 for k in range(COUNT) if k % 50 != 49)
SLOW = "F20"  # about 10 ms a move, as that printer counts time
FIRST = 3  # lines 1 and 2 are the greeting's


@pytest.fixture(autouse=True)
def own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@contextmanager
def peer(**settings):
    process = subprocess.Popen(
        [PYTHON, str(PEER), json.dumps(settings)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        yield process, process.stdout.readline().strip()
    finally:
        try:
            process.communicate(timeout=5)  # closes its input: it tidies up and ends
        except (subprocess.TimeoutExpired, BrokenPipeError):
            process.kill()
            process.communicate()


def send(port, on_progress=None, feed="F9000", **settings):
    program = [line.replace("F9000", feed) for line in PROGRAM]
    patience = {"boot_wait_s": 1, "give_up_after_s": 15, "stall_after_s": 15, **settings}
    return stream([*program, "M400", "M114"], port, Settings(**patience), on_progress=on_progress)


def number_of(index):
    return FIRST + index


@pytest.mark.parametrize(
    ("settings", "resent"),
    [
        ({}, False),
        ({"okFormatString": "ok N{lastN} P{buffer}"}, False),
        ({"forceChecksum": True, "sendBusy": True}, False),
        ({"simulated_errors": [f"{number_of(100)}:resend"]}, True),
        ({"simulated_errors": [f"{number_of(100)}:checksum_mismatch", f"{number_of(101)}:resend"]}, True),
        ({"simulated_errors": [f"{number_of(100)}:missing_lineno"]}, True),
        # This one swallows the line that it asked for, and counts it as taken: here that is M117.
        ({"simulated_errors": [f"{number_of(101)}:resend_with_timeout"]}, True),
        ({"simulated_errors": [f"{number_of(100)}:resend"], "brokenResend": True}, True),
        ({"resend_ratio": 3}, True),
    ],
    ids=str,
)
def test_exactly_once(settings, resent):
    with peer(**settings) as (_, port):
        report = send(port)
    assert report.state is State.FINISHED
    assert report.acknowledged == COUNT + 4
    if "resend_ratio" not in settings:  # its resends come after the line was counted, so it runs some again
        assert report.position["X"] == pytest.approx(SUM_X, abs=1e-6)
    assert bool(report.resent) == resent


class At:
    """Gives the peer a debug command when so many commands are acknowledged."""

    def __init__(self, process, count, command):
        self.process, self.count, self.command = process, count, command

    def __call__(self, progress):
        if self.command and progress.acknowledged >= self.count:
            self.process.stdin.write(self.command + "\n")
            self.process.stdin.flush()
            self.command = ""


@pytest.mark.parametrize(
    "command", ["dont_answer", "sleep 4", "action_custom prompt_begin Hello", "send \x80\xff"]
)
def test_survived(command):
    with peer() as (process, port):
        report = send(port, At(process, 50, command), SLOW)
    assert report.state is State.FINISHED
    if command != "dont_answer":
        assert report.position["X"] == pytest.approx(SUM_X, abs=1e-6)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("trigger_fatal_error_marlin", "Thermal Runaway, system stopped! Heater_ID: bed"),
        ("reset", "was reset"),
        ("go_awol", "nothing was heard for (6|7|8|9|1[0-9]) s"),
        ("rerequest_last", "in vain"),
        ("hangup", "connection broke"),
    ],
)
def test_ends_with_its_reason(command, words):
    with peer() as (process, port), pytest.raises(StreamError, match=words):
        send(port, At(process, 50, command), SLOW, give_up_after_s=6)
