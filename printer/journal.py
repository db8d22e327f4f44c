"""What has been acknowledged, on disk: records that are only ever appended, each with its own checksum.

A record is one line: eight hex digits of CRC-32, a blank, and a JSON object. Whatever cuts the file off,
the last whole record is right, and the torn tail behind it is cut when the journal is opened again.
"""

import json
import os
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

from printer.errors import JournalError
from printer.ports import lock_file, state_folder

LINES_PER_SYNC = 500
SECONDS_PER_SYNC = 1.0
SUFFIX = ".vslice-journal"


@dataclass(frozen=True, slots=True)
class JobRecord:
    """What a journal is about: the program (its path and hash), the port and the profile."""

    program: str
    sha256: str
    port: str
    profile: str


@dataclass(frozen=True, slots=True)
class Entry:
    """What a journal says: the job, the last acknowledged line of the file, and how the job ended
    ("" if it was cut off)."""

    job: JobRecord
    acknowledged_line: int
    ended: str

    @property
    def finished(self) -> bool:
        """Whether nothing is left to print."""
        return self.ended == "finished"


def journal_path(program: Path) -> Path:
    """Beside the program; in the platform's state folder if that place cannot be written."""
    beside = program.with_name(program.name + SUFFIX)
    if os.access(program.parent, os.W_OK):
        return beside
    return state_folder() / "journals" / (str(program.resolve()).replace(os.sep, "_") + SUFFIX)


def read_journal(path: Path) -> Entry:
    """What the journal says, its torn tail left out.

    Raises:
        JournalError: if there is no journal, or none of its records is whole.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise JournalError(
            f"{path.name}: there is no journal: no job of this program was begun here."
        ) from error
    records, _ = whole_records(data)
    if not records or "job" not in records[0]:
        raise JournalError(
            f"{path.name}: no whole record: the job was cut off before its first line was sent."
        )
    return _entry(records)


def unfinished(path: Path) -> int | None:
    """The last acknowledged line of a job that was begun and not finished; None if there is none."""
    records, _ = whole_records(path.read_bytes()) if path.exists() else ([], 0)
    if not records or "job" not in records[0]:
        return None
    entry = _entry(records)
    return None if entry.finished else entry.acknowledged_line


def whole_records(data: bytes) -> tuple[list[dict[str, Any]], int]:
    """The whole records, and where the torn tail begins."""
    records: list[dict[str, Any]] = []
    end = 0
    for line in data.splitlines(keepends=True):
        record = _decode(line)
        if record is None:
            break
        records.append(record)
        end += len(line)
    return records, end


def _decode(line: bytes) -> dict[str, Any] | None:
    if not line.endswith(b"\n") or line[8:9] != b" " or line[:8] != b"%08x" % zlib.crc32(line[9:-1]):
        return None
    record = json.loads(line[9:-1])
    return record if isinstance(record, dict) else None


def _encode(record: dict[str, Any]) -> bytes:
    text = json.dumps(record, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _entry(records: list[dict[str, Any]]) -> Entry:
    line, ended = 0, ""
    for record in records:
        line = record.get("line", line)
        ended = record.get("ended", "")
    return Entry(JobRecord(**records[0]["job"]), line, ended)


class Journal:
    """A journal that is open for writing; only one process can have it open.

    `begin` or `reopen`, then `ready` when the first line goes, then `acknowledge` and `close_job`.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        """Raises JournalError if another sender has the journal open."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self._clock = path, clock
        self._file: IO[bytes] = path.open("ab+")
        try:
            lock_file(self._file)
            if os.fstat(self._file.fileno()).st_ino != path.stat().st_ino:
                raise OSError("removed by its last owner between our opening and locking it")
        except OSError as error:
            self._file.close()
            raise JournalError(
                f"{path.name}: another sender writes this journal: wait, or stop it."
            ) from error
        self._first: dict[str, Any] = {}
        self._keep, self._line, self._synced_line = 0, 0, 0
        self._synced = self._clock()

    def begin(self, job: JobRecord) -> None:
        """A new job: what the file holds is forgotten as soon as the job is `ready`."""
        self._first, self._keep, self._line, self._synced_line = {"job": asdict(job)}, 0, 0, 0

    def ready(self) -> None:
        """The port is open, the first line goes now: on disk before this returns."""
        self._file.truncate(self._keep)
        self._append(self._first)
        _sync_folder(self.path.parent)

    def reopen(self, port: str) -> Entry:
        """Go on with an interrupted job, the torn tail left out; tells what was there.

        Raises:
            JournalError: if no record is whole.
        """
        self._file.seek(0)
        records, end = whole_records(self._file.read())
        if not records or "job" not in records[0]:
            raise JournalError(f"{self.path.name}: no whole record: start the job anew.")
        entry = _entry(records)
        self._first, self._keep, self._line = {"resumed": port}, end, entry.acknowledged_line
        return entry

    def acknowledge(self, line: int) -> None:
        """Lines up to ``line`` of the file were acknowledged.

        Each call writes, so that the end of this process loses nothing; a power cut may lose what was not
        synced, which is at most a second or 500 lines.
        """
        if line <= self._line:
            return
        self._line = line
        self._write({"line": line})
        if self._clock() - self._synced >= SECONDS_PER_SYNC or line - self._synced_line >= LINES_PER_SYNC:
            self._sync()

    def close_job(self, line: int, ended: str) -> None:
        """The job ended in an orderly way: "finished", "stopped", ..."""
        self._append({"line": line, "ended": ended})

    def close(self) -> None:
        """Let go of the file; one in which nothing stands, as its job never began, goes away."""
        if self._file.closed:
            return
        if os.fstat(self._file.fileno()).st_size == 0:
            with suppress(OSError):  # Windows removes no open file: an empty one stays, and means nothing
                self.path.unlink()
        self._file.close()

    def _append(self, record: dict[str, Any]) -> None:
        self._write(record)
        self._sync()

    def _write(self, record: dict[str, Any]) -> None:
        self._file.write(_encode(record))
        self._file.flush()

    def _sync(self) -> None:
        os.fsync(self._file.fileno())
        self._synced, self._synced_line = self._clock(), self._line


def _sync_folder(folder: Path) -> None:
    """Make a new file's name survive a power cut, where the system allows it."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
