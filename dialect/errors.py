"""What this package refuses, as an exception whose text can be shown to a user as it is."""


class ReadError(Exception):
    """Text that is no program for Marlin, or a file that holds none; the text names file and line."""
