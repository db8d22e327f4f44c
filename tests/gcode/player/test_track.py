"""The data of a page: what it says of a program is what check and estimate say, and little of it is needed."""

import base64
import gzip
import json
import re
import zlib

import numpy as np
import pytest
from making import FACTS, POINT, make_grid, make_lines, make_program, read_lines

import profiles
from gcode.check import check
from gcode.estimate import seconds_of
from gcode.player import framed, page, track_of, track_of_program
from gcode.player.packing import counted, pack
from gcode.player.support import support
from gcode.player.track import JUMP, PRIME, STANDS, TOOLPATH, TRAVEL

SHEET = make_grid([[-45, -20], [30, None]])


def unpacked(table, text):
    """What the page's script does, written another way."""
    data, out, at = zlib.decompress(base64.b64decode(text)), {}, 0
    for entry in table:
        n, width = entry["n"], entry["bytes"]
        part = np.frombuffer(data[at : at + n * width], np.uint8)
        at += n * width
        if width == 4:
            steps = part.reshape(4, n).T.copy().view("<i4").ravel()
            part = np.cumsum(steps, dtype=np.int64).astype(np.int32)
        out[entry["name"]] = part
    assert at == len(data)
    return out


def made(profile="marlin-generic", *settings, sheet=SHEET):
    loaded = profiles.load(profile, [POINT, *settings])
    lines = make_lines(sheet, profile, *settings)
    moves = read_lines(lines)
    return moves, loaded, track_of(moves, loaded, name="part.gcode", grid=sheet)


def test_arrays_come_back_as_they_were():
    arrays = {
        "up": np.arange(1000) * 7,
        "wild": np.random.default_rng(1).integers(-(2**30), 2**30, 500),
        "bytes": np.arange(256, dtype=np.uint8),
        "none": np.empty(0, np.int64),
    }
    back = unpacked(*pack(arrays))
    assert list(back) == list(arrays)
    for name, values in arrays.items():
        np.testing.assert_array_equal(back[name], values)


def test_numbers_are_counted_in_units_that_fit():
    values, unit = counted(np.array([0.0, 0.00016, 2.0]), 1e-4)
    assert (values.tolist(), unit) == ([0, 2, 20000], 1e-4)
    values, unit = counted(np.array([1e7, 5e6]), 1e-4)
    assert np.abs(values).max() <= 2**30
    np.testing.assert_allclose(values * unit, [1e7, 5e6])


@pytest.mark.parametrize("profile", ["marlin-generic", "marlin-syringe", "marlin-pneumatic"])
def test_a_track_says_what_check_and_estimate_say(profile):
    moves, loaded, track = made(profile)
    report = check(moves, loaded)
    length = np.hypot(*np.diff(track.end_mm, axis=0, prepend=track.end_mm[:1]).T)
    laid = np.flatnonzero(track.kind == TOOLPATH)
    between = np.zeros(len(length), bool)
    between[laid[0] : laid[-1]] = True
    assert track.toolpaths == report.extrusions == len(laid)
    assert length[laid].sum() == pytest.approx(report.printed_mm)
    assert length[between & (track.kind == TRAVEL)].sum() == pytest.approx(report.travel_mm)
    assert track.total_s == pytest.approx(seconds_of(moves, loaded).sum())
    program = make_program(SHEET, profiles.load(profile, ["motion.prime_mm=0"]))
    assert track.volume_ul[-1] == pytest.approx(program.material_ul, rel=1e-3)
    assert [moves_at[0] for moves_at in zip(track.line[laid], strict=True)] == sorted(track.line[laid])
    for k, s in enumerate(laid[:5]):
        move = next(move for move in moves if move.line == track.line[s])
        np.testing.assert_allclose(track.end_mm[s], [move.x_mm, move.y_mm], err_msg=str(k))


def test_what_fills_the_nozzle_is_no_toolpath_and_no_material_of_the_print():
    loaded = profiles.load("marlin-generic", ["motion.prime_mm=7"])
    moves = read_lines(make_lines(SHEET, "marlin-generic", "motion.prime_mm=7"))
    track = track_of(moves, loaded, name="part.gcode")
    assert np.count_nonzero(track.kind == PRIME) == 1
    assert track.toolpaths == made()[2].toolpaths
    assert track.volume_ul[-1] == pytest.approx(made()[2].volume_ul[-1], rel=1e-4)


def test_every_toolpath_knows_its_tile_and_its_bead():
    _, _, track = made()
    assert track.cols == 2
    assert set(track.tile.tolist()) == {0, 1, 2}
    np.testing.assert_allclose(track.height_mm, 0.25)
    np.testing.assert_array_equal(np.bincount(track.tile) > 0, [True, True, True])


def test_where_nobody_followed_nothing_is_drawn():
    lines = make_lines(SHEET)
    k = [k for k, line in enumerate(lines) if line.startswith(";TOOLPATH")][2]
    moves = read_lines([*lines[:k], "G2 X14 Z3 I1 K1", *lines[k:]])
    track = track_of(moves, profiles.load("marlin-generic"), name="part.gcode")
    s = int(np.flatnonzero(track.line == k + 1)[0])
    assert track.kind[s] == JUMP
    assert track.end_mm[s].tolist() == [14, 3]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("lines", [[], ["G21", "G28"], ["G90", "G1 X1 F600", "G4 P100"]])
def test_a_program_whose_places_nobody_knows_makes_a_page_too(lines):
    track = track_of(read_lines(lines), profiles.load("marlin-generic"), name="part.gcode")
    assert track.toolpaths == 0
    assert not np.isnan(track.end_mm).any()
    assert page([track])


def test_dwells_take_time_where_they_are_and_tools_are_known():
    lines = ["G21", "G90", "M83", "G0 X0 Y0 Z1 F600", "G1 X5 E1 F600", "T1", "G4 P1500", "G1 X0 E1"]
    track = track_of(read_lines(lines), profiles.load("marlin-generic"), name="part.gcode")
    stands = np.flatnonzero((track.kind == STANDS) & (track.line == 7))
    assert np.diff(track.end_s, prepend=0)[stands].sum() == pytest.approx(1.5)
    assert track.tool[track.kind == TOOLPATH].tolist() == [0, 1]


def test_beads_that_nothing_carries_hang_and_each_knows_what_comes_before_it():
    def level(x0, x1, y):
        return [[x0, y], [x1, y]]

    lines = np.array(
        [level(0, 4, 0.1), level(0, 4, 0.3), level(6, 9, 0.1), level(0, 9, 0.5), level(6, 9, 0.9)]
    )
    hangs, after = support(lines, np.full(5, 0.2), 0.0)
    assert hangs[:3].tolist() == [0, 0, 0]
    assert 50 <= hangs[3] <= 60  # over the gap from 4 to 6, and over the low bead at 6 to 9
    assert hangs[4] == 100
    assert after.tolist() == [0, 1, 0, 3, 4]


def test_uprights_and_single_points_are_taken():
    lines = np.array(
        [[[0.3, 0], [0.3, 1.0]], [[0.7, 0], [0.7, 1.0]], [[0, 1.2], [1, 1.2]], [[0.5, 1.4], [0.5, 1.4]]]
    )
    _, after = support(lines, np.full(4, 0.2), 0.0)
    assert after[2] == 2
    assert after[3] == 3
    assert support(np.empty((0, 2, 2)), np.empty(0), 0.0)[0].shape == (0,)


def test_a_page_holds_all_of_it_asks_for_nothing_and_is_small():
    big = make_grid(np.linspace(-40, 40, 36).reshape(6, 6), spacing=0.05)
    moves, loaded, _ = made(sheet=big)
    text = "\n".join(make_lines(big))
    track = track_of(moves, loaded, name="part.gcode", findings=check(moves, loaded).violations)
    html = page([track])
    assert len(html) <= 2 * len(gzip.compress(text.encode(), 9)) + 500_000
    assert len(html) <= 2 * len(gzip.compress(text.encode(), 9)) + 80_000  # what the page itself may take
    assert not re.search(r"https?://|src=|@import|url\(", html)
    assert "connect-src" not in html
    assert "connect-src 'self'" in page([track], live=True)


def test_no_name_and_no_finding_gets_out_of_its_place():
    moves, loaded, track = made()
    evil = "</script><script>alert(1)</script>{{DATA}}"
    track = track_of(moves, loaded, name=evil)
    html = page([track])
    assert "<script>alert" not in html
    header = re.search(r'id="header">(.*?)</script>', html, re.DOTALL)[1]
    assert json.loads(header)["tracks"][0]["name"] == evil
    assert html.count("</html>") == 1
    assert evil not in framed(track)


def test_programs_and_results_show_themselves_in_a_notebook():
    from slicer import hatch, sequence

    program = make_program(SHEET, profiles.load("marlin-generic"))
    shown = program._repr_html_()
    assert shown.startswith("<iframe")
    assert 'sandbox="allow-scripts"' in shown
    assert track_of_program(program, program.profile, "x", FACTS).toolpaths == len(program.height_mm)
    result = sequence.solve(hatch.hatch(SHEET).segments, method="greedy")
    assert f"{result.travel_mm:.4f} mm" in result._repr_html_()
    assert "greedy" in result._repr_html_()


def test_joins_are_those_of_the_check_and_named_in_the_program_itself():
    joined = "motion.join_mm=0.5"
    loaded = profiles.load("marlin-generic", [POINT, joined])
    lines = make_lines(SHEET, "marlin-generic", joined)
    moves = read_lines(lines)
    track = track_of(moves, loaded, name="part.gcode")
    at = set(track.line[track.kind == TOOLPATH][track.join == 1].tolist())
    found = check(moves, loaded, SHEET)
    assert found.joins == len(at) > 5
    assert found.join_lines == at
    assert track.toolpaths == sum(line.startswith(";TOOLPATH") for line in lines)
    # A host has taken the comments away.
    bare = read_lines([line for line in lines if not line.startswith(";")])
    report = check(bare, loaded, SHEET)
    told = track_of(bare, loaded, name="part.gcode", joins=report.join_lines)
    np.testing.assert_array_equal(told.join, track.join)
    assert track_of(bare, loaded, name="part.gcode").toolpaths == len(track.join)
    # The comment is about the move behind it alone.
    at_travel = next(k for k, line in enumerate(lines) if line.startswith("G0 X"))
    more = [*lines[:at_travel], ";JOIN", *lines[at_travel:]]
    assert track_of(read_lines(more), loaded, name="part.gcode").toolpaths == track.toolpaths
