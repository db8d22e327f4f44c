"""What the page draws, by either painter: beads, colours, the nozzle, and all of it where there is a lot."""

import numpy as np
import pytest
import shapely
from browsing import figure, inked, settle, showing, until
from making import make_lines, read_lines

import profiles
from gcode.nozzle_body import parts_of
from gcode.player import Track, page, track_of
from gcode.player.track import TOOLPATH, TRAVEL

BODY = [
    f"nozzle.{name}"
    for name in [
        "tip_width_mm=0.8",
        "cone_deg=20",
        "length_mm=4",
        "shoulder_width_mm=6",
        "press_mm=0.1",
        "cone_mm=0",
        "barrel_width_mm=0",
    ]
]


@pytest.mark.parametrize("mark", ["#plain", "#webgl"])
def test_what_is_drawn_step_by_step_is_what_is_drawn_at_once(shown, mark):
    with shown(mark=mark) as opened:
        opened.uncheck("[data-option=ghosts]")  # they lie below what is added, and are left out anew
        for share in (0.2, 0.3, 0.5, 0.8):
            opened.evaluate(f"player.seek(player.total * {share})")
            settle(opened)
        grown = opened.evaluate("player.panes[0].canvas.toDataURL()")
        opened.evaluate("player.style()")
        settle(opened)
        assert opened.evaluate("player.panes[0].canvas.toDataURL()") == grown
        assert inked(opened) > 1000
        # Backwards is drawn anew: what was printed later is gone.
        opened.evaluate("player.seek(player.total)")
        full = inked(opened, rgb=[144, 215, 67])
        opened.evaluate("player.seek(0)")
        assert inked(opened, rgb=[144, 215, 67]) < full / 10


@pytest.mark.parametrize("settings", [[], BODY, ["nozzle.length_mm=1", "nozzle.shoulder_width_mm=3"]])
def test_the_page_has_the_body_that_the_check_has(shown, sheet, settings):
    """The shipped machine's, with cone, barrel and block, is one of them."""
    machine = profiles.load("marlin-generic", settings)
    track = track_of(read_lines(make_lines(sheet)), machine, name="body.gcode")
    random = np.random.default_rng(4)
    x, y = random.uniform(-12, 12, 300), random.uniform(0, 12, 300)
    parts = parts_of(machine.nozzle)
    wanted = np.maximum(np.max([part.depth(x, y) for part in parts], axis=0), 0)
    assert (wanted > 0.5).sum() > 20
    with shown(track) as opened:
        depth, outline = opened.evaluate(
            """([x, y]) => { const { depthInside, outline } = player.nozzle, body = player.panes[0].nozzle;
              return [x.map((dx, k) => depthInside(body, dx, y[k])), outline(body, 12)]; }""",
            [x.tolist(), y.tolist()],
        )
    np.testing.assert_allclose(depth, wanted, atol=1e-9)
    drawn = np.array(outline)
    assert (np.diff(drawn, axis=0) >= -1e-6).all()
    body = shapely.Polygon([*drawn, *(drawn[::-1] * [-1, 1])])
    inside = shapely.contains_xy(body, x, y)
    np.testing.assert_array_equal(inside[np.abs(wanted) > 1e-6], wanted[np.abs(wanted) > 1e-6] > 0)
    assert not inside[wanted == 0].any()


def test_the_nozzle_is_drawn_to_scale_and_what_pushes_into_it_is_told(shown, sheet):
    wide = profiles.load("marlin-generic", BODY)
    track = track_of(read_lines(make_lines(sheet)), wide, name="wide.gcode")
    with shown(track) as opened:
        widths = opened.evaluate(
            "player.panes[0] && [0, 2, 4.5].map((h) => 2 * player.nozzle.halfWidth(player.panes[0].nozzle, h))"
        )
        assert widths == pytest.approx([0.8, 0.8 + 4 * 0.36397, 6.0], abs=1e-4)
        opened.click("#last")
        opened.evaluate("player.picked(player.panes[0], 0)")
        depth, allowed = figure(opened, "body").split(" mm deep")
        assert float(depth) == 0  # the first one: nothing is printed yet
        assert "0.1 mm allowed" in allowed
        most = opened.evaluate(
            """() => { let most = 0; const { track, strips, nozzle } = player.panes[0];
              for (let s = 1; s < track.steps; s++) most = Math.max(most,
                player.nozzle.hindering(nozzle, strips, track.x[s], track.y[s], track.done[s]).depth);
              return most; }"""
        )
        assert most > 0.1
    with shown() as opened:
        assert opened.is_hidden(".body")


@pytest.mark.parametrize("colour", ["order", "tile", "tilt", "time", "speed", "tool", "plain"])
def test_toolpaths_are_coloured_by_what_is_chosen(one_page, colour):
    one_page.click("#last")
    one_page.select_option("#colour", colour)
    settle(one_page)
    drawn = one_page.evaluate(
        """() => { const pane = player.panes[0], seen = new Set();
          for (let k = 0; k < pane.track.n; k++) seen.add(pane.colourOf(pane.track.stepOf[k]));
          return seen.size; }"""
    )
    exact = {"tile": 6, "tool": 1, "plain": 1}
    assert drawn == exact[colour] if colour in exact else drawn >= {"speed": 1, "tilt": 6}.get(colour, 50)
    assert inked(one_page) > 1000


def test_boxes_show_and_hide_what_they_say(shown):
    with shown() as opened:
        opened.evaluate("player.seek(player.total / 2)")
        with_ghosts = inked(opened)
        opened.uncheck("[data-option=ghosts]")
        assert inked(opened) < with_ghosts
        free = [0x8F, 0xD1, 0x9E]
        assert inked(opened, rgb=free) < 50
        opened.check("[data-option=next]")
        assert inked(opened, rgb=free) > 50
        for _ in range(6):
            opened.keyboard.press("+")
        settle(opened)
        assert opened.evaluate("player.panes[0].labelled") > 0
        opened.uncheck("[data-option=labels]")
        settle(opened)
        assert opened.evaluate("player.panes[0].labelled") == 0


def test_a_processor_draws_without_webgl_and_what_it_draws_is_the_same(shown):
    counted = {}
    for mark, painter in (("", "PlainPainter"), ("#webgl", "GlPainter")):  # this browser has no graphics card
        with shown(mark=mark) as opened:
            assert opened.evaluate("player.panes[0].painter.constructor.name") == painter
            opened.click("#last")
            opened.click("#first")
            opened.evaluate("player.seek(player.total / 2)")
            counted[mark] = inked(opened)
    assert counted[""] == pytest.approx(counted["#webgl"], rel=0.05)
    assert counted[""] > 1000


def test_a_file_of_120_000_toolpaths_opens_and_plays(chromium, tmp_path):
    file = tmp_path / "large.html"
    file.write_text(page([large()]), encoding="utf-8")
    with showing(chromium, file.as_uri()) as opened:
        opened.evaluate("player.speed = 100; player.play()")
        until(opened, "player.frames > 20 && player.panes[0].toolpath > 1000")
        opened.evaluate("player.pause(); player.seek(player.total)")
        assert figure(opened, "toolpath") == "120000 of 120000"
        full = inked(opened)
        assert full > 10_000
        # Drawn anew slice by slice; meanwhile the old picture stands where the view has moved it.
        moved = opened.evaluate(
            """() => new Promise((done) => { player.panes[0].pan(40, 0);
              requestAnimationFrame(() => done([player.whole, player.panes[0].canvas.style.transform])); })"""
        )
        assert moved == [False, "translate(40px, 0px) scale(1)"]
        settle(opened)
        assert opened.evaluate("[player.whole, player.panes[0].canvas.style.transform]") == [True, ""]
        assert inked(opened) == pytest.approx(full, rel=0.05)
        # What was printed later goes, and what is asked for meanwhile is drawn too.
        opened.evaluate("player.seek(player.total / 2)")
        opened.evaluate("player.seek(player.total / 4)")
        settle(opened)
        assert opened.evaluate("player.panes[0].painter.shown.drawn") == pytest.approx(60_000, abs=2)


def large():
    """120,000 toolpaths in 300 rows, to and fro, with a travel to each."""
    rows, cols = 300, 400
    begin, end = 0.5 * np.arange(cols), 0.5 * np.arange(cols) + 0.4
    there = np.stack([begin, end], axis=1).ravel()
    back = np.stack([end, begin], axis=1)[::-1].ravel()
    x = np.concatenate([there if row % 2 == 0 else back for row in range(rows)])
    n = rows * cols
    steps = np.arange(2 * n)
    return Track(
        name="large.gcode",
        end_mm=np.stack([x, np.repeat(0.1 + 0.2 * np.arange(rows), 2 * cols)], axis=1),
        end_s=0.02 * (steps + 1),
        kind=np.where(steps % 2, TOOLPATH, TRAVEL).astype(np.uint8),
        line=steps + 5,
        volume_ul=0.01 * (steps // 2),
        speed_mm_s=np.full(2 * n, 20.0),
        tool=np.zeros(2 * n, np.uint8),
        height_mm=np.full(n, 0.2),
        join=np.zeros(n, np.uint8),
        hangs=np.zeros(n, np.uint8),
        after=np.maximum(np.arange(n) - cols, 0),
        tile=np.empty(0, np.int64),
        cols=0,
        findings=(),
        facts={"axes": "XZ", "bed_mm": 0.0, "nozzle": None, "head": {}},
    )
