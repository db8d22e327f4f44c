"""``vslice study``: from a file of factors to rows and a report; what cannot be run is said at once."""

import importlib.util
import re
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from slicer import sequence
from slicer.generate import random_walk
from slicer.hatch import hatch
from vslice.experiment import DEFAULTS, FIGURES, experiment
from vslice.options import METHOD_NAMES
from vslice.printable import problem_of

SMALL = """
title = "Small sheets"
[factors]
tiles = ["2x2", "3x2", "3x3"]
sheet = { count = 2 }
method = ["greedy", "auto"]
machine = "paper"
objective = "straight"
"""


def test_a_study_runs_goes_on_and_is_reported(run):
    Path("study.toml").write_text(SMALL)
    code, _, err = run("study", "study.toml", "-o", "results", "--workers", "1")
    assert code == 0, err
    assert "12 tasks done, 0 failed" in err
    assert re.search(r"dashboard: http://127\.0\.0\.1:\d+/status", err)
    table = pq.read_table("results/table.parquet").to_pydict()
    for k in range(12):
        cols, rows = map(int, table["tiles"][k].split("x"))
        problem = problem_of(hatch(random_walk(cols, rows, seed=table["sheet"][k])).segments, "corner")
        result = sequence.solve(problem, method=table["method"][k])
        assert table["travel_mm"][k] == pytest.approx(result.travel_mm)
        assert table["toolpaths"][k] == problem.n
        assert table["proved"][k] == (table["method"][k] == "auto")
    assert set(table["effort"]) == {"default"}  # what the file does not say stands in the rows
    before = Path("results/table.parquet").read_bytes()
    code, _, err = run("study", "study.toml", "-o", "results")
    assert code == 0
    assert "12 of 12 tasks are done already" in err
    assert Path("results/table.parquet").read_bytes() == before

    code, out, err = run("study", "report", "results", "--format", "png", "--figures", "travel_mm")
    assert code == 0, err
    assert out == Path("results/report/report.md").read_text()
    assert "## method: differences on the same sheets" in out
    assert Path("results/report/travel_mm_tiles.png").read_bytes().startswith(b"\x89PNG")
    code, _, err = run("study", "report", "results", "--figures", "speed")
    assert code == 2
    assert "no figure 'speed'" in err


def test_what_cannot_be_run_is_said_and_leaves_nothing(run):
    Path("study.toml").write_text(SMALL)
    Path("bad.toml").write_text("[factors]\ntiles = '4'")
    Path("file").write_text("")
    for words, said in (
        (("study", "bad.toml", "-o", "r"), "bad.toml: factors.tiles: '4' is no number of tiles"),
        (("study", "none.toml", "-o", "r"), "cannot be read"),
        (("study", "study.toml"), "--output"),
        (("study", "study.toml", "-o", "file"), "is a file"),
        (
            ("study", "study.toml", "-o", "r", "--scheduler", "tcp://x:1", "--workers", "2"),
            "--workers has no effect",
        ),
        (("study", "report", "nothing"), "is no folder of results"),
    ):
        code, _, err = run(*words)
        assert code == 2, words
        assert said in err
    assert not Path("r").exists()


def test_a_dry_run_says_what_would_be_done(run):
    code, _, err = run("study", "table-one", "-o", "r", "--dry-run")
    assert code == 0
    assert "20000 tasks" in err
    assert re.search(r"^ +machine +1 levels: paper$", err, re.MULTILINE)
    assert not Path("r").exists()


def test_without_the_libraries_the_extra_is_named(run, monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "dask" else found(name, *a)
    )
    code, _, err = run("study", "table-one", "-o", "r", "--dry-run")
    assert code == 2
    assert "vslice[study]" in err


def test_more_workers_than_the_machine_has_are_not_started(run, monkeypatch):
    from vslice.commands import study

    monkeypatch.setattr(study, "_memory_mb", lambda: 3200.0)
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: set(range(64)), raising=False)
    said = []
    monkeypatch.setattr(study, "say", said.append)
    assert study._workers(100_000) == (3, 733)
    assert "3200 MB of memory" in said[0]
    assert study._workers(None) == (3, 733)


def test_how_a_study_stands_is_told():
    from studies.run import Standing
    from vslice.commands.study import _how_it_stands

    assert _how_it_stands(Standing(30, 10, 0, 100, 2), 60) == "30 of 100, about 4 min left"
    assert _how_it_stands(Standing(90, 10, 3, 100, 1), 80) == "90 of 100, 3 failed, about 10 s left"
    assert _how_it_stands(Standing(10, 10, 0, 100, 0), 80) == "10 of 100, waiting for a worker"


def test_a_machine_of_ones_own_is_known_by_what_it_says(tmp_path):
    from vslice.experiment import VOCABULARY

    file = tmp_path / "mine.toml"
    file.write_text("extends = 'paper'")
    (level,) = VOCABULARY["machine"]("mine.toml", tmp_path)
    task = {"tiles": "1x1", "machine": level, "objective": "straight", "method": "greedy"}
    as_shipped = experiment(task | {"machine": "paper"})
    assert experiment(task)["travel_mm"] == as_shipped["travel_mm"]
    file.write_text("extends = 'paper'\n[motion]\ntravel_speed_mm_s = 5")
    with pytest.raises(ValueError, match="has changed since the study was begun"):
        experiment(task)
    file.write_text("[motion]\nspeedy = 5")
    with pytest.raises(ValueError, match="speedy"):
        VOCABULARY["machine"]("mine.toml", tmp_path)


def test_a_task_has_the_figures_that_are_declared(tmp_path):
    plain = experiment({"tiles": "2x1", "machine": "paper", "objective": "straight", "method": "greedy"})
    whole = experiment(
        {"tiles": "1x1", "tile_mm": 4.0, "spacing_mm": 0.4, "nozzle": "25G", "machine": "marlin-syringe",
         "tilts": "-10..10", "motion.travel_speed_mm_s": 20.0, "effort": "quick", "program": True}
    )  # fmt: skip
    assert set(plain) < set(whole) == set(FIGURES)
    assert whole["cuts"] == whole["pieces"] - whole["toolpaths"]
    assert whole["total_s"] > whole["printing_s"] > 0
    for name, value in whole.items():
        assert value is None or isinstance(value, FIGURES[name]), name
    assert set(METHOD_NAMES) == set(sequence.METHODS)
    assert DEFAULTS["method"] == "auto"


def test_a_file_that_changed_is_an_error_of_its_task(tmp_path):
    from vslice.experiment import VOCABULARY

    (tmp_path / "a.json").write_text('{"tile_mm": 1, "spacing_mm": 0.2, "angles_deg": [[10]]}')
    (level,) = VOCABULARY["grid"]("a.json", tmp_path)
    assert experiment({"grid": level, "machine": "paper", "objective": "straight"})["toolpaths"] > 0
    (tmp_path / "a.json").write_text('{"tile_mm": 1, "spacing_mm": 0.2, "angles_deg": [[20]]}')
    with pytest.raises(ValueError, match="has changed since the study was begun"):
        experiment({"grid": level, "machine": "paper", "objective": "straight"})
