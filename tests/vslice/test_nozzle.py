"""The nozzle's body on the command line: by name, from a profile, in the check, in pictures and in comparison."""

import json
from pathlib import Path

import numpy as np
import pytest

import profiles
from gcode.nozzle_body import depths, parts_of
from profiles.nozzles import nozzle_called
from profiles.sections import Nozzle
from slicer.nozzle import press_depths
from vslice import pipeline
from vslice.nozzle import body_of
from vslice.reading import read_grid

GRID = '{"tile_mm": 2.0, "spacing_mm": 0.4, "angles_deg": [[-30, 20], [10, -40]]}'
VALLEY = '{"tile_mm": 2.0, "spacing_mm": 0.2, "angles_deg": [[-60, 60]]}'


def write(text):
    Path("grid.json").write_text(text)


@pytest.mark.parametrize("start", ["corner", "free"])
def test_a_sheet_is_planned_for_a_nozzle_by_name(run, start):
    write(GRID)
    _, _, err = run(
        "grid.json", "-o", "part.gcode", "--nozzle", "30g", "--method", "greedy", "--start", start
    )
    assert "30G: presses at most" in err
    text = Path("part.gcode").read_text()
    assert "; vslice nozzle = 30G" in text
    assert '; nozzle.name = "30G"' in text
    assert "; nozzle.tip_width_mm = 0.3112" in text


def test_a_nozzle_that_is_none_is_wrong_use(run):
    write(GRID)
    code, _, err = run("grid.json", "--nozzle", "25")
    assert code == 2
    assert "there is no nozzle '25'. Did you mean '25G'?" in err


def test_toolpaths_in_a_ring_are_refused_with_what_to_do(run):
    write(VALLEY)
    words = ["grid.json", "-o", "part.gcode", "--nozzle", "18G", "--method", "greedy", "--conflicts"]
    code, _, err = run(*words, "refuse")
    assert code == 2
    assert "stand in one another's way with this nozzle" in err
    assert "of tile (0, 0) would push 0." in err
    assert "--conflicts cut" in err
    assert not Path("part.gcode").exists()


def test_toolpaths_in_a_ring_are_cut_and_the_check_finds_them_whole(run):
    write(VALLEY)
    words = ["grid.json", "-o", "part.gcode", "--nozzle", "18G", "--method", "greedy"]
    _, _, err = run(*words)
    assert "cuts, and no way takes fewer than" in err
    code, out, err = run("check", "part.gcode", "--grid", "grid.json")
    assert (code, out) == (0, "")
    more = run(*words, "--set", "nozzle.overlap_mm=0.05")[2]
    assert "cuts, and no way takes fewer than" in more
    assert run("check", "part.gcode", "--grid", "grid.json")[0] == 0
    code, _, err = run(*words, "--set", "nozzle.overlap_mm=0.1")
    assert code == 2
    assert "must be below press_mm" in err


def test_pressing_lists_every_place_and_the_check_holds_it_against_the_program(run):
    write(VALLEY)
    words = ["grid.json", "-o", "part.gcode", "--nozzle", "18G", "--method", "greedy", "--conflicts", "press"]
    _, _, err = run(*words)
    assert "times too deep, by" in err
    assert " is pressed 0." in err
    allowed = err.split("unless --set nozzle.press_mm=")[1].split()[0]
    code, out, _ = run("check", "part.gcode", "--grid", "grid.json")
    assert code == 1
    assert ": nozzle: " in out
    assert run("check", "part.gcode", "--set", f"nozzle.press_mm={allowed}")[0] == 0


def test_the_check_sees_a_wider_nozzle_than_was_planned_for_and_tells_the_deepest_press(run):
    write(VALLEY)
    assert run("grid.json", "-o", "part.gcode", "-p", "paper", "--method", "greedy")[0] == 0
    code, out, err = run("check", "part.gcode")
    assert (code, out) == (0, "")
    assert "presses" not in err
    code, out, err = run("check", "part.gcode", "--nozzle", "18G")
    assert code == 1
    assert ": nozzle: " in out
    assert "nozzle 18G: presses at most 0." in err
    code, out, _ = run("check", "part.gcode", "--nozzle", "18G", "--json")
    said = json.loads(out)["nozzle"]
    assert said["allowed_mm"] == 0.1
    assert said["depth_mm"] > 0.1
    assert said["line"] > said["against"] > 0
    code, _, err = run("check", "part.gcode", "--nozzle", "18G", "--set", "nozzle.press_mm=2.0")
    assert code == 0
    assert "allowed 2.00" in err


def test_a_program_that_does_not_say_how_high_its_beads_are_is_told_why_nothing_may_press(run):
    write(VALLEY)
    assert run("grid.json", "-o", "part.gcode", "--nozzle", "32G", "--method", "greedy")[0] == 0
    words = ["check", "bare.gcode", "-p", "marlin-generic", "--nozzle", "32G"]
    text = Path("part.gcode").read_text()
    Path("bare.gcode").write_text("".join(k for k in text.splitlines(True) if not k.startswith(";")))
    code, _, err = run(*words)
    assert code == 1
    assert err.count("says how high the beads are, so nothing may press") == 1
    for more in (["--set", "nozzle.press_mm=0.1"], ["--set", "nozzle.press_mm=0.0"], ["--grid", "grid.json"]):
        assert "says how high" not in run(*words, *more)[2]


def test_a_bead_that_goes_on_into_another_spacing_is_fed_as_its_height_says(run):
    write('{"tile_mm": 2.0, "spacing_mm": [[0.2, 0.4, 0.2]], "angles_deg": [[-20, -40, 10]]}')
    words = ["grid.json", "-o", "part.gcode", "-p", "marlin-generic", "--nozzle", "32G", "--method", "greedy"]
    assert run(*words, "--set", "motion.join_spacings=5")[0] == 0
    text = Path("part.gcode").read_text()
    joined = text.split(";TOOLPATH")[1:]
    assert any(";HEIGHT" in part and ";JOIN" in part for part in joined[1:])
    code, out, err = run("check", "part.gcode", "--grid", "grid.json")
    assert (code, out) == (0, "")
    assert "joins between hatch lines" in err


@pytest.mark.parametrize(("limit", "left"), [(10.0, 7.0), (2.0, 0.0), (None, None)])
def test_what_cutting_takes_counts_towards_the_time_limit(run, monkeypatch, limit, left):
    write(VALLEY)
    now = [100.0]
    given = []
    cuts, solves = pipeline.printable, pipeline.sequence.solve

    def three_seconds(*words):
        now[0] += 3.0
        return cuts(*words)

    def noted(*words, **more):
        given.append(more.get("time_limit_s"))
        return solves(*words, **more)

    monkeypatch.setattr(pipeline.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(pipeline, "printable", three_seconds)
    monkeypatch.setattr(pipeline.sequence, "solve", noted)
    sheet = read_grid(Path("grid.json"))
    profile = profiles.load("marlin-generic", nozzle_called("18G").settings())
    search = pipeline.Search(method="local", effort="quick", time_limit_s=limit)
    pipeline.ordered(sheet, pipeline.hatched(sheet), profile, search)
    assert given == [left]


def test_what_may_not_go_downhill_is_not_extruded_over_a_hop_either(run):
    write('{"tile_mm": 2.0, "spacing_mm": 0.2, "angles_deg": [[-30, 40], [20, 80]]}')
    words = ["grid.json", "-o", "part.gcode", "--nozzle", "32G", "--method", "greedy"]
    words += ["--set", "motion.join_spacings=5"]
    assert run(*words, "--set", "nozzle.downhill_deg=0")[0] == 0
    assert run("check", "part.gcode", "--grid", "grid.json")[:2] == (0, "")
    assert "joins between hatch lines" in run("check", "part.gcode", "--grid", "grid.json")[2]
    assert run(*words)[0] == 0
    code, out, _ = run("check", "part.gcode", "--set", "nozzle.downhill_deg=0")
    assert (code, "extrudes downhill" in out) == (1, True)


def test_a_profile_of_ones_own_without_a_nozzle_is_told_once(run):
    write(GRID)
    Path("lab.toml").write_text('[gcode]\nstart = ["G28", "M109 S200"]\n[motion]\nprime_mm = 0\n')
    words = ["grid.json", "-o", "part.gcode", "-p", "lab.toml", "--method", "greedy"]
    assert run(*words)[2].count("lab.toml does not say [nozzle] tip_width_mm") == 1
    assert "tip_width_mm" not in run(*words, "--set", "nozzle.tip_width_mm=0")[2]
    assert "does not say" not in run(*words, "--nozzle", "32G")[2]


def test_what_a_profile_of_ones_own_has_of_another_nozzle_is_told_once(run):
    write(GRID)
    Path("lab.toml").write_text('extends = "marlin-generic"\n[nozzle]\ntip_width_mm = 0.3\ncone_deg = 0\n')
    words = ["grid.json", "-o", "part.gcode", "-p", "lab.toml", "--method", "greedy"]
    _, _, err = run(*words)
    rest = "cone_mm 2, length_mm 5, barrel_width_mm 8.08, shoulder_width_mm 23"
    assert err.count(f"lab.toml gives dimensions of [nozzle], but has {rest} from what it extends") == 1
    assert "nozzle             0.3 mm wide: presses" in err
    assert "from what it extends" not in run(*words, "--nozzle", "32G")[2]


def test_the_planner_gets_the_body_of_the_profile():
    profile = profiles.load("paper", ["nozzle.length_mm=4", "nozzle.tip_width_mm=0.6", "nozzle.cone_deg=45"])
    body = body_of(profile, [0.3, 0.2])
    assert body == pytest.approx((0.3, 1.0, 4.0, 4.3, 0.1, 4.3, np.inf))
    hexagon = body_of(profiles.load("marlin-generic"), [0.3, 0.2])
    assert hexagon == pytest.approx((0.5, 1.0, 5.0, 11.5, 0.1, 4.04, 2.0))
    assert body_of(profiles.load("paper"), [0.2]).is_point


@pytest.mark.parametrize("seed", range(30))
def test_planner_and_check_know_the_same_body(seed):
    random = np.random.default_rng(seed)
    sizes = {
        "tip_width_mm": [0.2, 0.5, 1.0],
        "cone_deg": [0.0, 5.0, 30.0, 60.0],
        "cone_mm": [0.0, 0.2, 0.6],
        "barrel_width_mm": [0.0, 0.3, 0.8, 2.0],
        "shoulder_width_mm": [0.0, 0.5, 2.0, 4.0],
    }
    chosen = {key: float(random.choice(values)) for key, values in sizes.items()}
    nozzle = Nozzle(**chosen, length_mm=[0.4, 1.0, None][seed % 3], press_mm=0.05)
    lines = random.uniform(-1, 1, (60, 2, 2))
    lines[::3, 1, 0] = lines[::3, 0, 0]
    printed, path = np.arange(0, 60, 2), np.arange(1, 60, 2)
    body = body_of(profiles.load("paper").model_copy(update={"nozzle": nozzle}), np.array([0.1]))
    planned = press_depths(body, lines, printed, path)
    seen = depths(parts_of(nozzle), lines[printed].reshape(-1, 4), lines[path].reshape(-1, 4)).depth
    assert np.maximum(planned, 0) == pytest.approx(np.maximum(seen, 0), abs=1e-9)


def test_nozzles_are_compared_and_the_widest_is_found(run):
    write(VALLEY)
    code, out, _ = run("nozzles", "grid.json", "--only", "18G,32G", "--json", "--plot", "a.svg")
    assert code == 0
    said = json.loads(out)
    wide, narrow = said["nozzles"]
    assert wide["in_cycles"] > 0 == narrow["in_cycles"]
    assert narrow["pieces"] == narrow["toolpaths"]
    assert narrow["travel_s"] > 0
    assert narrow["tip_width_mm"] < said["widest_tip_mm"] < wide["tip_width_mm"]
    assert Path("a.svg").stat().st_size > 1000
    # Just below it the sheet is planned whole, just above it is refused.
    for width, ends in ((said["widest_tip_mm"] * 0.98, 0), (said["widest_tip_mm"] * 1.02, 2)):
        words = ["-p", "paper", "--set", f"nozzle.tip_width_mm={width}", "--method", "greedy"]
        words += ["--conflicts", "refuse"]
        assert run("grid.json", "-o", "part.gcode", "-q", *words)[0] == ends
    _, out, _ = run("nozzles", "grid.json", "--only", "32G")
    assert "The widest blunt needle that prints it without a cut" in out


def test_the_table_of_nozzles_says_which_cut_nothing(run):
    write(VALLEY)
    assert run("nozzles", "grid.json", "--only", "18G,32G,30G")[1].splitlines()[-1] == (
        "Of these nozzles without a cut: 32G, 30G."
    )
    words = ["nozzles", "grid.json", "--only", "18G,brass-0.4"]
    least = min(json.loads(run(*words, "--json")[1])["nozzles"], key=lambda one: one["pieces"])
    assert run(*words)[1].splitlines()[-1] == (
        "None of these nozzles prints it without a cut; the fewest pieces, "
        f"{least['pieces']}, with {least['nozzle']}."
    )
    assert "these nozzles" not in run("nozzles", "grid.json", "--only", "18G")[1]
    assert run("nozzles", "grid.json", "--only", "32G,30G")[1].splitlines()[-1] == (
        "All of these nozzles print it without a cut."
    )


def test_conflicts_are_drawn_for_a_nozzle_with_a_body(run):
    write(VALLEY)
    assert run("preview", "grid.json", "--conflicts", "--nozzle", "18G", "-o", "a.svg")[0] == 0
    drawn = Path("a.svg").read_text()
    assert "toolpaths in cycles" in drawn
    assert "the worst pair presses" in drawn
    code, _, err = run("preview", "grid.json", "--conflicts", "-p", "paper", "-o", "a.svg")
    assert code == 2
    assert "its nozzle is a point" in err


def test_known_nozzles_are_listed_with_their_sources(run):
    _, out, _ = run("profiles", "nozzles", "--sources")
    assert any(line.split()[:3] == ["25G", "0.26", "0.5144"] for line in out.splitlines())
    assert "not verified" in out
