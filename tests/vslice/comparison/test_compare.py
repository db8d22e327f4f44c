"""``vslice compare``: every cell of its table, its picture, and what it refuses."""

import csv
import io
import json
import math
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import profiles
from gcode import program
from slicer import sequence, travel
from slicer.sequence.problem.search import Progress
from vslice import comparison
from vslice.comparison import load_instance, methods
from vslice.objective import objective_of
from vslice.terminal import session

ONE_TILE = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'
REFERENCE = Path(__file__).parents[2] / "data" / "reference"
HEADS = [
    "method",
    "J mean [mm]",
    "J best [mm]",
    "routed [mm]",
    "travel time [s]",
    "J bound [mm]",
    "J above bound %",
    "J below greedy %",
    "nodes",
    "states",
    "run [s]",
]
KEYS = [
    "method",
    "travel_mean_mm",
    "travel_best_mm",
    "routed_mean_mm",
    "time_mean_s",
    "cost_mean",
    "cost_bound",
    "travel_bound_mm",
    "travel_gap_percent",
    "travel_below_greedy_percent",
    "nodes_visited",
    "states_created",
    "seconds",
]


def estimated(plan, profile):
    """Seconds of all travels as ``slice`` puts them into its table; an instance has no spacing."""
    return program.lay_out(plan, profile, np.full(len(plan.toolpaths), 0.4)).times.travel_s


def travel_times(plan, motion, machine):
    """Seconds of every travel of a plan on an XZ machine, by the formulas of a trapezoidal profile."""
    times = []
    for k in range(1, len(plan.toolpaths)):
        way = np.vstack(
            [
                plan.toolpaths[k - 1, 1],
                plan.via[plan.via_start[k] : plan.via_start[k + 1]],
                plan.toolpaths[k, 0],
            ]
        )
        seconds = whole = 0.0
        for dx, dz in np.diff(way, axis=0):
            length = math.hypot(dx, dz)
            if length < 1e-9:
                continue
            share = {0: abs(dx) / length, 2: abs(dz) / length}
            v = min(
                [
                    motion.travel_speed_mm_s,
                    *(machine.max_speed_mm_s[a] / s for a, s in share.items() if s),
                ]
            )
            acc = min(
                [
                    motion.travel_acceleration_mm_s2,
                    *(machine.max_acceleration_mm_s2[a] / s for a, s in share.items() if s),
                ]
            )
            seconds += 2 * math.sqrt(length / acc) if length < v * v / acc else length / v + v / acc
            whole += length
        if whole > motion.retract_from_mm:
            speed = min(motion.retract_speed_mm_s, machine.max_speed_mm_s[3])
            seconds += (2 * motion.retract_mm + motion.retract_extra_mm) / speed
        times.append(seconds)
    return sum(times)


@pytest.fixture(scope="module")
def expected():
    """The table of aco, exact and greedy on 3x3 tiles with two seeds, without ``vslice.comparison``; but no seconds."""
    problem = load_instance(REFERENCE / "3x3_s1.json", "corner").problem
    profile = profiles.load("marlin-generic", ("motion.clearance_mm=0.3",))
    found = {
        method: [sequence.solve(problem, method=method, seed=seed, effort="quick") for seed in seeds]
        for method, seeds in (("aco", [0, 1]), ("exact", [0]), ("greedy", [0]))
    }
    bound = found["exact"][0].lower_bound_mm
    assert bound == pytest.approx(11.8226, abs=1e-4)  # tests/data/reference/reference.json
    rows = []
    for method, results in found.items():
        plans = [
            travel.plan(problem.segments, result.order, result.flipped, clearance_mm=0.3)
            for result in results
        ]
        straight = [travel.straight_mm(plan.toolpaths) for plan in plans]
        mean = sum(straight) / len(straight)
        rows.append(
            {
                "method": method,
                "travel_mean_mm": mean,
                "travel_best_mm": min(straight),
                "routed_mean_mm": sum(plan.routed_mm for plan in plans) / len(plans),
                "time_mean_s": sum(estimated(plan, profile) for plan in plans) / len(plans),
                "cost_mean": mean,
                "cost_bound": max(result.lower_bound for result in results),
                "travel_bound_mm": max(result.lower_bound_mm for result in results),
                "travel_gap_percent": (mean - bound) / bound * 100,
                "travel_below_greedy_percent": None,
                "nodes_visited": round(sum(result.nodes_visited for result in results) / len(results)),
                "states_created": round(sum(result.states_created for result in results) / len(results)),
            }
        )
    greedy_mm = rows[-1]["travel_mean_mm"]
    for row in rows:
        row["travel_below_greedy_percent"] = (greedy_mm - row["travel_mean_mm"]) / greedy_mm * 100
    # A wrong column must not look like another one.
    assert rows[0]["travel_mean_mm"] > rows[0]["travel_best_mm"] > bound
    assert rows[0]["routed_mean_mm"] > rows[0]["travel_mean_mm"] + 0.1
    assert min(row["nodes_visited"] for row in rows) > 0
    assert min(row["states_created"] for row in rows[1:]) > 0  # ants count none
    return rows


def words(out, *more):
    setting = ["--set", "motion.clearance_mm=0.3"]
    methods = ["--methods", "aco,exact,greedy", "--seeds", "2", "--effort", "quick"]
    return ["compare", REFERENCE / "3x3_s1.json", "-p", "paper", *methods, *setting, "-o", out, *more]


@pytest.mark.parametrize("name", ["table.json", "table.csv", "table.md", "table.MD", "-"])
def test_every_cell_of_the_table(run, expected, monkeypatch, name):
    seconds = {}

    def watched(problem, **options):
        result = solve(problem, **options)
        if problem.n == 122:
            seconds.setdefault(options["method"], []).append(result.runtime_s)
        return result

    solve = sequence.solve
    monkeypatch.setattr(sequence, "solve", watched)
    code, out, _ = run(*words(name))
    assert code == 0
    # Before them come the parts that load the code, and on so small a sheet one of them is the whole.
    seconds = {method: np.median(times[-2 if method == "aco" else -1 :]) for method, times in seconds.items()}
    text = out if name == "-" else Path(name).read_text()
    wanted = [{**row, "seconds": seconds[row["method"]]} for row in expected]
    if name.endswith("json"):
        got = json.loads(text)
        assert [list(row) for row in got] == [KEYS] * 3
        for row, want in zip(got, wanted, strict=True):
            assert_same(row, want)
    elif name.endswith("csv"):
        got = list(csv.DictReader(io.StringIO(text)))
        assert list(got[0]) == KEYS
        for row, want in zip(got, wanted, strict=True):
            read = {
                key: value if key == "method" else float(value) if value else None
                for key, value in row.items()
            }
            assert_same(read, want)
    else:
        head, rule, *lines = text.splitlines()
        assert [cell.strip() for cell in head.strip("|").split("|")] == HEADS
        assert rule == "|---" * len(HEADS) + "|"
        for line, want in zip(lines, wanted, strict=True):
            shown = [key for key in KEYS if not key.startswith("cost_")]
            assert line == "| " + " | ".join(cell(key, want[key]) for key in shown) + " |"


def assert_same(row, want):
    for key in KEYS:
        if want[key] is None or isinstance(want[key], str):
            assert row[key] == want[key], key
        else:
            assert row[key] == pytest.approx(want[key], rel=1e-9, abs=1e-9), key


def cell(key, value):
    if value is None or isinstance(value, str):
        return value or ""
    if key.endswith("_mm"):
        return f"{value:.4f}"
    return (
        str(value)
        if key in ("nodes_visited", "states_created")
        else f"{value + 0.0:.2f}".replace("-0.00", "0.00")
    )


def test_greedy_counts_for_the_column_below_it_even_where_it_has_no_row(run, expected):
    call = words("table.json")
    call[call.index("aco,exact,greedy")] = "exact"
    call[call.index("--seeds") + 1] = "1"
    assert run(*call)[0] == 0
    (row,) = json.loads(Path("table.json").read_text())
    assert row["travel_below_greedy_percent"] == pytest.approx(expected[1]["travel_below_greedy_percent"])


def test_what_was_minimised_and_its_bound_stand_in_its_own_unit(run):
    rows = {}
    for objective in ("routed", "time"):
        call = [
            "compare",
            REFERENCE / "2x2_s1.json",
            "-p",
            "paper",
            "--methods",
            "greedy,exact",
            "--objective",
            objective,
        ]
        out = run(*call)[1]
        head = [cell.strip() for cell in out.splitlines()[0].split("|")]
        assert f"minimised [{'s' if objective == 'time' else 'mm'}]" in head
        rows[objective] = [
            dict(zip(head, [cell.strip() for cell in line.split("|")], strict=True))
            for line in out.splitlines()[2:]
        ]
    greedy, proved = rows["time"]
    problem, profile = (
        load_instance(REFERENCE / "2x2_s1.json", "corner").problem,
        profiles.load("marlin-generic"),
    )
    result = sequence.solve(problem, method="greedy", objective=objective_of(profile, "time"))
    plan = travel.plan(
        problem.segments, result.order, result.flipped, clearance_mm=profile.motion.clearance_mm
    )
    by_hand = travel_times(plan, profile.motion, profile.machine)
    assert float(greedy["minimised [s]"]) == pytest.approx(by_hand, abs=0.006)
    assert float(greedy["travel time [s]"]) < by_hand  # the machine rounds corners
    assert 0.0 < float(greedy["its bound [s]"]) < float(greedy["minimised [s]"])
    assert proved["its bound [s]"] == proved["minimised [s]"]
    greedy, proved = rows["routed"]
    assert greedy["minimised [mm]"] == pytest.approx(greedy["routed [mm]"])
    assert proved["its bound [mm]"] == proved["minimised [mm]"]


def test_travel_time_is_that_of_the_table_of_slice(run):
    sheet = Path(__file__).parents[3] / "tests" / "data" / "tissue" / "muscle_us_8x8.json"
    said = run(sheet, "-o", "x.gcode", "--method", "greedy", "--objective", "straight")[2]
    out = run("compare", sheet, "--methods", "greedy", "-o", "table.json")
    assert out[0] == 0
    (row,) = json.loads(Path("table.json").read_text())
    assert row["time_mean_s"] == pytest.approx(
        float(re.search(r"^travel +([\d.]+) s", said, re.M)[1]), abs=0.06
    )


@pytest.mark.parametrize("objective", ["straight", "routed", "time"])
def test_methods_that_are_run_once_draw_nothing(objective):
    problem = load_instance(REFERENCE / "2x2_s1.json", "corner").problem
    goal = objective_of(profiles.load("marlin-generic"), objective)
    listed = comparison.runs(list(sequence.METHODS), 3, objective)
    once = [method for method in sequence.METHODS if listed.count((method, 1)) == 0]
    assert set(once) >= {"greedy", "multistart"}
    assert len(listed) == len(set(listed)) == 3 * len(sequence.METHODS) - 2 * len(once)
    for method in once:
        first, second = (
            sequence.solve(problem, method=method, seed=seed, effort="quick", objective=goal)
            for seed in (0, 5)
        )
        assert first.order.tolist() == second.order.tolist()
        assert first.flipped.tolist() == second.flipped.tolist()
    assert comparison.runs(["auto"], 2, objective) == [("auto", 0), ("auto", 1), ("greedy", 0)]


class Told(session.Steps):
    """Keeps what it is told."""

    def __init__(self):
        self.steps, self.details = [], []

    def __call__(self, name):
        self.steps.append(name)

    def detail(self, text):
        self.details.append(text)


def test_the_bar_has_a_step_for_each_run_and_shows_best_and_bound(run, monkeypatch):
    told, totals = Told(), []

    class Progressing:
        def __init__(self, total):
            totals.append(total)

        def __enter__(self):
            return told

        def __exit__(self, *_):
            pass

    monkeypatch.setattr("vslice.commands.compare.progress", Progressing)
    run(
        "compare",
        REFERENCE / "2x2_s1.json",
        "-p",
        "paper",
        "--methods",
        "exact,local",
        "--seeds",
        "3",
        "--effort",
        "quick",
    )
    assert totals == [len(told.steps)] == [7]
    assert told.steps == [
        "loading",
        "exact, seed 0",
        "local, seed 0",
        "local, seed 1",
        "local, seed 2",
        "greedy, seed 0",
        "without precedence",
    ]
    assert any("5.68 mm, at least 5.6" in text for text in told.details), told.details


def test_so_far_names_the_unit():
    assert session.so_far(Progress("kicks", 12.345, None), "s") == "kicks: 12.35 s"
    assert session.so_far(Progress("bound", 12.0, 11.0), "mm") == "bound: 12.00 mm, at least 11.00"


@pytest.fixture
def drawn(run, monkeypatch):
    """Run compare with --plot on 2x2 tiles, and give the axes that it drew and the code and texts."""
    figures = []
    draw = comparison.draw_runs
    monkeypatch.setattr(comparison, "draw_runs", lambda *args: figures.append(draw(*args)) or figures[-1])

    def call(*more):
        effort = [] if "greedy" in more else ["--effort", "quick"]  # greedy alone knows no effort
        ended = run("compare", REFERENCE / "2x2_s1.json", "-p", "paper", *effort, "--plot", "runs.svg", *more)
        assert ended[0] == 0, ended
        return figures[-1].axes[0], ended

    return call


def test_loading_the_code_counts_for_no_run(drawn, monkeypatch):
    """The first call of a method, which loads or compiles, is in no curve, however long it takes."""
    solve, called, lost = sequence.solve, set(), [0.0]

    def slow_at_first(part, **options):
        if options["method"] not in called:
            called.add(options["method"])
            lost[0] += 1e6
        return solve(part, **options)

    monkeypatch.setattr(sequence, "solve", slow_at_first)
    monkeypatch.setattr(methods, "time", SimpleNamespace(perf_counter=lambda: time.perf_counter() + lost[0]))
    axes, _ = drawn("--methods", "exact,local", "--seeds", "2")
    assert called == {"exact", "local", "greedy"}
    assert len(axes.lines) == 3
    assert max(line.get_xdata().max() for line in axes.lines) < 1e6


def test_the_parts_call_all_that_the_sheet_calls():
    """After ``warm_up`` a run loads no more compiled code."""
    script = """
import sys
import profiles
from gcode import program
from slicer import sequence
from vslice.comparison import Machine, load_instance, run_methods, warm_up
from vslice.objective import objective_of
from vslice.terminal.session import Steps
from pathlib import Path

def loaded():
    return {
        (value.__module__, value.__name__, str(signature))
        for name, module in list(sys.modules.items()) if name.startswith("slicer")
        for value in vars(module).values() if hasattr(value, "py_func")
        for signature in value.signatures
    }

problem = load_instance(Path(sys.argv[1]), "corner").problem
methods = ["auto", "mcts"]
machine = Machine(profiles.load("marlin-generic"))
warm_up(problem, methods, "straight", machine)
before = loaded()
assert len(before) > 20
run_methods(problem, methods, seeds=1, effort="default", objective="straight", machine=machine,
            step=Steps())
assert loaded() == before, loaded() - before
"""
    subprocess.run([sys.executable, "-c", script, str(REFERENCE / "6x6_s1.json")], check=True)


def test_the_picture_shows_what_was_asked_for_and_nothing_else(drawn):
    axes, _ = drawn("--methods", "exact,local", "--seeds", "2")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["exact", "local"]
    assert len(axes.lines) == 3
    assert "straight" in axes.get_title()
    assert "2x2_s1.json: 56 toolpaths" in axes.get_title()
    assert axes.get_ylabel() == "straight travel J above the best bound [%]"
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(0, abs=1e-3)
    assert b"<svg" in Path("runs.svg").read_bytes()


@pytest.mark.parametrize(
    ("objective", "what"), [("routed", "routed travel"), ("time", "time of travels from stop to stop")]
)
def test_the_picture_of_another_objective_shows_the_gap_to_its_own_bound(drawn, objective, what):
    axes, _ = drawn("--methods", "auto", "--seeds", "1", "--objective", objective, "-o", "table.json")
    assert axes.get_ylabel() == f"{what} above the best bound [%]"
    assert objective in axes.get_title()
    (row,) = json.loads(Path("table.json").read_text())
    gap = 100 * (row["cost_mean"] / row["cost_bound"] - 1)
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(gap, abs=1e-6)
    assert axes.lines[0].get_ydata()[0] > gap + 1.0  # it began with something worse


def test_without_a_bound_the_picture_shows_straight_travel(drawn, monkeypatch):
    monkeypatch.setattr(sys.modules["slicer.sequence.solve"], "raise_cheap_bound", lambda search: None)
    axes, (_, out, _) = drawn("--methods", "greedy")
    assert axes.get_ylabel() == "straight travel J [mm]"
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(8.1652, abs=1e-4)
    assert [cell.strip() for cell in out.splitlines()[2].split("|")][6:8] == ["", ""]


def test_methods_may_have_spaces_and_count_once(run):
    Path("sheet.json").write_text(ONE_TILE)
    code, out, _ = run("compare", "sheet.json", "--methods", " greedy, auto,greedy ", "--effort", "quick")
    assert code == 0
    assert [line.split("|")[1].strip() for line in out.splitlines()[2:]] == ["greedy", "auto"]


def test_compare_takes_a_reference_instance(run):
    _, out, _ = run(
        "compare", REFERENCE / "2x2_s1.json", "-p", "paper", "--methods", "greedy,exact", "--seeds", "1"
    )
    assert "5.6762" in out


INPUTS = {"sheet.json": ONE_TILE, "lab.csv": "[machine]\n", "lab.png": "[machine]\n"}
MISTAKES = [
    (["-o", "sheet.json"], 2, "sheet.json is the input itself; name another file with -o."),
    (["-o", "same.json"], 2, "same.json is the input itself; name another file with -o."),
    (["--plot", "same.png"], 2, "same.png is the input itself; name another file with --plot."),
    (["-p", "lab.csv", "-o", "lab.csv"], 2, "lab.csv is the input itself; name another file with -o."),
    (
        ["-p", "lab.png", "--plot", "lab.png"],
        2,
        "lab.png is the input itself; name another file with --plot.",
    ),
    (["--plot", "p.xyz"], 2, "p.xyz: a picture must end in .png, .svg or .pdf, not '.xyz'."),
    (["--plot", "plot"], 2, "plot: a picture must end in .png, .svg or .pdf, not ''."),
    (["--plot", "nofolder/p.png"], 2, "nofolder/p.png: there is no folder nofolder; make it first."),
    (["-o", "nofolder/t.md"], 2, "nofolder/t.md: there is no folder nofolder; make it first."),
    (["-o", "folder.md"], 2, "folder.md is a folder; name a file in it."),
    (["-o", "t.txt"], 2, "t.txt: a table must end in .csv, .md or .json, not 'txt'."),
    (["--methods", "atuo"], 2, "There is no method 'atuo'; there are auto, "),
    (["--methods", "atuo"], 2, "Did you mean 'auto'?"),
    (["--methods", ""], 2, "There is no method ''"),
    (["--methods", "auto,,greedy"], 2, "There is no method ''"),
]


@pytest.mark.parametrize(("more", "exit_code", "says"), MISTAKES, ids=[" ".join(m[0]) for m in MISTAKES])
def test_mistakes_are_told_before_anything_is_solved(run, tmp_path, monkeypatch, more, exit_code, says):
    for name, text in INPUTS.items():
        Path(name).write_text(text)
    Path("same.json").symlink_to("sheet.json")
    os.link("sheet.json", "same.png")
    Path("folder.md").mkdir()
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(sequence, "solve", lambda *_, **__: pytest.fail("the search began"))
    code, out, err = run("compare", "sheet.json", *more)
    assert (code, out) == (exit_code, "")
    assert says in err
    assert "defect" not in err
    assert sorted(tmp_path.iterdir()) == before
    assert {name: Path(name).read_text() for name in INPUTS} == INPUTS


def test_table_and_picture_need_a_file_each(run):
    Path("sheet.json").write_text(ONE_TILE)
    Path("t.md").write_text("old")
    Path("t.png").symlink_to("t.md")
    code, _, err = run("compare", "sheet.json", "-o", "t.md", "--plot", "t.png")
    assert code == 2
    assert "t.png is to hold the table; name another file with --plot." in err


def instance(**changes):
    """A reference instance of two toolpaths, one above the other, with changes; None takes a key away."""
    whole = {"segments": [[[0, 0], [1, 0]], [[0, 1], [1, 1]]], "first": 0} | changes
    return json.dumps({key: value for key, value in whole.items() if value != "missing"})


WRONG = [
    ({"first": "0"}, 'first is "0", but there are 2 toolpaths; give a whole number from 0 to 1, or null'),
    ({"first": 0.5}, "first is 0.5, but there are 2 toolpaths; give a whole number from 0 to 1, or null"),
    ({"first": True}, "first is true, but there are 2 toolpaths; give"),
    ({"first": [0]}, "first is [0], but there are 2 toolpaths; give"),
    ({"first": 2}, "first is 2, but there are 2 toolpaths; give a whole number from 0 to 1"),
    ({"first": -1}, "first is -1, but there are 2 toolpaths; give a whole number from 0 to 1"),
    ({"first": 1}, "first toolpath 1 lies above toolpath 0, which must be printed before it."),
    ({"first": "missing"}, "key 'first' is missing; an instance has both, 'first' being the number"),
    ({"segments": "missing"}, "key 'segments' is missing; an instance has both, 'segments' being"),
    ({"segments": []}, "segments holds 0 toolpaths, but there must be at least 1"),
    ({"segments": {}}, "segments is {}; it must be a list, [[[x, y], [x, y]], ...]."),
    ({"segments": None}, "segments is null; it must be a list"),
    ({"segments": [1, 2]}, "segments[0] is 1, but a toolpath has 2; write [[x, y], [x, y]]."),
    ({"segments": [[[0, 0]]]}, "segments[0] holds 1 point, but a toolpath has 2"),
    ({"segments": [[[0, 0], [1, 1], [2, 2]]]}, "segments[0] holds 3 points, but a toolpath has 2"),
    ({"segments": [[[0, 0], [1]]]}, "segments[0][1] holds 1 coordinate, but a point has 2; write [x, y]"),
    ({"segments": [[[0, 0, 0], [1, 1, 1]]]}, "segments[0][0] holds 3 coordinates, but a point has 2"),
    ({"segments": [[[0, 0], [1, "1"]]]}, 'segments[0][1][1] is "1"; a coordinate must be a number of mm'),
    ({"segments": [[[0, 0], [1, None]]]}, "segments[0][1][1] is null; a coordinate must be"),
    ({"segments": [[[True, 0], [1, 0]]]}, "segments[0][0][0] is true; a coordinate must be"),
    ({"segments": [[[0, 0], [1, math.nan]]]}, "segments[0][1][1] is NaN; a coordinate must be"),
    ({"segments": [[[0, 0], [1, 2e6]]]}, "segments[0][1][1] is 2000000.0; a coordinate must be a number of mm from -100000 to 100000."),
    ({"segments": [[[0, 0], [10**400, 0]]]}, "segments[0][1][0] is 1000"),
    ({"segments": [[[0, 0], [1, 1]], [[0, 1], [1, 0]]]}, "toolpath 0 from (0, 0) to (1, 1) mm crosses or overlaps"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "says"), WRONG, ids=[json.dumps(w[0])[:40] for w in WRONG])
def test_a_wrong_instance_is_told_of_with_its_file(run, changes, says):
    Path("bad.json").write_text(instance(**changes))
    code, out, err = run("compare", "bad.json", "--methods", "greedy")
    assert (code, out) == (2, "")
    assert err.startswith(f"Error: bad.json: {says}"), err
    assert "defect" not in err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[1, 2]", "holds a list of 2, but a grid is an object"),
        ("{", "ends too early"),
        ("{}", "tile_mm"),
        ("", "is empty"),
    ],
)
def test_what_is_neither_grid_nor_instance_is_read_as_a_grid(run, text, says):
    Path("bad.json").write_text(text)
    code, _, err = run("compare", "bad.json")
    assert code == 2
    assert err.startswith("Error: bad.json: ")
    assert says in err


def test_the_start_of_an_instance_is_its_own_or_free(run):
    Path("good.json").write_text(instance(name="two", first=None))
    assert run("compare", "good.json", "--methods", "greedy")[0] == 0
    assert load_instance(REFERENCE / "2x2_s1.json", "corner").problem.first == 0
    assert load_instance(REFERENCE / "2x2_s1.json", "free").problem.first is None


def test_the_price_of_printability_stands_below_the_table(run):
    _, out, err = run("compare", REFERENCE / "3x3_s1.json", "--methods", "greedy,exact", "--seeds", "1")
    found = re.search(
        r"Without precedence, which no print can use: J ([\d.]+) mm, at least ([\d.]+) mm\. "
        r"The price of printability is ([\d.]+) to ([\d.]+) % of that\.",
        err,
    )
    travel, bound, least, most = map(float, found.groups())
    exact = float(out.splitlines()[3].split("|")[3])
    assert bound <= travel < exact
    assert least == pytest.approx(100 * (exact / travel - 1), abs=0.06)  # exact is proved
    assert most == pytest.approx(100 * (exact / bound - 1), abs=0.06)
    assert travel < 9.90  # 9.67 is the optimum, by HiGHS with all violated cuts of subtours
