"""Rows on disk outlive every kill: none is lost, doubled or halved."""

import json

import pyarrow.parquet as pq
import pytest
from study_functions import FIGURES

from studies import Factor, Study, StudyError
from studies import store as storing
from studies.design import key_of
from studies.store import Store, load

STUDY = Study("squares", (Factor("x", tuple(range(20))), Factor("kind", ("a", "b"))))


def rows(count=40, error=None):
    for index, task in enumerate(STUDY.tasks()):
        if index < count:
            x = task["x"]
            figures = {} if error else {"square": x * x, "half": x / 2, "word": f"x{x}"}
            yield {"index": index, "key": key_of(task), **task, **figures, "error": error, "seconds": 0.1}


def opened(folder, study=STUDY, version="1"):
    return Store(folder, study, FIGURES, version)


def test_rows_come_back_in_the_canonical_order_with_their_types(tmp_path):
    with opened(tmp_path / "r") as store:
        assert store.append(reversed(list(rows()))) == 40
        assert store.append(rows(3)) == 0  # known already
    table = load(tmp_path / "r")
    assert table["index"].to_pylist() == list(range(40))
    assert table["square"].to_pylist()[6] == 9
    assert [str(kind) for kind in table.schema.types[:4]] == ["int64", "string", "int64", "string"]


def test_what_was_only_in_the_journal_is_kept_and_its_half_line_is_not(tmp_path, monkeypatch):
    store = opened(tmp_path)
    store.append(rows(10))
    with open(tmp_path / "journal.jsonl", "a") as file:
        file.write('{"index": 10, "key": "half')
    store._lock.release()  # as a kill does
    assert [part.name for part in (tmp_path / "parts").iterdir()] == ["part-000000.parquet"]
    assert len(load(tmp_path)) == 10
    with opened(tmp_path) as again:
        assert len(again.finished) == 10
        assert again.append(rows(12)) == 2
    assert load(tmp_path)["index"].to_pylist() == list(range(12))
    # A kill between a part and the emptying of the journal leaves rows in both.
    monkeypatch.setattr(storing, "ROWS_A_PART", 5)
    with opened(tmp_path) as third:
        third.append(rows(20))
    (tmp_path / "journal.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows(15)))
    with opened(tmp_path) as fourth:
        assert len(fourth.finished) == 20
    assert load(tmp_path)["index"].to_pylist() == list(range(20))


def test_parts_are_only_added(tmp_path, monkeypatch):
    monkeypatch.setattr(storing, "ROWS_A_PART", 4)
    with opened(tmp_path) as store:
        for row in rows(10):
            store.append([row])
    parts = sorted((tmp_path / "parts").iterdir())
    assert [part.name for part in parts] == [f"part-{k:06d}.parquet" for k in (0, 1, 2, 3)]
    before = [part.read_bytes() for part in parts]
    with opened(tmp_path) as store:
        store.append(rows(12))
    assert [part.read_bytes() for part in parts] == before
    assert sum(pq.read_metadata(part).num_rows for part in (tmp_path / "parts").iterdir()) == 12


def test_failures_are_kept_and_give_way_to_a_later_success(tmp_path):
    with opened(tmp_path) as store:
        store.append(rows(4, error="ValueError: no"))
        assert len(store.failed) == 4
        assert store.append(rows(4, error="ValueError: no")) == 0
        store.forget_failed()
        store.append(rows(2))
    table = load(tmp_path)
    assert table["index"].to_pylist() == [0, 1, 2, 3]
    assert [error is None for error in table["error"].to_pylist()] == [True, True, False, False]
    with opened(tmp_path) as store:
        assert (len(store.finished), len(store.failed)) == (2, 2)


def test_one_writer_one_study_one_version(tmp_path):
    with opened(tmp_path) as store:
        store.append(rows(1))
        with pytest.raises(StudyError, match="another process writes"):
            opened(tmp_path)
    other = Study("cubes", STUDY.factors)
    with pytest.raises(StudyError, match="another study, 'squares' .other title"):
        opened(tmp_path, other)
    turned = Study("squares", STUDY.factors[::-1])  # the same tasks in another order
    with pytest.raises(StudyError, match=r"other factors\)"):
        opened(tmp_path, turned)
    with pytest.raises(StudyError, match="begun by version 1, this is 2"):
        opened(tmp_path, version="2")
    with opened(tmp_path):  # an error leaves no lock
        pass


def test_no_results_are_no_report(tmp_path):
    with pytest.raises(StudyError, match="no study is kept there"):
        load(tmp_path)
    with opened(tmp_path):
        pass
    with pytest.raises(StudyError, match="no rows yet"):
        load(tmp_path)
