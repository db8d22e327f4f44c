"""What cannot be measured, as exceptions whose text can be shown to a user as it is."""


class TissueError(Exception):
    """Root of everything that this package raises on purpose."""


class MissingLibraryError(TissueError):
    """A library of the extra is not installed."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"Measuring fibres needs the library {name}; install it with: pip install 'vslice[tissue]'"
        )
