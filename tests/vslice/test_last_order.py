"""The last order of a sheet: kept, followed under another nozzle, and never trusted."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slicer.generate import random_walk
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem, followed, solve
from vslice import last_order
from vslice.pipeline import hatched
from vslice.printable import printable

CONE = NozzleBody.of(0.3, 45.0, press_mm=0.02)


@pytest.fixture
def lines():
    return hatched(random_walk(3, 3, seed=4, low_deg=-60.0, high_deg=60.0))


def test_an_order_of_the_same_problem_comes_back_to_the_bit(lines):
    shaped = printable("sheet", lines, "corner")
    found = solve(shaped.problem, method="greedy")
    assert last_order.recall(lines.segments, shaped, "b") is None
    last_order.keep(lines.segments, shaped, found, "a")
    order, flipped = last_order.recall(lines.segments, shaped, "b")
    assert np.array_equal(order, found.order)
    assert np.array_equal(flipped, found.flipped)


def test_another_nozzle_follows_it_as_far_as_it_can(lines):
    point, cone = printable("sheet", lines, "corner"), printable("sheet", lines, "corner", CONE)
    assert cone.cut is not None  # so that pieces have to find their toolpath
    found = solve(point.problem, method="greedy")
    last_order.keep(lines.segments, point, found, "a")
    order, flipped = last_order.recall(lines.segments, cone, "b")
    assert cone.problem.refusal(order, flipped) is None
    when = np.empty(point.problem.n)
    when[found.order] = np.arange(point.problem.n)
    # Most toolpaths that follow one another did so before.
    assert np.corrcoef(when[cone.toolpath[order]], np.arange(cone.problem.n))[0, 1] > 0.9


def test_the_search_that_it_came_out_of_does_not_start_from_it(lines):
    shaped = printable("sheet", lines, "corner")
    found = solve(shaped.problem, method="greedy")
    last_order.keep(lines.segments, shaped, found, "a")
    assert last_order.recall(lines.segments, shaped, "a") is None
    last_order.keep(lines.segments, shaped, replace(found, stopped=True), "a")
    assert last_order.recall(lines.segments, shaped, "a") is not None


def test_another_sheet_knows_nothing_of_it(lines):
    shaped = printable("sheet", lines, "corner")
    last_order.keep(lines.segments, shaped, solve(shaped.problem, method="greedy"), "a")
    assert last_order.recall(lines.segments + 1e-9, shaped, "b") is None


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04", b"no archive at all"])
def test_a_damaged_file_is_thrown_away(lines, damage):
    shaped = printable("sheet", lines, "corner")
    last_order.keep(lines.segments, shaped, solve(shaped.problem, method="greedy"), "a")
    (file,) = last_order.folder().iterdir()
    file.write_bytes(damage)
    assert last_order.recall(lines.segments, shaped, "b") is None
    assert not file.exists()


def test_a_file_of_other_toolpaths_is_not_believed(lines):
    shaped = printable("sheet", lines, "corner")
    last_order.keep(lines.segments, shaped, solve(shaped.problem, method="greedy"), "a")
    (file,) = last_order.folder().iterdir()
    small = {"toolpath": np.zeros(2, np.int32), "middle": np.zeros((2, 2)), "towards": np.ones((2, 2))}
    np.savez(file, **small, asked="a")
    assert last_order.recall(lines.segments, shaped, "b") is None


def test_only_so_many_are_kept(lines, monkeypatch):
    monkeypatch.setattr(last_order, "MOST_KEPT", 2)
    shaped = printable("sheet", lines, "corner")
    found = solve(shaped.problem, method="greedy")
    for shift in range(4):
        last_order.keep(lines.segments + shift, shaped, found, "a")
    assert len(list(last_order.folder().iterdir())) == 2


def test_where_nothing_can_be_written_nothing_is_kept(lines, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(last_order.VARIABLE, str(tmp_path / "file"))
    shaped = printable("sheet", lines, "corner")
    last_order.keep(lines.segments, shaped, solve(shaped.problem, method="greedy"), "a")
    assert (tmp_path / "file").read_text() == "in the way"


@pytest.mark.parametrize("seed", range(5))
def test_following_any_ranks_can_be_printed(seed):
    random = np.random.default_rng(seed)
    problem = Problem.build(hatched(random_walk(3, 2, seed=seed)).segments, first=0, first_flipped=True)
    oriented = followed(problem, random.random(problem.n), random.random(problem.n) < 0.5)
    assert problem.refusal(oriented >> 1, oriented & 1) is None


def test_the_command_says_that_it_starts_from_there(run):
    assert run("generate", "--cols", 2, "--rows", 2, "--seed", 3, "-o", "grid.json")[0] == 0
    words = ("grid.json", "-o", "part.gcode", "--effort", "quick")
    code, _, err = run(*words, "--fresh")
    assert (code, "started from" in err) == (0, False)
    assert not last_order.folder().exists()
    assert "started from" not in run(*words)[2]
    first = Path("part.gcode").read_text()
    assert "started from" not in run(*words)[2]  # the same is asked for, and the same comes out
    assert Path("part.gcode").read_text() == first
    again = run(*words, "--set", "motion.travel_speed_mm_s=31")[2]
    assert re.search(r"^started from +the last order of the same sheet \(--fresh", again, re.M)
    assert "; vslice initial = the last order of the same sheet" in Path("part.gcode").read_text()
    assert "started from" not in run(*words, "--fresh")[2]
    assert Path("part.gcode").read_text() == first
