"""The page: one HTML file with its style, its program and its data, that asks nothing of any network."""

import html
import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from gcode.parse import parse
from gcode.player.track import Track, track_of
from profiles import Profile

if TYPE_CHECKING:
    from gcode.program import Program

SCRIPTS = (
    "track.js",
    "colours.js",
    "view.js",
    "shapes.js",
    "painter_gl.js",
    "painter_2d.js",
    "nozzle.js",
    "overlay.js",
    "pane.js",
    "timeline.js",
    "live.js",
    "main.js",
)
"""In the order in which they build on each other."""

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
"""What the page may load: nothing that is not in it. A live page asks its own server, and nobody else."""


def page(tracks: Sequence[Track], *, title: str = "", live: bool = False) -> str:
    """An HTML file that plays one program, or two of several side by side: at first the first and the last.

    Args:
        tracks: at least one.
        title: of the window; by default the names of the programs.
        live: whether it follows a job, asking the server that it came from.
    """
    packed = [track.packed() for track in tracks]
    headers: list[dict[str, Any]] = [header for header, _ in packed]
    data = "\n".join(
        f'<script type="text/plain" id="data-{k}">{text}</script>' for k, (_, text) in enumerate(packed)
    )
    said = json.dumps({"tracks": headers, "live": live}, separators=(",", ":"))
    parts = {
        "TITLE": html.escape(title or " and ".join(track.name for track in tracks)),
        "POLICY": POLICY + ("; connect-src 'self'" if live else ""),
        "STYLE": _asset("page.css"),
        "SCRIPT": "\n".join(_asset(name) for name in SCRIPTS),
        # A name may hold what would end the element.
        "HEADER": said.replace("<", "\\u003c"),
        "DATA": data,
    }
    out = _asset("page.html")
    # Piece by piece: what is put in may look like a place of its own.
    pieces = []
    while "{{" in out:
        before, _, rest = out.partition("{{")
        name, _, out = rest.partition("}}")
        pieces += [before, parts[name]]
    return "".join([*pieces, out])


def framed(track: Track, *, height_px: int = 620) -> str:
    """The page within another, such as a notebook: a frame that holds all of it."""
    inner = html.escape(page([track]), quote=True)
    return (
        f'<iframe title="{html.escape(track.name, quote=True)}" sandbox="allow-scripts" '
        f'style="width:100%;height:{height_px}px;border:0" srcdoc="{inner}"></iframe>'
    )


def track_of_program(program: "Program", profile: Profile, name: str, facts: Mapping[str, str]) -> Track:
    """The track of a program that was laid out here, as if it had been written and read again.

    Args:
        facts: what its head says, see ``gcode.emit.emit``.
    """
    from gcode.emit import emit

    return track_of(
        list(parse(emit(program, profile, facts), plane=profile.machine.plane, flavor=profile.flavor)),
        profile,
        name=name,
    )


@cache
def _asset(name: str) -> str:
    return files("gcode.player").joinpath("assets", name).read_text(encoding="utf-8")
