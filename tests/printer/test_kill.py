"""kill -9 at fifty random moments of a job; the journal leads back to the same print."""

import os
import random
import select
import signal
import subprocess
import sys
import threading
from contextlib import closing
from pathlib import Path

import pytest
from sheet import SAFETY, assert_same_print, printed, sheet_lines

from printer import Job, Journal, Settings, State, make_program, read_program
from printer.emulator.build import Options
from printer.emulator.firmware import Firmware
from printer.emulator.pty import PtyPrinter
from printer.journal import LINES_PER_SYNC, read_journal
from printer.ports import open_port
from printer.resume import plan_resume

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals and SIGKILL are POSIX")

TOOLPATHS = 250
ROOT = Path(__file__).parents[2]
SETTINGS = Settings(boot_wait_s=0.05, safety=SAFETY)
SENDER = """
import sys
from pathlib import Path
from printer import Journal, Settings, read_program, stream
from printer.journal import JobRecord
file, port = Path(sys.argv[1]), sys.argv[2]
program, journal = read_program(file), Journal(Path(sys.argv[3]))
journal.begin(JobRecord(str(file), program.sha256, port, "lab"))
stream(program, port, Settings(boot_wait_s=0.05), journal=journal)
"""


class Killer(PtyPrinter):
    """Kills the sender when the printer has taken so many commands."""

    def __init__(self, firmware, after):
        super().__init__(firmware, fast=True)
        self.after, self.victim = after, None

    def _answer(self):
        if self.victim is not None and self.firmware.lines >= self.after:
            self.victim.send_signal(signal.SIGKILL)
            self.victim = None
        super()._answer()

    def settle(self):
        """The moves that were taken are carried out; input that was under way is read first."""
        while select.select([self._ours], [], [], 0)[0]:
            self.firmware.receive(os.read(self._ours, 4096))
        while not self.firmware.idle:
            self.firmware.advance(min(self.firmware.next_event(), self.firmware.machine.planner.end))
        while select.select([self._wake_read], [], [], 0)[0]:
            os.read(self._wake_read, 1)


def serving(printer):
    server = threading.Thread(target=printer.serve, daemon=True)
    server.start()
    return server


@pytest.mark.parametrize("moment", range(50))
def test_resume_after_kill_9(moment, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    file, journal_file = tmp_path / "sheet.gcode", tmp_path / "journal"
    file.write_text("\n".join(sheet_lines(TOOLPATHS)))
    program = read_program(file)
    after = random.Random(moment).randrange(LINES_PER_SYNC + 100, len(program))
    printer = Killer(Firmware(Options(advanced_ok=bool(moment % 2))), after)
    words = [sys.executable, "-c", SENDER, str(file), printer.path, str(journal_file)]
    printer.victim = sender = subprocess.Popen(words, cwd=ROOT, stderr=subprocess.PIPE)
    server = serving(printer)
    _, complaint = sender.communicate(timeout=60)
    assert sender.returncode == -signal.SIGKILL, complaint.decode()
    printer.stop()
    server.join()
    printer.settle()
    before = printed(printer.firmware)

    server = serving(printer)
    with closing(Journal(journal_file)) as journal, closing(open_port(printer.path, 115200)) as port:
        entry = journal.reopen(printer.path)
        greeting = Job(make_program(["M114"]), port, SETTINGS).run()
        assert not greeting.rebooted
        plan = plan_resume(program, entry, SAFETY, rebooted=False, reported=greeting.position)
        job = Job(program, port, SETTINGS, journal=journal, start_at=plan.start_at, before=plan.before)
        assert job.run().state is State.FINISHED
    printer.stop()
    server.join()
    twice = assert_same_print(before, printed(printer.firmware)[len(before) :], TOOLPATHS)
    assert twice <= 1  # of the toolpath under way, which has two moves
    assert read_journal(journal_file).finished
    printer.close()
