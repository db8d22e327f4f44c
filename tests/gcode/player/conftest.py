"""A browser, two programs and their pages, for the tests of the player."""

import pytest
from browsing import browser, showing
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.check import check
from gcode.player import page, track_of


@pytest.fixture(scope="package")
def sheet():
    return make_grid([[-30, 20, 0], [10, -25, 35]], spacing=0.1)


@pytest.fixture(scope="package")
def chromium():
    with browser() as opened:
        yield opened


@pytest.fixture(scope="package")
def tracks(sheet):
    loaded = profiles.load("marlin-generic", [POINT])
    moves = read_lines(make_lines(sheet))
    good = track_of(moves, loaded, name="good.gcode", findings=check(moves, loaded).violations, grid=sheet)
    lines = make_lines(sheet, "marlin-generic", "motion.travel_speed_mm_s=3")
    printed = [k for k, line in enumerate(lines) if line.startswith("G1 X")]
    a, b = printed[4], printed[40]
    lines[a] = lines[a].replace(" E", " E9")  # two faults, an early one and a late one
    lines[b] = lines[b].replace(" E", " E9")
    moves = read_lines(lines)
    bad = track_of(moves, loaded, name="slow.gcode", findings=check(moves, loaded).violations)
    assert len(bad.findings) >= 2
    return good, bad


@pytest.fixture(scope="package")
def one_page(chromium, tracks, tmp_path_factory):
    """A page for tests that leave it as it was."""
    file = tmp_path_factory.mktemp("one") / "part.html"
    file.write_text(page([tracks[0]]), encoding="utf-8")
    with showing(chromium, file.as_uri()) as opened:
        yield opened


@pytest.fixture
def shown(chromium, tracks, tmp_path):
    def show(*chosen, mark="", **more):
        file = tmp_path / "part.html"
        file.write_text(page(chosen or [tracks[0]]), encoding="utf-8")
        return showing(chromium, file.as_uri() + mark, **more)

    return show
