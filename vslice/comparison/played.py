"""The best run of each method as a page that plays two of them side by side."""

from gcode.player import page, track_of_program
from gcode.program import Program
from slicer.sequence import Result
from vslice import __version__


class Played:
    """Keeps the program of the cheapest run of each method; the first of equal ones."""

    def __init__(self) -> None:
        self._best: dict[str, tuple[float, int, Program]] = {}

    def keep(self, method: str, result: Result, made: Program) -> None:
        """A run has ended; see ``run_methods``."""
        if method not in self._best or result.cost < self._best[method][0]:
            self._best[method] = (result.cost, result.seed, made)

    def page(self, title: str) -> str:
        """The page, the quickest program first and the slowest last, which is what it shows."""
        tracks = [
            track_of_program(
                made, made.profile, method, {"version": __version__, "method": method, "seed": str(seed)}
            )
            for method, (_, seed, made) in self._best.items()
        ]
        return page(sorted(tracks, key=lambda track: track.total_s), title=title)
