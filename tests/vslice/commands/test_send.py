"""``vslice send`` and its neighbours as a user runs them; a whole real job, from grid to printed path."""

import io
import os
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, nullcontext
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import profiles
import vslice.cli
from printer import Settings, read_program
from printer.dry_run import dry_run
from printer.emulator.build import Options
from printer.emulator.firmware import Firmware
from printer.emulator.pty import PtyPrinter
from printer.journal import journal_path, read_journal
from printer.ports import PortInfo, port_lock
from slicer import grid
from slicer.hatch import hatch
from vslice.commands.send import settings_of

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "ihc_8x8.json"
PROGRAM = ["M302 P1", "G21", "G90", "M83", "G0 X0 Z0.2 F6000"] + [
    line
    for k in range(300)
    for line in (f";TOOLPATH {k}", f"G0 X{k % 5} Z{0.2 + k // 5 / 10:g}", f"G1 X{k % 5 + 0.5:g} E0.05 F600")
]


@pytest.fixture
def run(capsysbinary, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def call(*words):
        with pytest.raises(SystemExit) as ended:
            vslice.cli.main([str(word) for word in words])
        out, err = capsysbinary.readouterr()
        return ended.value.code, out.decode(), err.decode()

    return call


@pytest.fixture
def part(tmp_path):
    file = tmp_path / "part.gcode"
    file.write_text("\n".join(PROGRAM))
    return file


@contextmanager
def emulated(fast=True, **options):
    printer = PtyPrinter(Firmware(Options(**options)), fast)
    server = threading.Thread(target=printer.serve, daemon=True)
    server.start()
    try:
        yield printer
    finally:
        printer.stop()
        server.join(timeout=10)
        printer.close()


QUICK = ("--set", "printer.boot_wait_s=0.1")


POINT = ("--set", "nozzle.tip_width_mm=0", "--set", "motion.join_mm=0", "--set", "motion.join_spacings=0")
"""Each line in one piece, and no hop between lines extruded."""


def printed_by(run, profile, *options):
    """What a dry run of the example extrudes, float64 (n, 2, 2) in mm of the sheet, and its hatch lines."""
    bare = ("--set", "motion.prime_mm=0")  # the line that fills the nozzle is none of the grid's
    quick = ("--effort", "quick")  # any order prints them
    assert run(EXAMPLE, "-o", "part.gcode", "-p", profile, *quick, *bare, *options)[0] == 0
    code, out, _ = run("send", "part.gcode", "--dry-run")
    assert code == 0
    assert re.search(r"warnings +0", out)

    text = Path("part.gcode").read_text()
    shift = [float(value) for value in re.search(r"; vslice shift_mm = (\S+) (\S+)", text).groups()]
    moves = dry_run(read_program(Path("part.gcode")), settings_of(profiles.load(profile))).path.moves
    printed = [
        [(before.x - shift[0], before.z - shift[1]), (after.x - shift[0], after.z - shift[1])]
        for before, after in pairwise(moves)
        if after.e > 0 and (before.x, before.z) != (after.x, after.z)
    ]
    return np.array(printed), hatch(grid.read(EXAMPLE)).segments


@pytest.mark.parametrize("profile", ["marlin-generic", "marlin-syringe"])
def test_a_real_job_prints_the_hatch_lines_of_its_grid(run, profile):
    printed, wanted = printed_by(run, profile, *POINT)
    assert len(printed) == len(wanted)
    either_way = np.array([printed, printed[:, ::-1]])
    found = set()
    for segment in wanted:
        distance = np.abs(either_way - segment).max(axis=(2, 3)).min(axis=0)
        assert distance.min() < 2e-3
        found.add(int(distance.argmin()))
    assert len(found) == len(wanted)


def test_a_real_job_with_a_real_nozzle_prints_every_hatch_line_in_pieces(run):
    printed, wanted = printed_by(run, "marlin-syringe")
    assert len(printed) > len(wanted)
    for a, b in wanted:
        along = (b - a) / np.hypot(*(b - a))
        across = np.array([-along[1], along[0]])
        on = (np.abs((printed - a) @ across) < 2e-3).all(axis=1)
        reached = 0.0
        for begin, end in sorted(np.sort((printed[on] - a) @ along, axis=1).tolist()):
            if begin < reached + 4e-3:
                reached = max(reached, end)
        assert reached > np.hypot(*(b - a)) - 4e-3


def test_a_dry_run_says_what_the_printer_would_have_done(run, part):
    code, out, _ = run("send", part, "--dry-run", "--no-check")
    assert code == 0
    assert re.search(r"lines +605 of 605 commands", out)
    assert re.search(r"position +X 4\.500 +Y 0\.000 +Z 6\.100", out)
    assert re.search(r"material +15\.00 mm", out)
    assert not journal_path(part).exists()


def test_a_dry_run_of_a_cold_print_fails_in_the_printers_words(run, part):
    part.write_text("\n".join(PROGRAM[1:]))
    code, _, err = run("send", part, "--dry-run", "--no-check")
    assert code == 1
    assert "cold extrusion prevented" in err
    assert "M302 P1" in err


def test_what_the_printer_did_not_carry_out_is_told_and_kept(run, part):
    part.write_text("\n".join([*PROGRAM, "M486 S1", "M486 S2"]))
    code, _, err = run("send", part, "--port", "marlin://?clock=fast", "--no-check")
    assert code == 1
    assert "finished: 607 of 607" in err
    assert (
        '2 commands were not carried out by the printer, in its words: echo:Unknown command: "M486 S1"' in err
    )
    assert b'"refused":["echo:Unknown command: \\"M486 S1' in journal_path(part).read_bytes()


def test_a_dry_run_tells_what_was_not_carried_out(run, part):
    part.write_text("\n".join([*PROGRAM, "M486 S1"]))
    code, out, _ = run("send", part, "--dry-run", "--no-check")
    assert code == 1
    assert re.search(r"warnings +1", out)


def test_sending_prints_everything_and_says_so_in_plain_lines(run, part):
    with emulated() as printer:
        code, out, err = run("send", part, "--port", printer.path, "--no-check", *QUICK)
    assert (code, out) == (0, "")
    assert "100 %  finished  line 905/905" in err
    assert "605 of 605 commands" in err
    assert printer.firmware.path.material == pytest.approx(15)
    assert read_journal(journal_path(part)).finished


def test_a_program_that_the_check_refuses_is_not_sent(run, part):
    part.write_text("\n".join([*PROGRAM, "G1 X999 E1"]))
    code, _, err = run("send", part, "--port", "/dev/no-such-port")
    assert code == 1
    assert "cannot be printed on this machine; nothing was sent" in err
    assert "--no-check" in err


@pytest.mark.parametrize(
    ("words", "code", "complaint"),
    [
        (["send"], 2, "Which program?"),
        (["send", "missing.gcode", "--port", "marlin://"], 2, "missing.gcode"),
        (["send", "part.gcode", "--port", "/dev/no-such-port", "--no-check"], 1, "cannot be opened"),
        (["send", "part.gcode", "--port", "marlin://?corrpt=1", "--no-check"], 2, "corrpt"),
        (["send", "part.gcode", "--no-check", "-p", "no-such"], 2, "no-such"),
        (["send", "part.gcode", "--resume"], 2, "there is no journal"),
        (["send", "--resume"], 2, "Interrupted jobs in this folder: none"),
        (["emulate", "--faults", "fault=fire@3"], 2, "KIND@LINE"),
    ],
    ids=str,
)
def test_wrong_use(run, part, words, code, complaint):
    ended, _, err = run(*words)
    assert (ended, complaint in err) == (code, True), err


@pytest.mark.parametrize("port", ["marlin://?corrupt=2", "marlin://?slots=0", "socket://here", "fire://x"])
@pytest.mark.parametrize("command", ["send", "console", "slice"])
def test_a_port_that_can_be_none_is_wrong_use(run, part, command, port):
    words = {
        "send": ["send", part, "--no-check"],
        "console": ["console"],
        "slice": ["slice", EXAMPLE, "-o", "new.gcode", "--method", "greedy", "--send"],
    }
    code, _, err = run(*words[command], "--port", port)
    told = [line for line in err.splitlines() if line.startswith("Error: ")]
    assert (code, len(told), "Serial ports" in err) == (2, 1, False), err
    assert err.splitlines()[-1] == told[0]
    assert not list(part.parent.glob("*.vslice-journal"))


def test_an_error_names_the_port_once(run, part):
    code, _, err = run("send", part, "--no-check", "--port", "/dev/ttyNOPE")
    assert (code, err.count("ttyNOPE"), "Serial ports of this machine" in err) == (1, 1, True), err
    code, _, err = run("send", part, "--no-check", "--port", "socket://127.0.0.1:9")
    assert (code, err.count("127.0.0.1"), "Serial ports" in err) == (1, 1, False), err


def test_a_line_that_marlin_cannot_take_is_named(run, part):
    part.write_text("G28\nM117 " + "x" * 99)
    code, _, err = run("send", part, "--port", "/dev/no-such-port", "--no-check")
    assert code == 2
    assert "part.gcode: line 2" in err


def test_a_failure_is_reported_and_resumed(run, part):
    faults = Options().faults
    faults.script("disconnect@300")
    with emulated(faults=faults) as printer:
        code, _, err = run("send", part, "--port", printer.path, "--no-check", *QUICK)
        assert code == 1
        assert "connection broke" in err
        assert "'vslice send --resume part.gcode' goes on" in err
        journal = read_journal(journal_path(part))
        assert journal.ended == "failed"
    printer = PtyPrinter(printer.firmware, fast=True)
    server = threading.Thread(target=printer.serve, daemon=True)
    printer.firmware.connected = True
    server.start()
    code, _, err = run("send", "--resume", "--port", printer.path, "--yes", *QUICK)
    printer.stop()
    server.join(timeout=10)
    printer.close()
    assert code == 0, err
    assert f"acknowledged up to line {journal.acknowledged_line}, job failed" in err
    assert re.search(r"and the printer stands where line \d+ leads", err)
    assert re.search(r"Going (on at|back to) line \d+, where toolpath \d+ begins", err)
    assert read_journal(journal_path(part)).finished
    moves = printer.firmware.path.moves
    assert moves[-1].x == pytest.approx(4.5)
    assert moves[-1].z == pytest.approx(6.1)


def test_resuming_asks_first(run, part, monkeypatch):
    with emulated() as printer:
        run("send", part, "--port", printer.path, "--no-check", *QUICK)
        path = journal_path(part)
        path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
        before = printer.firmware.path.count
        unanswered = printer.firmware.lines
        code, _, err = run("send", "--resume", part, *QUICK)
        assert (code, "give --yes" in err) == (2, True), err
        assert printer.firmware.lines == unanswered
        monkeypatch.setattr("vslice.terminal.resuming.on_terminal", lambda: True)
        monkeypatch.setattr("sys.stdin", io.StringIO("n\n"))
        code, _, err = run("send", "--resume", part, *QUICK)
    assert code == 130, err
    assert "The nozzle will move" in err
    assert "Nothing was moved" in err
    assert printer.firmware.path.count == before


def test_a_second_sender_on_the_same_port_is_refused(run, part):
    with emulated() as printer, port_lock(printer.path):
        code, _, err = run("send", part, "--port", printer.path, "--no-check", *QUICK)
    assert code == 1
    assert "in use by another sender" in err
    assert not journal_path(part).exists(), "a journal of a job that never began"


def test_a_journal_without_a_record_hides_no_interrupted_job(run, part):
    journal_path(part.with_name("other.gcode")).touch()
    with emulated() as printer:
        run("send", part, "--port", printer.path, "--no-check", *QUICK)
        path = journal_path(part)
        path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
        code, _, err = run("send", "--resume", "--yes", *QUICK)
    assert code == 0, err


@pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals of POSIX")
@pytest.mark.parametrize(("signals", "state"), [(1, "stopped"), (2, "halted")])
def test_ctrl_c(part, tmp_path, signals, state):
    with emulated(fast=False) as printer:
        words = ["send", str(part), "--port", printer.path, "--no-check", *QUICK]
        sender = subprocess.Popen(
            [sys.executable, "-c", "from vslice.cli import main; main()", *words],
            cwd=ROOT,
            env={**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")},
            stderr=subprocess.PIPE,
            text=True,
        )
        wait_until(lambda: printer.firmware.path.count > 20)
        for _ in range(signals):
            sender.send_signal(signal.SIGINT)
            if signals == 2:
                wait_until(lambda: read_journal(journal_path(part)).acknowledged_line > 0)
                time.sleep(0.3)  # two signals at once are one; the stop takes much longer than this
        _, err = sender.communicate(timeout=60)
        assert sender.returncode == 130, err
        assert f"part.gcode: {state}:" in err
        assert "send --resume" in err
        wait_until(lambda: printer.firmware.halted or printer.firmware.idle)
        assert printer.firmware.halted == (signals == 2)
        if signals == 1:
            moves = printer.firmware.path.moves
            assert moves[-1].z == pytest.approx(moves[-3].z + 10)
    assert read_journal(journal_path(part)).ended == state


@contextmanager
def sending(printer, tmp_path, *words):
    """``vslice send`` in a process of its own, for signals."""
    sender = subprocess.Popen(
        [sys.executable, "-c", "from vslice.cli import main; main()", "send", *map(str, words)],
        cwd=ROOT,
        env={**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")},
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield sender
    finally:
        sender.kill()
        sender.wait()


def interrupt(*_, **__):
    raise KeyboardInterrupt


@pytest.mark.parametrize("moment", ["printer.ports.open_port", "printer.job.Job.run", "click.confirm"])
def test_an_interruption_before_the_way_back_says_that_nothing_moved(run, part, broken, monkeypatch, moment):
    before = broken.read_bytes()
    words = ["send", part, "--resume", "--port", "marlin://?clock=fast", "--height", "3", *QUICK]
    if moment == "click.confirm":
        monkeypatch.setattr("vslice.terminal.resuming.on_terminal", lambda: True)
        monkeypatch.setattr(moment, interrupt)
    else:
        monkeypatch.setattr(moment, interrupt)
        words.append("--yes")
    code, _, err = run(*words)
    assert (code, "Nothing was moved, and the journal is as it was" in err) == (130, True), err
    assert broken.read_bytes() == before


@pytest.mark.parametrize(
    ("moment", "words", "told"),
    [
        ("printer.job.Job.run", ["--dry-run", "--no-check"], "there is nothing to resume"),
        ("printer.job.Job.run", ["--dry-run", "--resume"], "the journal is as it was"),
        ("gcode.check.check_file", ["--restart", "--port", "marlin://"], "Nothing was sent"),
        ("vslice.machine.read_profile", ["--restart", "--port", "marlin://"], "Nothing was sent"),
    ],
)
def test_an_interruption_before_anything_is_sent_says_so(run, part, broken, monkeypatch, moment, words, told):
    monkeypatch.setattr(moment, interrupt)
    code, _, err = run("send", part, *words)
    assert (code, err.count(told)) == (130, 1), err


@pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals of POSIX")
@pytest.mark.parametrize("moment", ["boot", "heating"])
def test_a_job_that_was_stopped_before_it_printed_begins_anew_unasked(run, part, tmp_path, moment):
    part.write_text("\n".join(["G1 Z15 F6000", "M109 S200", *PROGRAM]))
    with emulated(fast=False) as printer:
        quick = ("--set", "printer.boot_wait_s=60") if moment == "boot" else QUICK
        with sending(printer, tmp_path, part, "--port", printer.path, "--no-check", *quick) as sender:
            wait_until(lambda: journal_path(part).exists() and b"\n" in journal_path(part).read_bytes())
            if moment == "heating":
                wait_until(lambda: printer.firmware.machine.hotend.target == 200)
            time.sleep(0.5)
            sender.send_signal(signal.SIGINT)
            _, err = sender.communicate(timeout=60)
    assert sender.returncode == 130, err
    assert "Nothing was printed: 'vslice send part.gcode' begins anew" in err
    assert "--resume" not in err
    assert "not carried out" not in err  # the nozzle was cold
    for words in (["--resume"], ["--resume", "--dry-run"]):
        code, out, err = run("send", part, *words)
        assert (code, "had printed nothing yet" in err, out) == (2, True, ""), err
        assert "'vslice send part.gcode' begins anew" in err
    code, _, err = run("send", part, "--port", "marlin://?clock=fast", "--no-check", *QUICK)
    assert code == 0, err
    assert not list(tmp_path.glob("*.1"))


def test_a_job_that_ended_before_its_first_toolpath_is_offered_to_begin_anew_alone(run, part, monkeypatch):
    """A line beside the sheet, for the nozzle: it stands there, but no toolpath can be gone on with."""
    line = ["G0 X0 Z0.2 F6000", *[f"G1 X{k} E0.05 F600" for k in range(60)]]
    part.write_text("\n".join([*PROGRAM[:4], *line, *PROGRAM[4:]]))
    port = ("--port", "marlin://?clock=fast&fault=disconnect@40", "--no-check", *QUICK)
    code, _, err = run("send", part, *port)
    assert (code, "--resume" in err) == (1, False), err
    assert "'vslice send part.gcode --restart' begins anew" in err
    for words in (["--resume", "--dry-run"], ["--resume", "--yes", "--port", "marlin://"]):
        code, _, err = run("send", part, *words)
        assert (code, "before its first toolpath" in err) == (2, True), err
    code, _, err = run("send", part, *ANEW)
    assert (code, "--resume" in err, "--restart" in err) == (2, False, True), err
    monkeypatch.setattr("vslice.terminal.interrupted.on_terminal", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO("restart\n"))
    code, _, err = run("send", part, *ANEW)
    assert (code, "(restart, stop)" in err) == (0, True), err


@pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals of POSIX")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_emulate_is_a_printer_until_it_is_interrupted(tmp_path, part, run, how):
    link = tmp_path / "port"
    words = ["emulate", "--fast", "--link", str(link), "--faults", "corrupt=3e-4"]
    emulator = subprocess.Popen(
        [sys.executable, "-c", "from vslice.cli import main; main()", *words],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert emulator.stdout.readline().strip() == os.readlink(link)
    code, _, err = run("send", part, "--port", link, "--no-check", *QUICK)
    emulator.send_signal(how)
    _, told = emulator.communicate(timeout=30)
    assert code == 0, err
    assert emulator.returncode == 0
    assert "600 moves, 15.00 mm of E" in told
    assert not link.is_symlink()


def wait_until(true, seconds=30):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it never happened"
        time.sleep(0.02)


def test_ports_lists_what_there_is(run, monkeypatch):
    found = [PortInfo("/dev/ttyUSB0", "USB Serial", "1a86:7523"), PortInfo("/dev/ttyS0", "n/a", "")]
    monkeypatch.setattr("printer.ports.list_serial_ports", lambda: found)
    code, out, _ = run("ports")
    assert code == 0
    assert out.splitlines()[0].split() == ["/dev/ttyUSB0", "1a86:7523", "USB", "Serial"]
    monkeypatch.setattr("printer.ports.list_serial_ports", list)
    code, out, err = run("ports")
    assert (code, out) == (0, "")
    assert "No serial ports" in err


def test_the_only_port_is_offered(run, part, monkeypatch):
    with emulated() as printer:
        only = PortInfo(printer.path, "USB Serial", "1a86:7523")
        monkeypatch.setattr("printer.ports.list_serial_ports", lambda: [only])
        code, _, err = run("send", part, "--no-check", *QUICK)
        assert code == 2  # without a terminal nobody can agree
        assert printer.path in err
        monkeypatch.setattr(
            "sys.stdin", type("Terminal", (), {"isatty": lambda self: True, "fileno": None})()
        )
        monkeypatch.setattr("click.confirm", lambda *_, **__: True)
        monkeypatch.setattr("vslice.terminal.streaming.keys", lambda _: nullcontext())
        code, _, err = run("send", part, "--no-check", *QUICK)
        assert code == 0, err
        assert printer.firmware.path.material == pytest.approx(15)


def test_the_console_shows_replies(run, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("m114 ; where\n\nFOO\n"))
    with emulated() as printer:
        code, out, _ = run("console", "--port", printer.path)
    assert code == 0
    assert "X:0.00 Y:0.00 Z:0.00 E:0.00 Count" in out
    assert 'echo:Unknown command: "FOO"' in out


@pytest.mark.parametrize("clock", ["fast", "real"])
def test_the_console_waits_for_all_answers(run, monkeypatch, clock):
    """Longer than half a second, and more commands than a printer has slots and bytes for."""
    wordy = [f"M117 {k} {'x' * 60}" for k in range(20)]
    monkeypatch.setattr(
        "sys.stdin", io.StringIO("\n".join(["M105", "G28", *wordy, "G4 P700", "M114"]) + "\n")
    )
    code, out, err = run("console", "--port", f"marlin://?homing_s=3&clock={clock}")
    assert (code, err) == (0, "")
    assert len(re.findall(r"^ok", out, re.MULTILINE)) == 24
    assert out.count("Count X:") == 2


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (["G4 P3000", "M114"], ["Not answered: G4 P3000, M114"]),
        (["G4 P3000"] * 9, ["Not sent, nor what follows: G4 P3000", "Not answered: G4 P3000, G4 P3000"]),
        (["M112", "M114"], ["Not"]),
    ],
)
def test_the_console_says_what_was_not_answered(run, monkeypatch, typed, told):
    """By a printer that says nothing while it is busy, or has halted."""
    monkeypatch.setattr("vslice.terminal.conversation.SILENCE_S", 0.5)
    monkeypatch.setattr("sys.stdin", io.StringIO("\n".join(["M105", *typed]) + "\n"))
    code, out, err = run("console", "--port", "marlin://?odd=silent")
    assert (code, [words for words in told if words not in err], out.count("ok T:")) == (1, [], 1), err


def test_the_console_waits_for_no_answer_where_none_comes(run, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("M105\nM112\n"))
    code, out, err = run("console", "--port", "marlin://")
    assert (code, err, "kill() called" in out) == (0, "", True)


def test_a_profile_becomes_settings():
    settings = settings_of(
        profiles.load("marlin-pneumatic", ["printer.window_lines=2", "motion.travel_speed_mm_s=7.0"])
    )
    profile = profiles.load("marlin-pneumatic")
    assert isinstance(settings, Settings)
    assert settings.window_lines == 2
    assert settings.safety.travel_speed_mm_s == 7
    assert settings.safety.close_lines == tuple(profiles.render(profile.gcode.valve_close, profile.values))
    assert settings.safety.home_lines == profile.printer.resume_home_lines
    generic = settings_of(profiles.load("marlin-generic"))
    assert any(line.startswith("G1 E-") for line in generic.safety.close_lines)


@pytest.fixture
def broken(run, part):
    """A job that was interrupted at about a third; gives its journal."""
    assert (
        run("send", part, "--port", "marlin://?clock=fast&fault=disconnect@300", "--no-check", *QUICK)[0] == 1
    )
    return journal_path(part)


ANEW = ("--port", "marlin://?clock=fast", "--no-check", *QUICK)


def test_without_a_terminal_an_interrupted_job_is_not_begun_anew(run, part, broken):
    before = broken.read_bytes()
    code, _, err = run("send", part, *ANEW)
    assert code == 2
    assert "--resume" in err
    assert "--restart" in err
    assert broken.read_bytes() == before
    broken.write_bytes(b"x" + before[1:])  # damaged: the same care
    code, _, err = run("send", part, *ANEW)
    assert (code, "cannot be told" in err, "--restart" in err) == (2, True, True)


def test_restart_begins_anew_and_keeps_the_old_journal(run, part, broken):
    before = broken.read_bytes()
    code, _, err = run("send", part, "--restart", *ANEW)
    assert code == 0, err
    kept = broken.with_name(broken.name + ".1")
    assert f"kept as {kept}" in err
    assert kept.read_bytes() == before
    assert read_journal(broken).finished


@pytest.mark.parametrize(("answer", "code"), [("stop", 130), ("", 130), ("restart", 0), ("resume", 2)])
def test_on_a_terminal_the_user_is_asked(run, part, broken, monkeypatch, answer, code):
    monkeypatch.setattr("vslice.terminal.interrupted.on_terminal", lambda: True)
    monkeypatch.setattr("vslice.terminal.resuming.on_terminal", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO(answer + "\n"))
    before = broken.read_bytes()
    ended, _, err = run("send", part, *ANEW)
    assert ended == code, err
    assert "begin anew on a clear plate, or stop" in err
    if answer == "resume":  # a printer that is new: its height is unknown
        assert "--height" in err
    assert (broken.read_bytes() == before) == (answer != "restart")


@pytest.mark.parametrize(("answer", "code"), [("stop", 130), ("", 130), ("resume", 130), ("restart", 0)])
def test_a_program_that_was_changed_is_not_offered_to_go_on(run, part, broken, monkeypatch, answer, code):
    before = broken.read_bytes()
    part.write_text(part.read_text() + "\nM117 another\n")
    ended, _, err = run("send", part, *ANEW)
    assert ended == 2
    assert "It cannot go on, since the file was changed" in err
    assert "Put the old file back" in err
    monkeypatch.setattr("vslice.terminal.interrupted.on_terminal", lambda: True)
    monkeypatch.setattr("sys.stdin", io.StringIO(answer + "\n"))
    ended, _, err = run("send", part, *ANEW)
    assert ended == code, err
    assert "(restart, stop)" in err
    assert "Go on with it" not in err
    assert (broken.read_bytes() == before) == (answer != "restart")


def test_a_dry_run_neither_asks_nor_touches_the_journal(run, part, broken):
    before = broken.read_bytes()
    assert run("send", part, "--dry-run", "--no-check")[0] == 0
    assert broken.read_bytes() == before


@pytest.mark.parametrize("height", [None, 2.5])
def test_a_dry_run_of_resuming_says_what_would_happen(run, part, broken, height):
    before = broken.read_bytes()
    words = [] if height is None else ["--height", str(height)]
    code, out, err = run("send", part, "--resume", "--dry-run", *words)
    assert code == 0, err
    going = (
        "Going on at" if height is None else "Going back to"
    )  # the emulated printer kept its place, or not
    assert re.search(rf"{going} line \d+, where toolpath \d+ begins", out)
    assert ("G92 Z12.5" in out) == (height is not None)
    assert re.search(r"lines +(\d+) of \1 commands from there on", out)
    assert re.search(r"position +X 4\.500 +Y 0\.000 +Z 6\.100", out)
    material = float(re.search(r"material +([\d.]+) mm", out)[1])
    assert 7 < material < 14
    assert broken.read_bytes() == before
    assert list(broken.parent.glob("*.1")) == []


def test_another_program_does_not_begin_where_an_interrupted_one_may_stand(run, part):
    port = "marlin://lab-of-two-programs?clock=fast&fault=disconnect@300"
    assert run("send", part, "--port", port, "--no-check", *QUICK)[0] == 1
    other = part.with_name("other.gcode")
    other.write_text("\n".join(PROGRAM))
    code, _, err = run("send", other, "--port", port, "--no-check", *QUICK)
    assert (code, "part.gcode" in err, "--restart" in err) == (2, True, True)
    assert run("send", other, "--port", port, "--no-check", "--restart", *QUICK)[0] == 0
    assert not any(journal_path(other).parent.glob("*.1"))


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--height", "3"], "--height without --resume"),
        (["--yes"], "--yes without --resume"),
        (["--dry-run", "--port", "marlin://"], "--port with --dry-run"),
        (["--dry-run", "--baud", "9600"], "--baud with --dry-run"),
        (["--port", "marlin://", "--baud", "9600"], "--baud on a port without a wire"),
        (["--restart", "--resume"], "--restart with --resume"),
        (["--dry-run", "--restart"], "--restart with --dry-run"),
        (["--resume", "--no-check"], "--no-check with --resume"),
        (["--resume", "--height", "nan"], "--height"),
        (["--resume", "--height", "inf"], "--height"),
        (["--probe-after", "0"], "--probe-after"),
        (["--give-up-after", "nan"], "--give-up-after"),
        (["--give-up-after", "1"], "Giving up after 1 s must come after probing"),
        (["--baud", "0"], "--baud"),
    ],
    ids=str,
)
def test_options_without_effect_or_sense_are_refused(run, part, words, complaint):
    code, _, err = run("send", part, *words)
    assert (code, complaint in err) == (2, True), err


@pytest.mark.parametrize("name", ["-", ".", "/dev/null"])
def test_a_program_that_is_no_file_is_refused(run, name):
    code, _, err = run("send", name)
    assert (code, "Write the program to a file first" in err) == (2, True), err


def test_slicing_over_the_program_of_an_interrupted_job_warns(run, part, broken):
    code, _, err = run(EXAMPLE, "-o", part, "--method", "greedy")
    assert (code, "name another file with -o" in err) == (0, True), err
    before = part.read_bytes()
    code, _, err = run(EXAMPLE, "-o", part, "--send", "--port", "marlin://?clock=fast")
    assert (code, "--restart" in err, part.read_bytes() == before) == (2, True, True)


def test_emulate_replaces_no_file_and_refuses_what_is_no_option(run, part):
    assert run("emulate", "--link", part)[0] == 2
    assert part.exists()
    assert run("emulate", "--faults", "corrupt")[0] == 2


def test_the_console_sends_no_line_that_a_printer_garbles(run, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("M117 " + "x" * 99 + "\nM114\n"))
    code, out, err = run("console", "--port", "marlin://?clock=fast")
    assert (code, "Not sent" in err, "Count" in out) == (0, True, True)


def test_lines_for_leaving_have_no_exponent():
    settings = settings_of(profiles.load("marlin-generic", ["motion.retract_mm=0.00008"]))
    assert any(line.startswith("G1 E-0.00008 F") for line in settings.safety.close_lines)


def test_letters_without_a_number_are_words_for_slice_check_and_send_alike(run, tmp_path):
    """`G29 A` in a start block: sliced, checked and sent."""
    sheet = tmp_path / "g.json"
    sheet.write_text('{"tile_mm": 4.0, "spacing_mm": 0.4, "angles_deg": [[-20.0]]}')
    part = tmp_path / "g.gcode"
    words = ("--set", 'gcode.start=["G28", "G29 A", "M109 S200"]', "--method", "greedy")
    assert run("slice", sheet, "-o", part, *words)[0] == 0
    assert "\nG29 A\n" in part.read_text()
    assert run("check", part)[0] == 0
    assert run("send", part, "--dry-run")[0] == 0
