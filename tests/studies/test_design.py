"""A study file becomes tasks, the same ones each time, or an error that names the key."""

import numpy as np
import pytest
from study_functions import VOCABULARY

from studies import StudyError, read_study, shipped
from studies.design import key_of
from vslice.experiment import FIGURES, USUAL
from vslice.experiment import VOCABULARY as SHEETS


@pytest.fixture
def made(tmp_path):
    def make(text, vocabulary=VOCABULARY):
        (tmp_path / "study.toml").write_text(text)
        return read_study(str(tmp_path / "study.toml"), vocabulary)

    return make


def test_a_product_has_every_combination_in_the_order_of_the_file(made):
    study = made("[factors]\nx = [1, 2, 3]\nkind = ['a', 'b']\n[factors.motion]\nspeed = 5")
    tasks = list(study.tasks())
    assert len(study) == len(tasks) == 6
    assert [(task["x"], task["kind"]) for task in tasks[:3]] == [(1, "a"), (1, "b"), (2, "a")]
    assert tasks[0]["motion.speed"] == 5
    assert len({key_of(task) for task in tasks}) == 6
    assert key_of(dict(reversed(tasks[0].items()))) == key_of(tasks[0])


def test_ranges_have_steps_and_counts_count(made):
    study = made(
        "[factors]\nx = {low = 1, high = 100, steps = 3, log = true}\nsheet = {count = 4, first = 2}"
    )
    assert list(study.factors[0].levels) == pytest.approx([1, 10, 100])
    assert study.factors[1].levels == (2, 3, 4, 5)


def test_a_latin_hypercube_has_one_point_in_each_stratum_of_each_factor(made):
    text = (
        "design = 'latin-hypercube'\nsamples = 40\nseed = 3\n[factors]\n"
        "x = {low = 10, high = 20}\ny = {low = 0.01, high = 100, log = true}\nkind = ['a', 'b', 'c', 'd']\n"
        "sheet = {low = 1, high = 10, whole = true}"
    )
    tasks = list(made(text).tasks())
    assert tasks == list(made(text).tasks())
    assert sorted((np.array([task["x"] for task in tasks]) - 10) // 0.25) == list(range(40))
    logs = np.log10([task["y"] for task in tasks])
    assert sorted((logs + 2) // 0.1) == pytest.approx(list(range(40)))
    assert [sum(task["kind"] == kind for task in tasks) for kind in "abcd"] == [10] * 4
    assert {task["sheet"] for task in tasks} == set(range(1, 11))
    other = list(made(text.replace("seed = 3", "seed = 4")).tasks())
    assert other != tasks


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = ", "is no TOML"),
        ("title = 'a'", r"\[factors\] is missing"),
        ("size = 3\n[factors]\nx = 1", "no key 'size'"),
        ("[factors]\nz = 1", "factors.z: there is no such factor"),
        ("[factors]\nx = []", "factors.x: has no levels"),
        ("[factors]\nx = [1, 1]", "stands there twice"),
        ("[factors]\nx = [1, 'a']", "numbers and words"),
        ("[factors]\nx = {low = 3, high = 1, steps = 2}", "low and high"),
        ("[factors]\nx = {low = 1, high = 3}", "needs steps"),
        ("[factors]\nx = {low = -1, high = 3, steps = 2, log = true}", "must begin above 0"),
        ("[factors]\nx = {low = 1, high = 3, step = 2}", "no key 'step'"),
        ("[factors]\nx = {count = 0}", "whole numbers"),
        ("[factors]\nx = {count = 4000}\ny = {count = 4000}", "is the most"),
        ("design = 'random'\n[factors]\nx = 1", "must be one of"),
        ("design = 'latin-hypercube'\n[factors]\nx = 1", "needs"),
        ("samples = 3\n[factors]\nx = 1", "belong to a latin-hypercube"),
        ("design = 'latin-hypercube'\nsamples = 0\n[factors]\nx = 1", "samples 0 must be"),
        ("seed = -1\n[factors]\nx = 1", "seed -1"),
        ("figures = 'travel_mm'\n[factors]\nx = 1", "must be a list"),
        ("program = 1\n[factors]\nx = 1", "true or false"),
    ],
)
def test_what_is_wrong_is_named(made, text, said):
    with pytest.raises(StudyError, match=said):
        made(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tiles = '4 by 4'", "number of tiles such as 4x4"),
        ("method = 'best'", "must be one of auto"),
        ("nozzle = '99G'", "no nozzle '99G'"),
        ("machine = 'none'", "no shipped profile"),
        ("spacing_mm = 0", "from 0.01"),
        ("sheet = -1", "whole number"),
        ("grid = 'nowhere'", "no file or folder"),
        ("tilts = '30'", "range of tilts"),
        ("printer.baud = 9600", "no such factor"),
    ],
)
def test_what_sheets_and_machines_may_be(made, text, said):
    with pytest.raises(StudyError, match=said):
        made(f"[factors]\n{text}", SHEETS)


def test_what_a_file_does_not_name_is_as_usual_and_in_every_task(tmp_path):
    (tmp_path / "study.toml").write_text("figures = ['square']\n[factors]\nx = [1, 2]\nkind = 'a'")
    usual = {"kind": "b", "y": 3}
    study = read_study(str(tmp_path / "study.toml"), VOCABULARY, usual, ("square", "half"))
    assert [(task["kind"], task["y"]) for task in study.tasks()] == [("a", 3), ("a", 3)]
    assert study.figures == ("square",)
    with pytest.raises(StudyError, match="no figure 'square'; known: half"):
        read_study(str(tmp_path / "study.toml"), VOCABULARY, usual, ("half",))


def test_the_shipped_studies_can_be_read():
    assert set(shipped()) == {"table-one", "greedy-gap", "tilts", "nozzle-width"}
    for name in shipped():
        study = read_study(name, SHEETS, USUAL, (*FIGURES, "seconds"))
        assert study.factors[0].name == "sheet"  # so that a part of it shows something of every level
        assert len(study) == len(list(study.tasks()))
    with pytest.raises(StudyError, match="Shipped studies: greedy-gap"):
        read_study("nothing", SHEETS)


def test_a_folder_with_results_hides_no_shipped_study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tilts").mkdir()
    assert len(read_study("tilts", SHEETS, USUAL, (*FIGURES, "seconds"))) == 300
    (tmp_path / "tilts").rmdir()
    (tmp_path / "tilts").write_text('[factors]\nsheet = { count = 1 }\ntiles = "2x2"\n')
    assert len(read_study("tilts", SHEETS, USUAL, (*FIGURES, "seconds"))) == 1
