"""``vslice play`` and ``compare --play`` as a user calls them."""

import json
import re
from pathlib import Path

import pytest

GRID = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45, 10]]}'


@pytest.fixture
def part(run):
    Path("grid.json").write_text(GRID)
    assert run("grid.json", "-o", "part.gcode", "--method", "greedy")[0] == 0
    return "part.gcode"


def header(page):
    return json.loads(re.search(r'id="header">(.*?)</script>', page, re.DOTALL)[1])


def test_a_page_is_written_beside_the_program_or_where_one_likes(run, part):
    code, out, err = run("play", part)
    assert (code, out) == (0, "")
    assert "page written to part.gcode.html" in err
    whole = Path("part.gcode.html").read_text()
    assert header(whole)["tracks"][0]["name"] == "part.gcode"
    assert header(whole)["tracks"][0]["findings"] == []
    code, out, _ = run("play", part, "-o", "-", "-q")
    assert (code, out) == (0, whole)
    assert run("play", part, "-o", "other.html", "-q")[0] == 0
    assert Path("other.html").read_text() == whole


def test_two_programs_and_their_grid(run, part):
    assert run("grid.json", "-o", "other.gcode", "--method", "local", "-q")[0] == 0
    assert run("play", part, "other.gcode", "--grid", "grid.json", "-o", "both.html")[0] == 0
    tracks = header(Path("both.html").read_text())["tracks"]
    assert [track["name"] for track in tracks] == [part, "other.gcode"]
    assert [track["cols"] for track in tracks] == [2, 2]
    assert [track["head"]["method"] for track in tracks] == ["greedy", "local"]


def test_what_check_finds_is_in_the_page_unless_it_is_not_wanted(run, part):
    text = Path(part).read_text()
    Path("bad.gcode").write_text(text.replace(" E0.", " E9.", 3))
    found = json.loads(run("check", "bad.gcode", "--json")[1])["violations"]
    assert found
    assert run("play", "bad.gcode")[0] == 0  # a page is no verdict
    told = header(Path("bad.gcode.html").read_text())["tracks"][0]
    assert told["findings"] == [[one["line"], one["kind"], one["message"]] for one in found]
    assert run("play", "bad.gcode", "--no-check")[0] == 0
    assert header(Path("bad.gcode.html").read_text())["tracks"][0]["findings"] == []


def test_it_opens_in_the_browser_when_asked(run, part, monkeypatch):
    opened = []
    monkeypatch.setattr("click.launch", opened.append)
    assert run("play", part, "--open")[0] == 0
    assert opened == [Path("part.gcode.html").resolve().as_uri()]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a.gcode", "b.gcode", "c.gcode"], "3 programs"),
        (["part.gcode", "-o", "part.gcode"], "is the input itself"),
        (["part.gcode", "--grid", "grid.json", "-o", "grid.json"], "is the input itself"),
        (["part.gcode", "-o", "-", "--open"], "--open has no effect"),
        (["part.gcode", "--set", "printer.baud=9600"], "has no effect"),
        (["missing.gcode"], "missing.gcode"),
        (["part.gcode", "-o", "nowhere/x.html"], "there is no folder"),
    ],
)
def test_wrong_use_is_told(run, part, words, said):
    code, _, err = run("play", *words)
    assert code == 2
    assert said in err


def test_a_program_that_prints_nothing_makes_a_page_with_a_warning(run):
    Path("empty.gcode").write_text("G21\nG28\n")
    code, _, err = run("play", "empty.gcode")
    assert code == 0
    assert "nothing is extruded" in err


def test_methods_are_compared_in_a_page(run, part):
    code, _, err = run("compare", "grid.json", "--methods", "local", "--seeds", "2", "--play", "m.html")
    assert code == 0
    assert "page written to m.html" in err
    tracks = header(Path("m.html").read_text())["tracks"]
    assert {track["name"] for track in tracks} == {"local", "greedy"}
    code, _, err = run("compare", "grid.json", "--methods", "greedy", "-o", "m.md", "--play", "m.md")
    assert code == 2
    assert "m.md is to hold the table; name another file with --play." in err


def test_a_preview_may_move(run, part, monkeypatch):
    assert run("preview", part, "-o", "part.gif", "-q")[0] == 0
    assert Path("part.gif").read_bytes().startswith(b"GIF8")
    assert run("preview", part, "-o", "arrows.png", "--arrows", "-q")[0] == 0
    assert Path("arrows.png").stat().st_size > 0
    monkeypatch.setattr("shutil.which", lambda _: None)
    for words, said in (
        (["grid.json", "-o", "grid.gif"], "a grid has no order"),
        ([part, "-o", "part.mp4"], "ffmpeg"),
        ([part, "-o", "part.gif", "--color", "order"], "no effect"),
        (["grid.json", "--arrows"], "no effect"),
    ):
        code, _, err = run("preview", *words)
        assert code == 2, words
        assert said in err
