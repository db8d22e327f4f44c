"""A page that plays programs: moves and their times as flat arrays, in one HTML file with all that shows them."""

from gcode.player.page import page
from gcode.player.track import Track, track_of

__all__ = ["Track", "page", "track_of"]
