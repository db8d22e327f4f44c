"""What stands in a journal: records, each with its own checksum, and what they say together."""

import json
import zlib
from dataclasses import dataclass, fields
from typing import Any

from printer.errors import JournalError


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
    ("" if it was cut off).

    A job that was resumed counts from where it went on, ``resumed_line``: all before is printed beyond doubt.
    ``furthest_line`` is the last line that was ever acknowledged, so what stands may reach up to there.
    ``drawn_back_mm`` is how far the senders left the filament behind where the program has it at the
    acknowledged line; None if the journal does not say, as the sender was cut off in between. ``lost`` tells
    that the printer had forgotten its position when the job ended (it was reset, it had halted), or when the
    job was to go on, and was still finding it;
    ``nothing_laid`` that the job ended before it could lay any material.
    """

    job: JobRecord
    acknowledged_line: int
    ended: str
    resumed_line: int = 0
    furthest_line: int = 0
    drawn_back_mm: float | None = None
    lost: bool = False
    nothing_laid: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "furthest_line", max(self.furthest_line, self.acknowledged_line))

    @property
    def finished(self) -> bool:
        """Whether nothing is left to print."""
        return self.ended == "finished"

    @property
    def interrupted(self) -> bool:
        """Whether something of a print may stand in the printer, and more of it is to come.

        A job that was cut off may have come further than its journal.
        """
        return not (self.finished or self.nothing_laid)


def whole_records(data: bytes) -> tuple[list[dict[str, Any]], int]:
    """The whole records, and where the last of them ends."""
    records: list[dict[str, Any]] = []
    end = place = 0
    for line in data.split(b"\n"):
        place += len(line) + 1
        if place <= len(data) and (record := _decode(line)) is not None:
            records.append(record)
            end = place
    return records, end


def _decode(line: bytes) -> dict[str, Any] | None:
    if line[8:9] != b" " or line[:8] != b"%08x" % zlib.crc32(line[9:]):
        return None
    try:
        record = json.loads(line[9:])
    except ValueError:
        return None  # a checksum that fits by chance
    return record if isinstance(record, dict) else None


def encode(record: dict[str, Any]) -> bytes:
    """A record as a line of the file."""
    text = json.dumps(record, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def entry_of(records: list[dict[str, Any]], name: str, torn: bool = False) -> Entry:
    """What the whole records of a journal of this name say; ``torn`` if not even the first is whole.

    Raises:
        JournalError: if none says which job it is of.
    """
    job = records[0].get("job") if records else None
    if torn:
        raise JournalError(f"{name}: no whole record: the job was cut off before its first line was sent.")
    known = [field.name for field in fields(JobRecord)]
    if not isinstance(job, dict) or any(not isinstance(job.get(key), str) for key in known):
        raise JournalError(
            f"{name}: the journal is damaged: no whole record says which job it is of, so nobody can tell "
            "where to go on."
        )
    line, ended, resumed, furthest, again = 0, "", 0, 0, False
    drawn, lost, nothing_laid = None, False, False
    try:
        for record in records:
            before, line, ended = line, int(record.get("line", line)), str(record.get("ended", ""))
            furthest = max(furthest, line)
            if "resumed" in record:
                resumed, again, lost = line, True, bool(record.get("homes"))
            elif line > resumed:
                lost = False
            lost = lost or bool(record.get("lost"))
            # What a job that was resumed had laid before is there still. One that has ended in an orderly
            # way without a line has laid nothing either.
            no_line = bool(ended) and ended != "finished" and furthest == 0
            nothing_laid = not again and (bool(record.get("nothing_laid")) or no_line)
            if "drawn_back_mm" in record:
                drawn = float(record["drawn_back_mm"])
            elif line != before:
                drawn = None  # the program goes on: it is as the program says
    except (TypeError, ValueError) as error:
        raise JournalError(f"{name}: the journal is of another kind: {error}.") from None
    return Entry(
        JobRecord(**{key: job[key] for key in known}),
        line,
        ended,
        resumed,
        furthest,
        drawn,
        lost,
        nothing_laid,
    )
