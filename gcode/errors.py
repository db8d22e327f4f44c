"""What this package refuses, as exceptions whose text can be shown to a user as it is."""


class GcodeError(Exception):
    """Root of everything that this package raises on purpose."""


class BuildVolumeError(GcodeError):
    """A position outside the machine: the text names tile, toolpath, axis and both numbers."""


class ParseError(GcodeError):
    """Text that is no G-code of the kind that is read here; the text names the line."""
