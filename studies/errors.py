"""What goes wrong with a study."""


class StudyError(Exception):
    """A study cannot be read, run or reported; the text says where, what and what to do."""
