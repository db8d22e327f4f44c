"""What the slicer refuses, as exceptions whose text can be shown to a user as it is."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class SlicerError(Exception):
    """Root of everything that this package raises on purpose."""


class GridError(SlicerError):
    """A grid file that cannot be used. ``problems`` holds one line for each thing that is wrong."""

    def __init__(self, source: str, problems: list[str]) -> None:
        self.source = source
        self.problems = problems
        shown = [f"{source}: {problem}" for problem in problems[:10]]
        if len(problems) > 10:
            shown.append(f"{source}: and {len(problems) - 10} more problems")
        super().__init__("\n".join(shown))


class CrossingError(SlicerError):
    """Two toolpaths cross or overlap, so neither lies below the other. ``pair`` holds their indices."""

    def __init__(self, pair: tuple[int, int], message: str) -> None:
        self.pair = pair
        super().__init__(message)


class CycleError(SlicerError):
    """Toolpaths stand in one another's way in a ring.

    ``components`` holds int arrays, the toolpaths of each group that cannot be begun anywhere.
    """

    def __init__(self, components: "list[NDArray[np.intp]]") -> None:
        self.components = components
        first = components[0].tolist()
        shown = ", ".join(map(str, first[:6])) + (f" and {len(first) - 6} more" if len(first) > 6 else "")
        total = sum(map(len, components))
        super().__init__(
            f"{total} toolpaths stand in one another's way, in {len(components)} groups, the first of "
            f"{len(first)}: {shown}. None of a group can be printed first with this nozzle. Take a narrower "
            "one, let it press deeper, or have toolpaths cut."
        )


class SequenceError(SlicerError):
    """A sequencing problem that has no answer as it was put: an impossible start, an unknown method."""


class SequenceWarning(UserWarning):
    """An order was found by other means than were asked for: fewer workers, or some that were lost."""
