"""The page in a real browser: every thing that it offers is done, with a mouse, with keys and with fingers."""

import itertools

import numpy as np
import pytest
from browsing import browser, figure, inked, settle, showing, until
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.check import check
from gcode.player import Track, page, track_of
from gcode.player.track import TOOLPATH, TRAVEL

SHEET = make_grid([[-30, 20, 0], [10, -25, 35]], spacing=0.1)
BODY = [
    f"nozzle.{name}"
    for name in ["tip_width_mm=0.8", "cone_deg=20", "length_mm=4", "shoulder_width_mm=6", "press_mm=0.1"]
]


@pytest.fixture(scope="module")
def chromium():
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def tracks():
    loaded = profiles.load("marlin-generic", [POINT])
    moves = read_lines(make_lines(SHEET))
    good = track_of(moves, loaded, name="good.gcode", findings=check(moves, loaded).violations, grid=SHEET)
    lines = make_lines(SHEET, "marlin-generic", "motion.travel_speed_mm_s=3")
    printed = [k for k, line in enumerate(lines) if line.startswith("G1 X")]
    a, b = printed[4], printed[40]
    lines[a] = lines[a].replace(" E", " E9")  # two faults, an early one and a late one
    lines[b] = lines[b].replace(" E", " E9")
    moves = read_lines(lines)
    bad = track_of(moves, loaded, name="slow.gcode", findings=check(moves, loaded).violations)
    assert len(bad.findings) >= 2
    return good, bad


@pytest.fixture(scope="module")
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


def test_it_plays_in_true_time_and_ends(shown, tracks):
    with shown() as opened:
        assert figure(opened, "toolpath").startswith("0 of")
        empty = inked(opened, rgb=[72, 40, 120])
        opened.select_option("#speed", "1")
        opened.click("#play")
        begin = opened.evaluate("[player.time, performance.now()]")
        opened.wait_for_timeout(1500)
        end = opened.evaluate("[player.time, performance.now()]")
        passed = (end[1] - begin[1]) / 1000
        assert end[0] - begin[0] == pytest.approx(passed, rel=0.3, abs=0.3)  # frames come when they can
        opened.evaluate("for (let k = 0; k < 4; k++) { player.pause(); player.play(); }")
        frames = opened.evaluate(
            """() => new Promise((done) => { let count = 0; const begin = player.frames;
              const next = () => ++count < 30 ? requestAnimationFrame(next) : done(player.frames - begin);
              requestAnimationFrame(next); })"""
        )
        assert frames <= 33  # however often it was pressed, one frame of ours for one of the browser's
        opened.select_option("#speed", "1000")
        until(opened, "!player.playing")
        assert figure(opened, "toolpath") == f"{tracks[0].toolpaths} of {tracks[0].toolpaths}"
        assert figure(opened, "doing") == "finished"
        assert opened.evaluate("player.time") == pytest.approx(tracks[0].total_s, abs=0.01)
        assert inked(opened, rgb=[62, 74, 137]) > empty


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


def test_the_scrubber_and_the_figures_agree_with_the_track(shown, tracks):
    track = tracks[0]
    with shown() as opened:
        opened.locator("#scrubber").evaluate(
            "(node) => { node.value = node.max / 2; node.dispatchEvent(new Event('input')); }"
        )
        time = opened.evaluate("player.time")
        assert time == pytest.approx(track.total_s / 2, rel=0.01)
        s = int((track.end_s <= time).sum())
        assert figure(opened, "line") == str(track.line[s])
        assert "of" in opened.get_attribute("#scrubber", "aria-valuetext")
        opened.click("#last")
        assert float(figure(opened, "material").split()[0]) == pytest.approx(track.volume_ul[-1], rel=0.01)
        travel = check(read_lines(make_lines(SHEET)), profiles.load("marlin-generic")).travel_mm
        assert float(figure(opened, "travel").split()[0]) == pytest.approx(travel, abs=0.06)


def test_it_steps_from_toolpath_to_toolpath(shown):
    with shown() as opened:
        seen = []
        for _ in range(4):
            opened.click("#forth")
            seen.append(int(figure(opened, "toolpath").split()[0]))
        assert seen == [1, 2, 3, 4] or seen == [2, 3, 4, 5]
        opened.click("#back")
        assert int(figure(opened, "toolpath").split()[0]) == seen[-2]
        opened.fill("#number", "7")
        opened.press("#number", "Enter")
        assert figure(opened, "toolpath").startswith("7 of")


def test_all_of_it_works_with_keys_alone(shown):
    with shown() as opened:
        opened.keyboard.press("End")
        assert figure(opened, "doing") == "finished"
        opened.keyboard.press("Home")
        assert opened.evaluate("player.time") == 0
        opened.keyboard.press("PageDown")
        opened.keyboard.press("ArrowRight")
        here = int(figure(opened, "toolpath").split()[0])
        assert here >= 10
        opened.keyboard.press("ArrowLeft")
        assert int(figure(opened, "toolpath").split()[0]) == here - 1
        scale = opened.evaluate("player.panes[0].view.scale")
        opened.keyboard.press("+")
        assert opened.evaluate("player.panes[0].view.scale") > scale
        centre = opened.evaluate("player.panes[0].view.cx")
        opened.keyboard.press("Shift+ArrowRight")
        assert opened.evaluate("player.panes[0].view.cx") > centre
        opened.keyboard.press("f")
        assert opened.evaluate("player.panes[0].view.scale") == pytest.approx(scale)
        opened.keyboard.press("?")
        assert opened.is_visible("#keys")
        opened.keyboard.press("Escape")
        speed = opened.evaluate("player.speed")
        opened.keyboard.press("ArrowUp")
        assert opened.evaluate("player.speed") > speed
        opened.keyboard.press(" ")
        assert opened.evaluate("player.playing")
        opened.keyboard.press(" ")
        assert not opened.evaluate("player.playing")
        nameless = opened.evaluate(
            """() => [...document.querySelectorAll("button, input, select, [role=img]")]
              .filter((node) => !(node.ariaLabel || node.textContent.trim() || node.labels?.length)).length"""
        )
        assert nameless == 0
        until(opened, "document.querySelector('#said').textContent.includes('toolpath')")


def test_a_click_on_a_toolpath_goes_to_its_moment_and_a_drag_moves(shown):
    with shown() as opened:
        k, x, y = opened.evaluate(
            """() => { const pane = player.panes[0], k = 20, [a, b, c, d] = pane.track.ends(k);
              const box = pane.stage.getBoundingClientRect(), [x, y] = pane.view.px((a + c) / 2, (b + d) / 2);
              return [k, box.left + x, box.top + y]; }"""
        )
        opened.mouse.click(x, y)
        assert figure(opened, "toolpath").startswith(f"{k + 1} of")
        begin = opened.evaluate(f"player.panes[0].track.begin(player.panes[0].track.stepOf[{k}])")
        assert opened.evaluate("player.time") == pytest.approx(begin, abs=0.01)
        before = opened.evaluate("player.panes[0].view.cx")
        opened.mouse.move(x, y)
        opened.mouse.down()
        opened.mouse.move(x + 60, y, steps=3)
        opened.mouse.up()
        assert opened.evaluate("player.panes[0].view.cx") < before
        assert figure(opened, "toolpath").startswith(f"{k + 1} of")  # a drag is no click
        scale = opened.evaluate("player.panes[0].view.scale")
        opened.mouse.wheel(0, -300)
        until(opened, f"player.panes[0].view.scale > {scale}")


def test_two_programs_stand_side_by_side_in_step_by_time_or_by_length(shown, tracks):
    good, slow = tracks
    with shown(good, slow) as opened:
        said = opened.inner_text("#verdict")
        assert said.startswith(f"slow.gcode needs {slow.total_s - good.total_s:.1f} s longer than good.gcode")
        opened.evaluate("player.seek(player.panes[0].track.total / 2)")
        settle(opened)
        by_time = opened.evaluate("player.panes.map((pane) => pane.track.lengthAt(player.timeOf(pane)))")
        assert by_time[1] < by_time[0]
        opened.locator("#by select").select_option("length")
        settle(opened)
        by_length = opened.evaluate("player.panes.map((pane) => pane.track.lengthAt(player.timeOf(pane)))")
        assert by_length[1] == pytest.approx(by_length[0], abs=0.01)
        times = opened.evaluate("player.panes.map((pane) => player.timeOf(pane))")
        assert times[1] > times[0]
        opened.click("#last")
        assert [figure(opened, "doing", pane) for pane in (0, 1)] == ["finished", "finished"]
        boxes = [opened.locator(".pane").nth(k).bounding_box() for k in (0, 1)]
        assert boxes[0]["y"] == boxes[1]["y"]


def test_what_check_finds_is_marked_and_each_has_a_jump(shown, tracks):
    with shown(tracks[1]) as opened:
        lines = [found.line for found in tracks[1].findings]
        assert opened.inner_text("#findings summary").startswith(f"{len(lines)} findings")
        opened.click("#fault-next")
        assert figure(opened, "line") == str(lines[0])
        opened.keyboard.press("v")
        later = int(figure(opened, "line"))
        assert later > lines[0]
        opened.keyboard.press("Shift+V")
        assert figure(opened, "line") == str(lines[0])
        opened.click("#findings summary")
        opened.locator("#findings li button").last.click()
        assert figure(opened, "line") == str(lines[-1])
        marked = opened.evaluate(
            """() => { const c = document.querySelector("#marks");
              return c.getContext("2d").getImageData(0, 0, c.width, c.height).data.some((part) => part > 0); }"""
        )
        assert marked
        opened.click("#first")
        box = opened.locator("#marks").bounding_box()
        at = opened.evaluate("player.timeline.stops[0].time / player.total")
        opened.mouse.click(box["x"] + at * box["width"] + 2, box["y"] + 3)
        assert figure(opened, "line") == str(lines[0])
    with shown() as opened:
        assert opened.is_hidden("#findings")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_light_and_dark_as_the_system_is_and_as_one_likes(shown, scheme):
    with shown(color_scheme=scheme) as opened:
        ground = opened.evaluate("player.look.ground")
        assert (ground[0] > 0.5) == (scheme == "light")
        opened.click("#theme")
        assert (opened.evaluate("player.look.ground")[0] > 0.5) == (scheme == "dark")
        assert opened.evaluate("getComputedStyle(document.body).colorScheme") != scheme


def test_on_a_phone_all_of_it_fits_and_fingers_do_it(shown, tracks):
    with shown(width=390, height=844, has_touch=True, is_mobile=True, device_scale_factor=3) as opened:
        assert opened.evaluate("document.documentElement.scrollWidth") <= 390
        x, y = opened.evaluate(
            """() => { const pane = player.panes[0], [a, b, c, d] = pane.track.ends(5);
              const box = pane.stage.getBoundingClientRect(), [x, y] = pane.view.px((a + c) / 2, (b + d) / 2);
              return [box.left + x, box.top + y]; }"""
        )
        opened.touchscreen.tap(x, y)
        assert int(figure(opened, "toolpath").split()[0]) > 0
        opened.tap("#play")
        assert opened.evaluate("player.playing")
        opened.tap("#play")
        scale = opened.evaluate("player.panes[0].view.scale")
        opened.evaluate(
            """() => { const stage = player.panes[0].stage, box = stage.getBoundingClientRect();
              const at = (type, id, x, y) => stage.dispatchEvent(new PointerEvent(type, { pointerId: id,
                pointerType: "touch", clientX: box.left + x, clientY: box.top + y, bubbles: true }));
              stage.setPointerCapture = () => {};
              at("pointerdown", 5, 150, 150); at("pointerdown", 6, 200, 150);
              at("pointermove", 6, 260, 150); at("pointerup", 6, 260, 150); at("pointerup", 5, 150, 150); }"""
        )
        assert opened.evaluate("player.panes[0].view.scale") == pytest.approx(scale * 110 / 50, rel=0.01)
    with shown(*tracks, width=390, height=844) as opened:
        parts = [*opened.locator(".pane > *").all(), opened.locator("footer")]
        boxes = [part.bounding_box() for part in parts]
        assert len(boxes) == 7
        for above, below in itertools.pairwise(boxes):
            assert below["y"] >= above["y"] + above["height"] - 0.5


def test_the_nozzle_is_drawn_to_scale_and_what_pushes_into_it_is_told(shown):
    wide = profiles.load("marlin-generic", BODY)
    track = track_of(read_lines(make_lines(SHEET)), wide, name="wide.gcode")
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


def test_joins_are_told_apart_from_toolpaths(shown):
    loaded = profiles.load("marlin-generic", [POINT, "motion.join_mm=0.5"])
    moves = read_lines(make_lines(SHEET, "marlin-generic", "motion.join_mm=0.5"))
    track = track_of(moves, loaded, name="joined.gcode")
    joins = int(track.join.sum())
    assert joins > 5
    first = int(np.flatnonzero(track.join)[0])
    with shown(track) as opened:
        opened.click("#last")
        assert figure(opened, "toolpath") == f"{track.toolpaths} of {track.toolpaths}"
        assert figure(opened, "joins").startswith(f"{joins}, ")
        opened.evaluate(f"player.picked(player.panes[0], {first})")
        assert figure(opened, "toolpath").startswith(f"{first} of")  # it goes on from the one before
        assert figure(opened, "doing") == "going on to the next toolpath"
        opened.click("#forth")
        assert figure(opened, "toolpath").startswith(f"{first + 1} of")
        opened.click("#back")
        assert figure(opened, "toolpath").startswith(f"{first} of")
        opened.fill("#number", str(track.toolpaths))
        opened.press("#number", "Enter")
        assert figure(opened, "toolpath").startswith(f"{track.toolpaths} of")
    with shown() as opened:
        assert opened.is_hidden(".joins")


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
