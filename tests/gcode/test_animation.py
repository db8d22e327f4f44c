"""Moving pictures: the print grows in them, from nothing to all of it."""

import shutil
from io import BytesIO

import numpy as np
import pytest
from making import make_grid, make_lines, read_lines
from PIL import Image

import profiles
from gcode.animation import FRAMES_A_SECOND, SECONDS, TO_COME, animation
from gcode.errors import GcodeError
from gcode.player import track_of


@pytest.fixture(scope="module")
def track():
    sheet = make_grid([[-30, 20], [10, 0]], spacing=0.1)
    return track_of(read_lines(make_lines(sheet)), profiles.load("marlin-generic"), name="part.gcode")


def pale(frame):
    """How many points are of the colour of what is to come."""
    return int((np.abs(np.asarray(frame.convert("RGB"), int) - TO_COME).sum(axis=2) < 12).sum())


def test_a_gif_shows_the_print_grow_and_is_the_same_each_time(track):
    data = animation(track, "gif")
    film = Image.open(BytesIO(data))
    assert film.n_frames <= (SECONDS + 1) * FRAMES_A_SECOND
    left = []
    for k in np.linspace(0, film.n_frames - 1, 6).astype(int):
        film.seek(int(k))
        left.append(pale(film))
    assert left == sorted(left, reverse=True)
    assert left[0] > 1000
    assert left[-1] < left[0] / 20
    assert animation(track, "gif") == data


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_an_mp4_is_one(track):
    assert animation(track, "mp4")[4:8] == b"ftyp"


def test_without_ffmpeg_it_is_told(track, monkeypatch):
    monkeypatch.setattr("gcode.animation.shutil.which", lambda _: None)
    with pytest.raises(GcodeError, match="ffmpeg"):
        animation(track, "mp4")
