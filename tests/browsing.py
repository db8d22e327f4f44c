"""A real browser for tests: the distribution's Chromium, driven by Playwright; without either they are skipped."""

import shutil
import time
from contextlib import contextmanager

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader"]
SLOW_MS = 90_000
"""The machine may be busy with other things."""


_open = []
"""The browser that another fixture of this process has open: Playwright starts once in a process."""


@contextmanager
def browser():
    """Chromium without a window; WebGL2 is drawn in software."""
    if _open:
        yield _open[0]
        return
    api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("there is no Chromium here")
    with api.sync_playwright() as play:
        opened = play.chromium.launch(executable_path=path, args=FLAGS)
        _open.append(opened)
        try:
            yield opened
        finally:
            _open.clear()
            opened.close()


@contextmanager
def showing(opened, address, width=1280, height=800, before="", **more):
    """The page at an address, when it is ready. Nothing may go wrong in it, and nothing may be asked for but it.

    ``before`` is run in it before its own scripts are.
    """
    context = opened.new_context(viewport={"width": width, "height": height}, **more)
    context.add_init_script(before)
    context.set_default_timeout(SLOW_MS)
    page = context.new_page()
    wrong, asked = [], []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    try:
        page.goto(address)
        page.wait_for_selector("body[data-ready]")
        settle(page)
        yield page
        assert wrong == []
        mine = address.partition("#")[0]
        assert [url for url in asked if not url.startswith((mine, "data:"))] == []
    finally:
        context.close()


def settle(page):
    """Until what was asked for is drawn; what plays on is never at rest, and is given two frames."""
    page.evaluate(
        """() => new Promise((done) => {
          let frames = 0;
          const next = () => ++frames > 1 && (player.whole || player.playing) ? done() : requestAnimationFrame(next);
          requestAnimationFrame(next);
        })"""
    )


def until(page, true, seconds=SLOW_MS / 1000):
    """Wait until something is true. Playwright's own way would need the page to allow eval, which it does not."""
    end = time.monotonic() + seconds
    while not page.evaluate(true):
        assert time.monotonic() < end, true
        page.wait_for_timeout(50)


def figure(page, name, pane=0):
    """What a figure says when all has been drawn."""
    settle(page)
    return page.locator(f"[data-figure={name}]").nth(pane).inner_text()


def inked(page, pane=0, rgb=None):
    """How many points of the drawn print are not of the ground's colour, or are nearly of a colour."""
    settle(page)
    return page.evaluate(
        """([pane, rgb]) => {
          const { canvas } = player.panes[pane], copy = document.createElement("canvas");
          copy.width = canvas.width; copy.height = canvas.height;
          const ctx = copy.getContext("2d");
          ctx.drawImage(canvas, 0, 0);
          const data = ctx.getImageData(0, 0, copy.width, copy.height).data;
          const ground = player.look.ground.map((part) => Math.round(255 * part));
          let count = 0;
          for (let k = 0; k < data.length; k += 4) {
            const off = (c) => Math.abs(data[k] - c[0]) + Math.abs(data[k + 1] - c[1]) + Math.abs(data[k + 2] - c[2]);
            if (rgb ? off(rgb) < 60 : off(ground) > 40) count++;
          }
          return count;
        }""",
        [pane, rgb],
    )
