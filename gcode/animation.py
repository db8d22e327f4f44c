"""A program as a moving picture: GIF, which Pillow writes, or MP4 by ffmpeg where that is installed."""

import math
import shutil
import subprocess
from collections.abc import Iterator
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gcode.errors import GcodeError
from gcode.player import Track
from gcode.player.track import PRIME, TOOLPATH, TRAVEL

FORMATS = ("gif", "mp4")
SECONDS, FRAMES_A_SECOND = 10, 15
LONGEST_PX, FINER, MARGIN_PX, FOOT_PX = 640, 2, 16, 18
GROUND, INK, TO_COME, PAST = (255, 255, 255), (30, 30, 30), (225, 228, 232), (31, 119, 180)
FIRST, LAST = np.array([68.0, 57.0, 150.0]), np.array([240.0, 150.0, 40.0])
"""Colours of the first toolpath and of the last."""


def animation(track: Track, file_format: str) -> bytes:
    """The print in ten seconds, and a second of it all; the same track gives the same bytes.

    Args:
        file_format: "gif" or "mp4".

    Raises:
        GcodeError: there is no ffmpeg for an MP4, or it failed.
    """
    frames = _frames(track)
    if file_format == "mp4":
        return _film(frames)
    first, *rest = [frame.quantize(48, dither=Image.Dither.NONE) for frame in frames]
    out = BytesIO()
    took = round(1000 / FRAMES_A_SECOND)
    first.save(out, "GIF", save_all=True, append_images=rest, duration=took, loop=0, optimize=False)
    return out.getvalue()


def _frames(track: Track) -> Iterator[Image.Image]:
    laid = np.flatnonzero(track.kind == TOOLPATH)
    points = np.concatenate([track.end_mm[laid], track.end_mm[np.maximum(laid - 1, 0)]])
    low, size = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-3)
    scale = LONGEST_PX / float(size.max())
    # Even sides: films are coded in blocks.
    width, height = (2 * math.ceil((scale * side + 2 * MARGIN_PX) / 2) for side in size)
    place = (track.end_mm - low) * (scale * FINER)
    place[:, 0] += MARGIN_PX * FINER
    place[:, 1] = (height - MARGIN_PX) * FINER - place[:, 1]
    picture = Image.new("RGB", (width * FINER, height * FINER), GROUND)
    draw = ImageDraw.Draw(picture)
    thick = max(FINER, round(float(np.median(track.height_mm)) * scale * FINER * 0.9))
    # Joins count with the toolpath before them.
    number = np.zeros(len(track.kind), np.int64)
    number[laid] = track.join == 0
    number = np.cumsum(number)
    for s in laid.tolist():
        _line(draw, place, s, TO_COME, thick)
    done = 0
    moments = SECONDS * FRAMES_A_SECOND
    for k in range(moments + FRAMES_A_SECOND):
        time = track.total_s * min(1.0, k / max(1, moments - 1))
        until = int(np.searchsorted(track.end_s, time, "right"))
        for s in range(done, until):
            if track.kind[s] in (TOOLPATH, PRIME):
                share = (int(number[s]) - 1) / max(1, track.toolpaths - 1)
                red, green, blue = (round(float(part)) for part in FIRST + share * (LAST - FIRST))
                _line(draw, place, s, (red, green, blue), thick)
        done = max(done, until)
        frame = picture.copy()
        above = ImageDraw.Draw(frame)
        if 0 < until < len(track.kind):
            for s in range(max(1, until - 3), until):  # where it has just come along
                if track.kind[s] == TRAVEL:
                    _line(above, place, s, PAST, FINER)
            x, y = place[until - 1]
            tip = 7 * FINER
            above.polygon([(x, y), (x + tip / 2, y - tip), (x - tip / 2, y - tip)], INK)
        frame = frame.resize((width, height), Image.Resampling.BOX)
        whole = Image.new("RGB", (width, height + FOOT_PX), GROUND)
        whole.paste(frame)
        laid_now = int(number[until - 1]) if until else 0
        text = f"{laid_now} of {track.toolpaths}   {int(time) // 60}:{int(time) % 60:02d}"
        ImageDraw.Draw(whole).text((MARGIN_PX, height), text, INK)
        yield whole


def _line(
    draw: ImageDraw.ImageDraw, place: NDArray[np.float64], s: int, colour: tuple[int, int, int], thick: int
) -> None:
    if s > 0:
        draw.line([tuple(place[s - 1]), tuple(place[s])], colour, thick)


def _film(frames: Iterator[Image.Image]) -> bytes:
    tool = shutil.which("ffmpeg")
    if tool is None:
        raise GcodeError("an MP4 is written by ffmpeg, which is not installed here; write a .gif instead")
    pictures = list(frames)
    width, height = pictures[0].size
    # To a pipe no index can be written afterwards, so the film is cut into fragments.
    words = [tool, "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    words += ["-r", str(FRAMES_A_SECOND), "-i", "-", "-pix_fmt", "yuv420p"]
    words += ["-movflags", "frag_keyframe+empty_moov", "-f", "mp4", "-"]
    done = subprocess.run(
        words, input=b"".join(picture.tobytes() for picture in pictures), capture_output=True, check=False
    )
    if done.returncode != 0:
        raise GcodeError(f"ffmpeg wrote no MP4: {done.stderr.decode(errors='replace').strip()}")
    return done.stdout
