"""What has been acknowledged, on disk: records that are only ever appended, each with its own checksum.

A record is one line: eight hex digits of CRC-32, a blank, and a JSON object. Whatever cuts the file off,
the last whole record is right, and the torn tail behind it is cut when the journal is opened again. A
damaged record among whole ones loses itself alone, since each later one says how far the job has come.
"""

import hashlib
import os
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from itertools import count
from pathlib import Path
from typing import IO, Any

from dialect.numbers import FEED_DECIMALS
from printer import last_job
from printer.errors import BusyError, JournalError
from printer.ports import lock_file, state_folder
from printer.records import Entry, JobRecord, encode, entry_of, whole_records

LINES_PER_SYNC = 500
SECONDS_PER_SYNC = 1.0
SUFFIX = ".vslice-journal"


def journal_path(program: Path) -> Path:
    """Beside the program (behind a link, beside the file itself); in the platform's state folder if that
    place cannot be written. A journal that is there already is the one, whichever of the two it is."""
    if program.is_symlink():
        program = program.resolve()
    beside = program.with_name(program.name + SUFFIX)
    place = hashlib.sha256(str(program.resolve()).encode(errors="surrogateescape")).hexdigest()[:16]
    apart = state_folder() / "journals" / f"{program.name[:100]}.{place}{SUFFIX}"
    if beside.exists() or (os.access(program.parent, os.W_OK) and not apart.exists()):
        return beside
    return apart


def read_journal(path: Path) -> Entry:
    """What the journal says, what is damaged left out.

    Raises:
        JournalError: if there is no journal, it cannot be read, or its first record is not whole.
    """
    data = _bytes_of(path)
    if data is None:
        raise JournalError(f"{path.name}: there is no journal: no job of this program was begun here.")
    return entry_of(whole_records(data)[0], path.name, torn=b"\n" not in data)


def unfinished(path: Path) -> Entry | None:
    """The job that was begun and not finished; None if there is none.

    Raises:
        JournalError: if that cannot be told: the journal cannot be read, or its first record is damaged.
    """
    return _unfinished(_bytes_of(path) or b"", path.name)


def _unfinished(data: bytes, name: str) -> Entry | None:
    if b"\n" not in data:
        return None  # cut off before the first record was whole, and so before the first line was sent
    entry = entry_of(whole_records(data)[0], name)
    return entry if entry.interrupted else None


def _bytes_of(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise JournalError(f"{path}: the journal cannot be read: {error.strerror}.") from error


class Journal:
    """A journal that is open for writing; only one process can have it open.

    `begin` or `reopen`, then `ready` when the first line goes, then `acknowledge` and `close_job`.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        """Raises BusyError if another sender has the journal open."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self._clock = path, clock
        self._file: IO[bytes] = path.open("ab+")
        try:
            lock_file(self._file)
            if os.fstat(self._file.fileno()).st_ino != path.stat().st_ino:
                raise OSError("removed by its last owner between our opening and locking it")
        except OSError as error:
            self._file.close()
            raise BusyError(f"{path.name}: another sender writes this journal: wait, or stop it.") from error
        self._first: dict[str, Any] = {}
        self._aside: Path | None = None
        self._keep, self._line, self._synced_line = 0, 0, 0
        self._port = ""
        self._synced = self._clock()

    def begin(self, job: JobRecord) -> Path | None:
        """A new job: what the file holds is forgotten as soon as the job is `ready`.

        If it holds an interrupted job, or what cannot be read, that is kept aside then; returns where.
        """
        self._first, self._keep, self._line, self._synced_line = {"job": asdict(job)}, 0, 0, 0
        self._port, self._aside = job.port, self._place_aside() if self._is_precious() else None
        return self._aside

    def ready(self, line: int = 0, drawn_back_mm: float = 0.0, homes: bool = False) -> None:
        """The port is open, the first line goes now: on disk before this returns.

        A job that is resumed counts from ``line`` on; until the lines ahead of it have been carried out, the
        filament is ``drawn_back_mm`` behind where the program has it there, and, if it ``homes``, the printer
        does not know its position.

        Raises:
            OSError: if it cannot be written, or the old journal cannot be kept; that is still there then.
        """
        if self._aside is not None:
            self._copy(self._aside)
        self._file.truncate(self._keep)
        if "resumed" in self._first:
            self._first |= {"line": line, "drawn_back_mm": round(drawn_back_mm, FEED_DECIMALS)}
            if homes:
                self._first["homes"] = True
            self._line = line
        self._append(self._first)
        _sync_folder(self.path.parent)
        last_job.remember(self._port, self.path)

    def reopen(self, port: str) -> Entry:
        """Go on with an interrupted job, the torn tail left out; tells what was there.

        Raises:
            JournalError: if the first record is not whole.
        """
        self._file.seek(0)
        data = self._file.read()
        records, end = whole_records(data)
        entry = entry_of(records, self.path.name, torn=b"\n" not in data)
        self._first, self._keep, self._line = {"resumed": port}, end, entry.acknowledged_line
        self._port, self._aside = port, None
        return entry

    def _is_precious(self) -> bool:
        self._file.seek(0)
        try:
            return _unfinished(self._file.read(), self.path.name) is not None
        except JournalError:
            return True

    def _place_aside(self) -> Path:
        """A name that is free; nobody else takes it, for only the owner of the journal does."""
        names = (self.path.with_name(f"{self.path.name}.{k}") for k in count(1))
        return next(name for name in names if not name.exists())

    def _copy(self, place: Path) -> None:
        """Copied, not renamed: the open file, which is locked, stays the journal."""
        self._file.seek(0)
        with place.open("xb") as out:
            try:
                out.write(self._file.read())
                out.flush()
                os.fsync(out.fileno())
            except OSError:
                place.unlink()
                raise

    def acknowledge(self, line: int) -> None:
        """Lines up to ``line`` of the file were acknowledged.

        Each call writes, so that the end of this process loses nothing; a power cut may lose what was not
        synced, which is at most a second or 500 lines.
        """
        if line <= self._line:
            return  # no news
        self._line = line
        self._write({"line": line})
        if self._clock() - self._synced >= SECONDS_PER_SYNC or line - self._synced_line >= LINES_PER_SYNC:
            self._sync()

    def close_job(
        self,
        line: int,
        ended: str,
        refused: Sequence[str] = (),
        drawn_back_mm: float | None = None,
        nothing_laid: bool = False,
        lost: bool = False,
    ) -> None:
        """The job ended in an orderly way: "finished", "stopped", ...; ``refused`` is what the printer said
        of commands that it did not carry out, ``drawn_back_mm``, ``nothing_laid`` and ``lost`` as in
        `Entry`."""
        record: dict[str, Any] = {"line": line, "ended": ended}
        if drawn_back_mm is not None:
            record["drawn_back_mm"] = drawn_back_mm
        if nothing_laid:
            record["nothing_laid"] = True
        if lost:
            record["lost"] = True
        self._append(record | ({"refused": list(refused)} if refused else {}))

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
        self._file.write(encode(record))
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
