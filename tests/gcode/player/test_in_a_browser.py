"""The page in a real browser: every thing that it offers is done, with a mouse, with keys and with fingers."""

import itertools

import numpy as np
import pytest
from browsing import figure, inked, settle, until
from making import POINT, make_lines, read_lines

import profiles
from gcode.check import check
from gcode.player import track_of


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


def test_the_figures_are_told_however_early_the_first_frame_is(shown):
    early = """const asked = requestAnimationFrame; let first;
      window.requestAnimationFrame = (f) => asked((now) => { first ??= now; f(now - first); });"""
    with shown(before=early) as opened:
        assert figure(opened, "toolpath").startswith("0 of")


def test_the_scrubber_and_the_figures_agree_with_the_track(shown, tracks, sheet):
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
        travel = check(read_lines(make_lines(sheet)), profiles.load("marlin-generic")).travel_mm
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


def test_joins_are_told_apart_from_toolpaths(shown, sheet):
    loaded = profiles.load("marlin-generic", [POINT, "motion.join_mm=0.5"])
    moves = read_lines(make_lines(sheet, "marlin-generic", "motion.join_mm=0.5"))
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
