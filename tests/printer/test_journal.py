"""The journal survives being cut off at any byte, and says how far the job came."""

import pytest
from hypothesis import given
from hypothesis import settings as search
from hypothesis import strategies as st

from printer import BusyError, JournalError, Settings, StreamError, make_program, stream
from printer.job import Job
from printer.journal import (
    Journal,
    journal_path,
    read_journal,
    unfinished,
)
from printer.ports import open_port
from printer.records import Entry, JobRecord, whole_records

JOB = JobRecord("/somewhere/part.gcode", "ab" * 32, "/dev/ttyUSB0", "marlin-generic")
PROGRAM = make_program(["G91", *[f"G1 X{k % 3 - 1} F6000" for k in range(3000)]])


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def path(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "part.gcode.vslice-journal"


def written(path, *lines, ended=""):
    clock = Clock()
    journal = Journal(path, clock)
    journal.begin(JOB)
    journal.ready()
    for line in lines:
        clock.now += 2
        journal.acknowledge(line)
    if ended:
        journal.close_job(lines[-1], ended)
    journal.close()
    return path.read_bytes()


def test_what_was_written_is_read(path):
    written(path, 100, 900)
    assert read_journal(path) == Entry(JOB, 900, "")
    assert unfinished(path) == Entry(JOB, 900, "")


@pytest.mark.parametrize("ended", ["finished", "stopped", "failed"])
def test_how_a_job_ended(path, ended):
    written(path, 100, ended=ended)
    assert read_journal(path).ended == ended
    assert (unfinished(path) is None) == (ended == "finished")


def test_a_job_that_was_resumed_counts_from_where_it_went_on(path):
    """Its height is that of the line that was reached before, and its filament as far as the lead-in came."""
    written(path, 100, 900, ended="stopped")

    def go_on(*lines, drawn_back_mm=None):
        journal = Journal(path)
        journal.reopen("/dev/ttyUSB0")
        journal.ready(850, 1.0, homes=True)
        for line in lines:
            journal.acknowledge(line)
        if drawn_back_mm is not None:
            journal.close_job(max(lines, default=850), "stopped", drawn_back_mm=drawn_back_mm)
        journal.close()
        return read_journal(path)

    assert go_on() == Entry(JOB, 850, "", 850, 900, 1.0, lost=True)
    assert go_on(drawn_back_mm=0.5) == Entry(JOB, 850, "stopped", 850, 900, 0.5, lost=True)
    assert go_on(870) == Entry(JOB, 870, "", 850, 900)
    assert go_on(870, 910, drawn_back_mm=0.3) == Entry(JOB, 910, "stopped", 850, 910, 0.3)


def test_cut_off_at_every_byte(path):
    data = written(path, 10, 20, 30)
    ends = [k + 1 for k, byte in enumerate(data) if byte == 10]
    for cut in range(len(data) + 1):
        path.write_bytes(data[:cut])
        if cut < ends[0]:
            with pytest.raises(JournalError, match="no whole record"):
                read_journal(path)
            continue
        last = sum(end <= cut for end in ends) - 1
        assert read_journal(path).acknowledged_line == 10 * last
        journal = Journal(path, lambda: 0.0)
        assert journal.reopen("/dev/ttyACM0").acknowledged_line == 10 * last
        journal.ready()
        journal.close_job(99, "finished")
        journal.close()
        assert read_journal(path).acknowledged_line == 99, cut


@search(deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_a_journal_or_none(data):
    records, end = whole_records(data)
    assert isinstance(records, list)
    assert 0 <= end <= len(data)


@search(deadline=None)
@given(st.data())
def test_a_damaged_byte_loses_its_record_alone(data):
    from printer.records import encode

    records = [{"line": k} for k in range(5)]
    whole = bytearray(b"".join(map(encode, records)))
    place = data.draw(st.integers(0, len(whole) - 1))
    whole[place] ^= data.draw(st.integers(1, 255))
    size = len(encode(records[0]))
    hit = place // size
    lost = {hit, hit + 1} if whole[(hit + 1) * size - 1] != 10 else {hit}
    assert whole_records(bytes(whole))[0] == [record for k, record in enumerate(records) if k not in lost]


def test_at_most_one_sync_a_second_or_five_hundred_lines(path, monkeypatch):
    synced = []
    monkeypatch.setattr("os.fsync", synced.append)
    clock = Clock()
    journal = Journal(path, clock)
    journal.begin(JOB)
    journal.ready()
    before = len(synced)
    for line in range(1, 400):
        journal.acknowledge(line)
    assert len(synced) == before
    journal.acknowledge(500)
    assert len(synced) == before + 1
    clock.now += 1.0
    journal.acknowledge(501)
    assert len(synced) == before + 2
    journal.close()


def test_a_second_sender_on_one_journal_is_refused(path):
    journal = Journal(path)
    with pytest.raises(BusyError, match="another sender"):
        Journal(path)
    journal.close()
    Journal(path).close()


def test_a_new_job_keeps_the_old_journal_until_the_port_is_open(path):
    written(path, 100)
    journal = Journal(path)
    journal.begin(JOB)
    journal.close()
    assert read_journal(path).acknowledged_line == 100


def test_a_journal_lies_beside_its_program_or_in_the_state_folder(path, monkeypatch):
    program = path.parent / "part.gcode"
    assert journal_path(program) == path
    monkeypatch.setattr("os.access", lambda *_: False)
    assert path.parent / "state" in journal_path(program).parents


def test_no_journal(path):
    with pytest.raises(JournalError, match="there is no journal"):
        read_journal(path)
    assert unfinished(path) is None


def test_a_job_that_never_began_leaves_no_journal(path):
    journal = Journal(path)
    journal.begin(JOB)
    journal.close()
    assert not path.exists()
    journal.close()


def test_a_journal_that_its_owner_removed_meanwhile_is_nobodys(path, monkeypatch):
    first = Journal(path)

    def lock(file):  # the first sender closes between our opening and our locking
        first.close()

    monkeypatch.setattr("printer.journal.lock_file", lock)
    with pytest.raises(BusyError, match="another sender"):
        Journal(path)


def test_a_streamed_job_is_journaled_to_its_end(path):
    journal = Journal(path)
    journal.begin(JOB)
    stream(PROGRAM, "marlin://?clock=fast", Settings(boot_wait_s=0.1), journal=journal)
    journal.close()
    assert read_journal(path) == Entry(JOB, 3001, "finished", drawn_back_mm=0.0)


def test_a_failed_job_leaves_a_journal_of_what_was_acknowledged(path):
    journal = Journal(path)
    journal.begin(JOB)
    with pytest.raises(StreamError) as caught:
        Job(PROGRAM, open_port("marlin://?clock=fast&fault=kill@2000", 9600), journal=journal).run()
    journal.close()
    assert read_journal(path) == Entry(
        JOB, caught.value.report.acknowledged, "failed", drawn_back_mm=0.0, lost=True, nothing_laid=True
    )
    assert 1950 < caught.value.report.acknowledged < 2000


def test_a_new_job_keeps_the_journal_of_an_interrupted_one_aside(path):
    contents = [written(path, line) for line in (100, 200)]
    assert path.with_name(path.name + ".1").read_bytes() == contents[0]
    journal = Journal(path)
    assert journal.begin(JOB) == path.with_name(path.name + ".2")
    journal.ready()
    journal.close()
    assert path.with_name(path.name + ".2").read_bytes() == contents[1]
    written(path, 300, ended="finished")
    written(path, 400)
    assert len(list(path.parent.glob("part*"))) == 4, "a finished job needs no keeping"


def test_a_damaged_journal_is_kept_aside_and_never_taken_for_a_finished_one(path):
    whole = written(path, 100, 200)
    path.write_bytes(b"x" + whole[1:])
    with pytest.raises(JournalError, match="damaged"):
        unfinished(path)
    written(path, 5)
    assert path.with_name(path.name + ".1").read_bytes() == b"x" + whole[1:]


def test_a_job_that_ended_before_its_first_line_left_nothing(path):
    written(path, 0, ended="failed")
    assert unfinished(path) is None


def test_two_programs_in_read_only_folders_have_two_journals(path, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)
    one, other = (journal_path(path.parent / name) for name in ("a_b/c.gcode", "a/b_c.gcode"))
    assert one != other


def test_a_journal_is_found_when_its_folder_became_writable(path, monkeypatch):
    program = path.parent / "part.gcode"
    monkeypatch.setattr("os.access", lambda *_: False)
    apart = journal_path(program)
    written(apart, 100)
    monkeypatch.undo()
    monkeypatch.setenv("XDG_STATE_HOME", str(path.parent / "state"))
    assert journal_path(program) == apart


def test_the_last_job_of_a_port_is_remembered_where_names_last(path):
    from printer.last_job import journal_of, remember

    path.touch()
    for port, lasts in (("/dev/ttyUSB7", True), ("/dev/pts/3", False), ("marlin://?clock=fast", False)):
        remember(port, path)
        assert (journal_of(port) == path) == lasts, port
    path.unlink()
    assert journal_of("/dev/ttyUSB7") is None
