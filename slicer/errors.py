"""What the slicer refuses, as exceptions whose text can be shown to a user as it is."""


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


class SequenceError(SlicerError):
    """A sequencing problem that has no answer as it was put: an impossible start, an unknown method."""


class SequenceWarning(UserWarning):
    """An order was found by other means than were asked for: fewer workers, or some that were lost."""
