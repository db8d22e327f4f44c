"""`stream` on real ports: the emulated one and a pseudo-terminal, with its thread, pauses and stops."""

import os
import threading
from contextlib import contextmanager
from dataclasses import replace

import pytest

from printer import (
    Job,
    PortError,
    PrinterError,
    ProtocolError,
    Safety,
    Settings,
    State,
    StreamError,
    make_program,
    stream,
)
from printer.emulator.build import Options
from printer.emulator.firmware import Firmware
from printer.emulator.pty import PtyPrinter
from printer.ports import open_port, port_lock

PROGRAM = ["M302 P1", "G91", "M83"] + [f"G1 X{k % 5 - 2} Z0.1 E0.01 F6000" for k in range(1000)]
QUICK = Settings(boot_wait_s=0.05)


@pytest.fixture(autouse=True)
def own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@contextmanager
def pty_printer(faults="", fast=True):
    options = Options()
    for fault in faults.split():
        options.faults.script(fault)
    printer = PtyPrinter(Firmware(options), fast)
    server = threading.Thread(target=printer.serve, daemon=True)
    server.start()
    try:
        yield printer
    finally:
        printer.stop()
        server.join(timeout=10)
        printer.close()


def fast_port(**options):
    port = open_port("marlin://?clock=fast&" + "&".join(f"{k}={v}" for k, v in options.items()), 115200)
    return port


def test_a_list_of_lines_is_printed():
    port = fast_port()
    report = stream([*PROGRAM, "", "; the end"], port, QUICK)
    assert report.state is State.FINISHED
    assert report.acknowledged == report.sent == report.total == len(PROGRAM)
    assert report.resent == 0
    assert port.firmware.path.count == 1000
    assert port.firmware.path.material == pytest.approx(10)
    assert report.capabilities["AUTOREPORT_TEMP"]


def test_a_file_is_printed(tmp_path):
    file = tmp_path / "part.gcode"
    file.write_bytes("\r\n".join(PROGRAM).encode())
    assert stream(file, "marlin://?clock=fast&seed=1&corrupt=3e-4", QUICK).state is State.FINISHED


def test_over_a_pseudo_terminal():
    with pty_printer() as printer:
        report = stream(PROGRAM, printer.path, QUICK)
        assert report.state is State.FINISHED
        assert printer.firmware.path.count == 1000


def test_through_spy(tmp_path):
    log = tmp_path / "wire.txt"
    with pty_printer() as printer:
        stream(PROGRAM[:20], f"spy://{printer.path}?file={log}", QUICK)
    assert ".N0 M110 N0*125." in log.read_text()


def test_over_a_socket():
    """socket:// is another class of ports; a second thread is its printer."""
    import socket

    listener = socket.create_server(("127.0.0.1", 0))
    firmware = Firmware(Options())

    def serve():
        peer, _ = listener.accept()
        with peer:
            while data := peer.recv(4096):
                firmware.receive(data)
                while not firmware.idle:
                    firmware.advance(min(firmware.next_event(), firmware.machine.planner.end))
                peer.sendall(firmware.read())

    server = threading.Thread(target=serve, daemon=True)
    server.start()
    with listener:
        report = stream(PROGRAM[:50], f"socket://127.0.0.1:{listener.getsockname()[1]}", QUICK)
    server.join(timeout=10)
    assert report.state is State.FINISHED
    assert firmware.path.count == 47


def test_progress_goes_up_to_the_end():
    seen = []
    stream(PROGRAM, fast_port(), QUICK, on_progress=seen.append)
    counts = [progress.acknowledged for progress in seen]
    assert counts == sorted(counts)
    assert seen[-1].acknowledged == seen[-1].total == len(PROGRAM)
    assert seen[-1].state is State.FINISHED
    assert seen[-1].temperatures["T"].actual == 20


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("kill@500", "Heating failed"),
        ("reset@500", "was reset"),
        ("silence@500", "nothing was heard for 3[01] s"),
        ("disconnect@500", "connection broke"),
    ],
)
def test_a_failure_says_how_far_it_came(fault, words):
    with pytest.raises(StreamError, match=words) as caught:
        stream(PROGRAM, fast_port(fault=fault), QUICK)
    assert caught.value.report.state is State.FAILED
    assert 480 <= caught.value.report.acknowledged <= 500
    assert "last thing heard" in str(caught.value)
    report = caught.value.report
    assert f"up to line {report.acknowledged} ({report.acknowledged} of {report.total} " in str(caught.value)


def test_a_pulled_cable_on_a_pseudo_terminal():
    with pty_printer("disconnect@500") as printer, pytest.raises(StreamError, match="connection broke"):
        stream(PROGRAM, printer.path, QUICK)


def test_a_program_that_marlin_cannot_take_is_refused_before_the_port_is_opened():
    with pytest.raises(ProtocolError, match="line 2"):
        stream(["G28", "M117 " + "x" * 99], "/dev/no-such-port", QUICK)


def test_no_such_port():
    with pytest.raises(PortError, match="/dev/no-such-port"):
        stream(PROGRAM, "/dev/no-such-port", QUICK)


def test_a_second_sender_on_one_port_is_refused():
    with pty_printer() as printer, port_lock(printer.path):
        link = f"{os.environ['XDG_STATE_HOME']}-link"
        os.symlink(printer.path, link)
        for name in (printer.path, link):
            with pytest.raises(PrinterError, match="in use by another sender"):
                stream(PROGRAM, name, QUICK)


class StopsAt:
    """Calls a method of the job when so many commands are acknowledged."""

    def __init__(self, count, *methods):
        self.count, self.methods, self.job = count, list(methods), None

    def __call__(self, progress):
        if progress.acknowledged >= self.count and self.methods:
            getattr(self.job, self.methods.pop(0))()


def run_with(watch, port, settings=QUICK):
    watch.job = Job(make_program(PROGRAM), port, settings, on_progress=watch)
    return watch.job.run()


def slow_port():
    """Each command takes 2 ms, so that there is a middle of the job to stop in."""
    return open_port("marlin://?command_s=0.002", 115200)


def test_a_controlled_stop_lifts_the_nozzle_and_closes_the_valve():
    port = slow_port()
    safety = Safety(lift_mm=7, close_lines=("M42 P4 S0",), stop_lines=("M104 S0", "M140 S0"))
    report = run_with(StopsAt(20, "cancel"), port, replace(QUICK, safety=safety))
    assert report.state is State.STOPPED
    assert 20 <= report.acknowledged < 1003
    moves = port.firmware.path.moves
    assert moves[-1].z == pytest.approx(moves[-2].z + 7)
    assert len(moves) == report.acknowledged - 3 + 1
    assert port.firmware.machine.outputs == ["M42 P4 S0"]


def test_abort_halts_the_printer():
    port = slow_port()
    report = run_with(StopsAt(20, "cancel", "abort"), port)
    assert report.state in (State.KILLED, State.STOPPED)
    port = slow_port()
    report = run_with(StopsAt(20, "abort"), port)
    assert report.state is State.KILLED
    assert port.firmware.halted
    assert "confirms" in report.message


def test_a_callback_that_fails_stops_the_job_in_a_controlled_way():
    port = slow_port()

    def fails(progress):
        if progress.acknowledged > 10:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        stream(PROGRAM, port, QUICK, on_progress=fails)
    moves = port.firmware.path.moves
    assert moves[-1].z == pytest.approx(moves[-2].z + 10)
    assert not port.firmware.halted


def test_pause_holds_the_program_and_resume_goes_on():
    port = slow_port()
    job = Job(make_program(PROGRAM[:300]), port, QUICK)
    counts = []

    def watch(progress):
        if progress.acknowledged > 20 and not counts:
            job.pause()
        if progress.paused:
            counts.append(progress.acknowledged)
            if len(counts) == 4:
                job.pause(False)

    job.on_progress = watch
    assert job.run().state is State.FINISHED
    assert counts[-1] - counts[1] <= 4
    assert port.firmware.path.count == 297


def test_the_reader_thread_ends_with_the_job():
    before = threading.active_count()
    stream(PROGRAM[:10], fast_port(), QUICK)
    assert threading.active_count() == before


def test_a_port_that_raises_oserror_is_a_broken_connection():
    class Pulled:
        in_waiting = 0
        written = 0

        def read(self, size):
            return b""

        def write(self, data):
            raise OSError(5, "Input/output error")

        def close(self):
            """Nothing to close."""

    with pytest.raises(StreamError, match="Input/output error"):
        stream(PROGRAM, Pulled(), replace(QUICK, boot_wait_s=0))


def test_a_reply_without_end_does_not_fill_the_memory():
    class Babble:
        """Never a newline, as at a wrong baud rate."""

        in_waiting = 1000
        clock_s = 0.0

        def clock(self):
            return self.clock_s

        def read(self, size):
            self.clock_s += 0.1
            return b"\x8f" * size

        def write(self, data):
            """Nobody listens."""

        def close(self):
            """Nothing to close."""

    with pytest.raises(StreamError, match="no line was acknowledged for 30 s"):
        stream(PROGRAM, Babble(), QUICK)
