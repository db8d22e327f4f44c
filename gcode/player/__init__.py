"""A page that plays programs: moves and their times as flat arrays, in one HTML file that shows them."""

from gcode.player.html_page import framed, page, track_of_program
from gcode.player.track import Track, track_of

__all__ = ["Track", "framed", "page", "track_of", "track_of_program"]
