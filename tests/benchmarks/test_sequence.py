"""The benchmark of the sequencer: its arithmetic, and one run of it."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import profiles
from profiles.nozzles import nozzle_called
from slicer import grid
from vslice.pipeline import Search, hatched, ordered

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "sequence.py"


@pytest.fixture(scope="module")
def script():
    sys.path.insert(0, str(SCRIPT.parent))  # as it is for a script
    spec = importlib.util.spec_from_file_location("benchmark_of_sequence", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.path.remove(str(SCRIPT.parent))
    return module


@pytest.fixture(scope="module")
def instances(script):
    return sys.modules["instances"]


def row(travel, bounds, seconds=(1.0, 2.0, 4.0), proved=(False, False, False)):
    return {
        "toolpaths": 10,
        "cost": list(travel),
        "bound": list(bounds),
        "seconds": list(seconds),
        "proved": list(proved),
        "peak_mb": 99.6,
    }


def cells(script, *args, **more):
    return dict(zip(script.HEADINGS[1:], script.cells(row(*args, **more)), strict=True))


def test_travel_bound_and_gap_are_medians_each_of_its_own(script):
    got = cells(script, [12.0, 11.0, 15.0], [10.0, 8.0, 9.0])  # gaps 20, 37.5 and 66.67 %
    assert got == {
        "toolpaths": "10",
        "median": "12.000",
        "best": "11.000",
        "median / n": "1.2000",
        "bound": "9.000",
        "gap": "37.50 %",
        "proved": "0 of 3",
        "seconds": "2.00",
        "peak MB": "100",
    }


def test_without_a_bound_in_each_run_there_is_none(script):
    got = cells(script, [12.0, 11.0, 15.0], [10.0, None, 9.0])
    assert (got["bound"], got["gap"]) == ("", "")
    got = cells(script, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], proved=(True, True, True))
    assert (got["bound"], got["gap"], got["proved"]) == ("0.000", "0.00 %", "3 of 3")


def test_walks_are_counted_as_proved_where_every_run_is(script):
    rows = {
        "walk 4x4 seed 1": row([1] * 3, [1] * 3, (0.1, 0.7, 0.2), (True, True, True)),
        "walk 4x4 seed 2": row([1] * 3, [1] * 3, (0.3, 0.1, 0.2), (True, False, True)),
    }
    assert script.table_of_walks([(4, 4, 2), (6, 6, 1)], rows).splitlines()[2:] == [
        "| 4x4 | 1 of 2 | 0.70 | 100 |"
    ]
    assert script.walks_of("6x5:3") == (6, 5, 3)
    for text in ("6x6", "6:3", "0x4:1", "4x4:0", "axb:1"):
        with pytest.raises(script.argparse.ArgumentTypeError, match=f"'{text}' must be COLSxROWS:WALKS"):
            script.walks_of(text)


def test_a_run_names_the_machine_and_writes_what_it_prints(script, tmp_path):
    words = ["--seeds", "2", "--walks", "2x2:2", "--only", "*2x2*", "--json", str(tmp_path / "all.json")]
    done = subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, check=True)
    about, settings, _, *table = done.stdout.splitlines()
    for name in ("date", "cpu", "cores", "python", "numpy", "numba", "shapely"):
        assert name in about
    assert settings == "straight in mm, method auto, effort default, medians of 2 seeds"
    whole = json.loads((tmp_path / "all.json").read_text())
    assert list(whole["instances"]) == ["2x2_s1", "walk 2x2 seed 1", "walk 2x2 seed 2"]
    for line, (name, measured) in zip(table[2:5], whole["instances"].items(), strict=True):
        assert line == "| " + " | ".join([name, *script.cells(measured)]) + " |"
    assert table[2].startswith("| 2x2_s1 | 56 | 5.676 | 5.676 | 0.1014 | 5.676 | 0.00 % | 2 of 2 |")
    assert table[-1].startswith("| 2x2 | 2 of 2 |")
    assert whole["machine"]["numpy"] in about


@pytest.mark.parametrize("objective", ["time", "straight"])
def test_with_a_nozzle_the_problem_is_the_one_that_the_command_orders(instances, objective):
    root = SCRIPT.parents[1]
    setting = instances.Setting(objective, "marlin-syringe", "25G", 4.0)
    made = instances.instance_of(instances.tissue(root / "tests/data/tissue/ihc_8x8.json"), setting)
    example = grid.read(root / "examples/ihc_8x8.json")
    profile = profiles.load("marlin-syringe", tuple(nozzle_called("25G").settings()))
    search = Search(method="greedy", objective=objective, start="free")
    asked = ordered(example, hatched(example), profile, search)
    assert made.problem.n == asked.printable.problem.n > asked.printable.hatch_lines  # some are cut
    np.testing.assert_allclose(made.problem.segments, asked.printable.problem.segments, atol=1e-6)
    assert np.array_equal(made.problem.edges, asked.printable.problem.edges)
    assert not made.problem.planar
    assert made.problem.body == asked.printable.problem.body
    assert made.objective == asked.objective
    assert made.problem.first is asked.printable.problem.first is None


def test_a_sheet_that_has_a_first_toolpath_begins_at_its_corner_with_a_nozzle_too(instances):
    sheet = instances.walk(2, 2, 1)
    made = instances.instance_of(sheet, instances.Setting("time", "marlin-syringe", "32G", 4.0))
    assert (made.problem.first, made.objective.join_mm) == (0, pytest.approx(0.6))
    entered = made.problem.segments[0, int(made.problem.first_flipped)]
    assert entered[1] == made.problem.segments[0, :, 1].min()
    np.testing.assert_allclose(made.problem.segments, 4 * sheet.segments)


def test_without_a_nozzle_it_is_a_point_of_any_size_of_tile(instances):
    sheet = instances.walk(2, 2, 1)
    made = instances.instance_of(sheet, instances.Setting(tile_mm=4.0))
    assert made.problem.body.is_point
    assert made.problem.planar
    assert (made.problem.first, made.problem.first_flipped) == (0, None)
    assert np.array_equal(made.problem.segments, 4 * sheet.segments)
    same = instances.instance_of(sheet, instances.Setting())
    assert np.array_equal(same.problem.segments, sheet.segments)


def test_a_run_has_the_nozzle_and_the_width_of_a_tile_and_says_so(tmp_path):
    words = ["--profile", "marlin-syringe", "--nozzle", "25g", "--tile-mm", "4", "--seeds", "1"]
    words += ["--only", "nothing", "--json", str(tmp_path / "all.json")]
    done = subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, check=True)
    assert "medians of 1 seeds, marlin-syringe with 25g, tiles of 4 mm" in done.stdout
    whole = json.loads((tmp_path / "all.json").read_text())
    assert (whole["settings"]["nozzle"], whole["settings"]["tile_mm"]) == ("25g", 4.0)
    words += ["--one", "2x2_s1"]
    done = subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, check=True)
    measured = json.loads(done.stdout)
    assert (measured["toolpaths"], measured["proved"]) == (56, [True])
    assert measured["cost"] == [pytest.approx(28.403, abs=5e-4)]  # a point: 4 x 5.676


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--nozzle", "25H"], "25H"),
        (["--tile-mm", "0"], "--tile-mm 0 must be within 0.001 and 1000"),
        (["--profile", "none"], "none"),
    ],
)
def test_wrong_use_is_told_before_anything_runs(words, said):
    done = subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert said in done.stderr.splitlines()[-1]
    assert done.stdout == ""


def test_peak_memory_is_that_of_the_row_and_not_of_what_ran_before():
    """A process that starts after a large one has a small peak of its own."""
    child = f"import runpy; print(runpy.run_path({str(SCRIPT.with_name('machine.py'))!r})['peak_mb']())"
    parent = (
        "import subprocess, sys; block = bytearray(700_000_000); "
        f"print(subprocess.run([sys.executable, '-c', {child!r}], capture_output=True, text=True).stdout)"
    )
    done = subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True, check=True)
    assert 5 < float(done.stdout) < 300
