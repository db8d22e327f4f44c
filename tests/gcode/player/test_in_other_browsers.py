"""The page in Firefox and in WebKit, of which Safari is made: what is used of a browser is in them too."""

import pytest
import webdriver
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.check import check
from gcode.player import page, track_of

SHEET = make_grid([[-30, 20], [10, 35]], spacing=0.1)


@pytest.fixture(scope="module")
def tracks():
    loaded = profiles.load("marlin-generic", [POINT])
    lines = make_lines(SHEET)
    good = track_of(read_lines(lines), loaded, name="good.gcode", grid=SHEET)
    slow = make_lines(SHEET, "marlin-generic", "motion.travel_speed_mm_s=3")
    printed = [k for k, line in enumerate(slow) if line.startswith("G1 X")]
    slow[printed[9]] = slow[printed[9]].replace(" E", " E9")
    moves = read_lines(slow)
    return good, track_of(moves, loaded, name="slow.gcode", findings=check(moves, loaded).violations)


@pytest.fixture(scope="module", params=["firefox", "webkit"])
def opened(request, tmp_path_factory):
    with getattr(webdriver, request.param)(tmp_path_factory.mktemp(request.param)) as browser:
        yield browser


@pytest.fixture
def shown(opened, tmp_path):
    def show(*tracks, mark=""):
        file = tmp_path / "part.html"
        file.write_text(page(tracks), encoding="utf-8")
        opened.open(file.as_uri() + mark)
        assert opened.js("return document.querySelector('#broken').hidden")
        opened.until("player.whole")
        return opened

    yield show
    assert opened.js("return document.body.dataset.wrong || ''") == ""


@pytest.mark.parametrize("mark", ["", "#plain", "#webgl"])
def test_it_plays_steps_and_is_scrubbed(shown, tracks, mark):
    track = tracks[0]
    browser = shown(track, mark=mark)
    browser.press("\ue014")  # an arrow to the right
    assert browser.figure("toolpath") in (f"{k} of {track.toolpaths}" for k in (1, 2))
    browser.press("k")
    assert browser.js("return player.playing")
    browser.js("player.speed = 1000")
    browser.until("!player.playing")
    assert browser.figure("doing") == "finished"
    assert browser.figure("toolpath") == f"{track.toolpaths} of {track.toolpaths}"
    browser.js(
        "const node = document.querySelector('#scrubber');"
        "node.value = node.max / 2; node.dispatchEvent(new Event('input'));"
    )
    assert browser.js("return player.time") == pytest.approx(track.total_s / 2, rel=0.01)
    x, y = browser.js(
        "const pane = player.panes[0], [a, b, c, d] = pane.track.ends(20);"
        "const box = pane.stage.getBoundingClientRect(), [x, y] = pane.view.px((a + c) / 2, (b + d) / 2);"
        "return [box.left + x, box.top + y];"
    )
    browser.click(x, y)
    assert browser.figure("toolpath").startswith("21 of")
    browser.until("player.whole")
    assert len(browser.picture()) > 5000


def test_two_programs_are_compared_and_findings_are_gone_to(shown, tracks):
    good, slow = tracks
    browser = shown(good, slow)
    said = browser.js("return document.querySelector('#verdict').textContent")
    assert said.startswith(f"slow.gcode needs {slow.total_s - good.total_s:.1f} s longer than good.gcode")
    browser.press("v")
    assert browser.figure("line", pane=1) == str(slow.findings[0].line)
    browser.press("\ue010")  # End
    for pane in (0, 1):
        browser.until(f"document.querySelectorAll('[data-figure=doing]')[{pane}].textContent === 'finished'")
    before = browser.js("return player.look.ground[0]")
    browser.press("d")
    assert browser.js("return player.look.ground[0]") != before
