"""What a report says of rows whose answer is known."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from studies import Factor, Study, StudyError, statistics
from studies.design import key_of
from studies.figures import draw, label
from studies.report import report
from studies.store import Store
from studies.written import as_csv, as_latex, as_markdown

FIGURES = {"toolpaths": int, "travel_mm": float, "unit": str, "cost": float, "stopped": bool}
SIZES = {"2x2": 50, "4x4": 200, "8x8": 800}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Travel is 0.2 n for greedy and 0.1 n ** 0.9 for auto, with noise that both have."""
    place = tmp_path_factory.mktemp("rows")
    study = Study(
        "Known_rows",
        (
            Factor("tiles", tuple(SIZES)),
            Factor("sheet", tuple(range(12))),
            Factor("method", ("greedy", "auto")),
        ),
    )
    random = np.random.default_rng(3)
    noise = random.normal(1, 0.05, (3, 12))
    with Store(place, study, FIGURES, "1") as store:
        for index, task in enumerate(study.tasks()):
            n = SIZES[task["tiles"]]
            much = noise[list(SIZES).index(task["tiles"]), task["sheet"]]
            travel = much * (0.2 * n if task["method"] == "greedy" else 0.1 * n**0.9)
            row = {
                "toolpaths": n,
                "travel_mm": float(travel),
                "unit": "mm",
                "cost": float(travel),
                "stopped": False,
            }
            error = "ValueError: broken" if index == 71 else None
            store.append(
                [{"index": index, "key": key_of(task), **task, **row, "error": error, "seconds": 0.1}]
            )
    return place


def test_means_pairs_and_laws_are_what_was_put_in(folder):
    made = report(folder)
    assert made.treatments == ["tiles", "method"]
    assert list(made.outcomes) == ["travel_mm"]
    assert any("1 of 72 tasks failed" in note and "broken" in note for note in made.notes)
    tables = {table.name: table for table in made.tables}
    assert set(tables) == {"means", "percentiles", "pairs_method", "effects", "scaling"}
    first = tables["means"].rows[0]
    assert first[:3] == ["2x2", "greedy", 12]
    assert first[3].low < first[3].value < first[3].high
    assert first[3].value == pytest.approx(10, rel=0.05)
    for row in tables["pairs_method"].rows:
        n = SIZES[row[0]]
        assert row[1:3] == ["auto", "greedy"]
        assert row[6].value == pytest.approx(100 * (0.5 * n**-0.1 - 1))  # noise cancels out on the same sheet
        assert row[6].high - row[6].low < 1e-6
        assert row[7] == "100 %"
    laws = {row[0]: row for row in tables["scaling"].rows}
    assert laws["greedy"][3].value == pytest.approx(1.0, abs=0.03)
    assert laws["auto"][3].low < 0.9 < laws["auto"][3].high
    assert laws["auto"][5] > 0.98


def test_the_tables_are_written_three_ways(folder):
    made = report(folder)
    rows = list(csv.DictReader(io.StringIO(as_csv(made.tables[0]))))
    assert float(rows[0]["travel_mm low"]) < float(rows[0]["travel_mm"]) < float(rows[0]["travel_mm high"])
    text = as_markdown(made)
    assert text.startswith("# Known_rows\n")
    assert "| tiles | method | n | travel_mm |" in text
    assert text == as_markdown(report(folder))  # the same rows give the same intervals
    latex = as_latex(made)
    assert r"Known\_rows" in latex
    assert latex.count(r"\begin{tabular}") == latex.count(r"\end{tabular}") == len(made.tables)
    assert "R\\textsuperscript{2}" in latex


def test_pictures_are_drawn_and_always_the_same(folder):
    made = report(folder)
    drawn = draw(made, "pdf")
    assert set(drawn) == {"travel_mm_tiles.pdf", "travel_mm_method.pdf", "travel_mm_scaling.pdf"}
    assert all(data.startswith(b"%PDF") for data in drawn.values())
    assert draw(made, "pdf") == drawn


def test_a_study_says_what_its_report_shows(tmp_path):
    asked = Study("shown", (Factor("sheet", (0, 1)),), figures=("toolpaths",))
    rows = [
        {"index": k, "key": key_of({"sheet": k}), "sheet": k, "toolpaths": 5 + k, "travel_mm": 1.0 + k, "error": None}
        for k in (0, 1)
    ]  # fmt: skip
    with Store(tmp_path, asked, FIGURES, "1") as store:
        store.append(rows)
    assert report(tmp_path).outcomes == ["toolpaths"]
    assert report(tmp_path, ["travel_mm"]).outcomes == ["travel_mm"]
    with Store(tmp_path, replace(asked, figures=("travel_mm",)), FIGURES, "1"):
        pass  # it is the same study
    assert report(tmp_path).outcomes == ["travel_mm"]


def test_axes_say_units():
    assert label("travel_mm") == "travel, mm"
    assert label("nozzle.tip_width_mm") == "nozzle tip width, mm"
    assert label("peak_mb") == "peak, MB"
    assert label("nodes_visited") == "nodes visited"


def test_no_such_figure_is_named_with_those_that_there_are(folder):
    with pytest.raises(StudyError, match="no figure 'speed'; known: .*travel_mm"):
        report(folder, ["speed"])


def test_intervals_of_few_and_of_equal_values():
    assert np.isnan(statistics.mean(np.array([3.0])).low)
    assert statistics.mean(np.full(5, 2.0)) == (2.0, 2.0, 2.0, 5)
    inside = sum(
        found.low <= 5 <= found.high
        for seed in range(60)
        for found in [statistics.mean(np.random.default_rng(seed).normal(5, 2, 30))]
    )
    assert 48 <= inside <= 60  # 95 % of them, but for the luck of sixty


def test_a_hypercube_is_reported_by_rank_correlations(tmp_path):
    study = Study(
        "cube", (Factor("x", (0.0, 1.0), (0.0, 1.0)), Factor("y", (0.0, 1.0), (0.0, 1.0))), samples=50
    )
    with Store(tmp_path, study, {"travel_mm": float, "unit": str, "cost": float}, "1") as store:
        for index, task in enumerate(study.tasks()):
            travel = float(np.exp(task["x"]))
            row = {"travel_mm": travel, "unit": "mm", "cost": travel, "error": None, "seconds": 0.1}
            store.append([{"index": index, "key": key_of(task), **task, **row}])
    (table,) = report(tmp_path).tables
    assert table.rows[0][:2] == ["x", 50]
    assert table.rows[0][2] == pytest.approx(1.0)
    assert abs(table.rows[1][2]) < 0.4
