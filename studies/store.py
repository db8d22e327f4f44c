"""Results on disk: rows are kept the moment they arrive, and no kill loses, doubles or halves one.

A row is first a line in ``journal.jsonl``, flushed when it is written. Now and then the lines become a
Parquet file in ``parts/``, written beside its place and renamed; only then is the journal emptied. A row
that a kill leaves in both is told by its key, and half a line at the journal's end is dropped.
"""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from locket import LockError, lock_file

from studies.design import Study
from studies.errors import StudyError

ROWS_A_PART = 5000
TYPES = {int: pa.int64(), float: pa.float64(), str: pa.string(), bool: pa.bool_()}
OWN = {
    "index": int,
    "key": str,
    "error": str,
    "seconds": float,
    "peak_mb": float,
    "host": str,
    "process": int,
}
"""Columns of every row beside its factors and figures."""


class Store:
    """The folder of a study; one process may write to it.

    Attributes:
        finished: keys of the tasks whose rows are kept.
        failed: keys of those that have only an error.
    """

    def __init__(self, folder: Path, study: Study, figures: Mapping[str, type], version: str) -> None:
        """Open or begin the results of a study.

        Args:
            figures: name and type of what each task gives.
            version: of the software; results of two versions do not mix.

        Raises:
            StudyError: the folder holds another study, or results of another version, or is in use.
        """
        self._folder, self._study = folder, study
        self._schema = schema_of(study, figures)
        self._lock = lock_file(str(folder / "lock"), timeout=0)
        try:
            (folder / "parts").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StudyError(f"{folder}: cannot be made: {error.strerror}; name another folder.") from None
        try:
            self._lock.acquire()
        except LockError:
            raise StudyError(f"{folder}: another process writes there; wait for it, or end it.") from None
        except OSError as error:
            raise StudyError(f"{folder}: cannot be written to: {error.strerror}.") from None
        try:
            self._begin({"study": study.said(), "version": version, "figures": list(study.figures)})
            if not (empty := folder / "parts" / "part-000000.parquet").exists():
                _write(self._schema.empty_table(), empty)  # so that a journal alone can be read
            self.finished, self.failed = set[str](), set[str]()
            self._kept: list[dict[str, Any]] = []
            self._load()
            self._journal = open(folder / "journal.jsonl", "a", encoding="utf-8")  # noqa: SIM115 - see close
        except BaseException:
            self._lock.release()
            raise

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def append(self, rows: Iterable[dict[str, Any]]) -> int:
        """Keep rows, those that are kept already left out; how many were new."""
        new = 0
        for row in rows:
            key = row["key"]
            if key in self.finished or (row.get("error") is not None and key in self.failed):
                continue
            (self.failed if row.get("error") is not None else self.finished).add(key)
            self._journal.write(json.dumps(row, separators=(",", ":")) + "\n")
            self._kept.append(row)
            new += 1
        self._journal.flush()
        if len(self._kept) >= ROWS_A_PART:
            self.flush()
        return new

    def flush(self) -> None:
        """Make a part of what stands in the journal."""
        if not self._kept:
            return
        parts = self._folder / "parts"
        number = 1 + max((int(part.stem.split("-")[1]) for part in parts.glob("part-*.parquet")), default=0)
        target = parts / f"part-{number:06d}.parquet"
        _write(pa.Table.from_pylist(self._kept, schema=self._schema), target)
        self._kept = []
        self._journal.seek(0)
        self._journal.truncate()
        self._journal.flush()

    def close(self) -> None:
        """Write what is left, and let others in."""
        try:
            self.flush()
            self._journal.close()
        finally:
            self._lock.release()

    def forget_failed(self) -> None:
        """Let what failed be tried again; the new row of a task takes the place of its error."""
        self.failed.clear()

    def finish(self) -> Path:
        """Write all rows in the canonical order of their tasks as one table, whose place is returned."""
        self.flush()
        target = self._folder / "table.parquet"
        _write(load(self._folder), target)
        return target

    def _begin(self, asked: dict[str, Any]) -> None:
        manifest = self._folder / "study.json"
        if not manifest.exists():
            if any((self._folder / "parts").glob("*.parquet")):
                raise StudyError(f"{self._folder}: has results but no study.json; name an empty folder.")
            _write_manifest(asked, manifest)
            return
        found = json.loads(manifest.read_text("utf-8"))
        # As texts: the order of factors is that of the tasks.
        names = [
            name for name in ("title", "samples", "seed", "options", "factors")
            if json.dumps(found["study"][name]) != json.dumps(asked["study"][name])
        ]  # fmt: skip
        if names:
            raise StudyError(
                f"{self._folder}: holds another study, '{found['study']['title']}' (other "
                f"{', '.join(names)}); name another folder."
            )
        if found["version"] != asked["version"]:
            raise StudyError(
                f"{self._folder}: was begun by version {found['version']}, this is {asked['version']}, and "
                "their figures do not mix; name another folder, or go on with that version."
            )
        if found.get("figures") != asked["figures"]:  # what is shown may change, it computes nothing
            _write_manifest(asked, manifest)

    def _load(self) -> None:
        for part in sorted((self._folder / "parts").glob("*.parquet")):
            table = pq.read_table(part, columns=["key", "error"])
            for key, error in zip(table["key"].to_pylist(), table["error"].to_pylist(), strict=True):
                (self.finished if error is None else self.failed).add(key)
        journal = self._folder / "journal.jsonl"
        whole, rows = read_journal(journal)
        if journal.exists() and journal.stat().st_size > whole:
            with open(journal, "r+b") as file:  # the half line of a kill
                file.truncate(whole)
        for row in rows:
            if row["key"] in self.finished:
                continue
            (self.failed if row.get("error") is not None else self.finished).add(row["key"])
            self._kept.append(row)
        self.failed -= self.finished


def _write_manifest(asked: Mapping[str, Any], manifest: Path) -> None:
    staged = manifest.with_suffix(".new")
    staged.write_text(json.dumps(asked, indent=1) + "\n", encoding="utf-8")
    os.replace(staged, manifest)


def read_journal(path: Path) -> tuple[int, list[dict[str, Any]]]:
    """How many bytes of whole lines there are, and their rows."""
    if not path.exists():
        return 0, []
    data = path.read_bytes()
    whole = data.rfind(b"\n") + 1
    return whole, [json.loads(line) for line in data[:whole].splitlines()]


def schema_of(study: Study, figures: Mapping[str, type]) -> Any:
    """Columns of the rows of a study: its own, the factors, the options, the figures."""
    columns: dict[str, Any] = {name: TYPES[OWN[name]] for name in ("index", "key")}
    for factor in study.factors:
        columns[factor.name] = TYPES[_type([*factor.levels, *(factor.limits or ()) * (not factor.whole)])]
    for name, value in study.options:
        columns[name] = TYPES[type(value)]
    columns |= {name: TYPES[kind] for name, kind in figures.items()}
    columns |= {name: TYPES[kind] for name, kind in OWN.items() if name not in columns}
    return pa.schema(list(columns.items()))


def _type(levels: Sequence[Any]) -> type:
    kinds = {type(level) for level in levels}
    return kinds.pop() if len(kinds) == 1 else float


def load(folder: Path) -> Any:
    """All rows of a study as a pyarrow table, in the canonical order; an error only where a task has no more.

    Raises:
        StudyError: there are none.
    """
    # The journal first: what becomes a part meanwhile is then read twice, and not missed.
    _, rows = read_journal(folder / "journal.jsonl")
    tables = [pq.read_table(part) for part in sorted((folder / "parts").glob("*.parquet"))]
    if rows and tables:
        tables.append(pa.Table.from_pylist(rows, schema=tables[0].schema))
    if sum(map(len, tables)) == 0:
        why = "it has no rows yet" if tables else "no study is kept there"
        raise StudyError(f"{folder}: {why}; 'vslice study STUDY -o {folder}' runs one.")
    table = pa.concat_tables(tables)
    errors, keys = table["error"].to_pylist(), table["key"].to_pylist()
    best: dict[str, int] = {}
    for k, (key, error) in enumerate(zip(keys, errors, strict=True)):
        if key not in best or (errors[best[key]] is not None and error is None):
            best[key] = k
    return table.take(sorted(best.values())).sort_by("index")


def _write(table: Any, target: Path) -> None:
    """Write a table beside its place and rename it, all of it on the disk before it counts."""
    staged = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with open(staged, "wb") as file:
            pq.write_table(table, file, compression="zstd")
            file.flush()
            os.fsync(file.fileno())
        os.replace(staged, target)
    except OSError as error:
        staged.unlink(missing_ok=True)
        raise StudyError(f"{target}: cannot be written: {error.strerror or error}.") from error
