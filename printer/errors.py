"""What this package raises on purpose; every text can be shown to a user as it is."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from printer.report import Report


class PrinterError(Exception):
    """Root of everything that this package raises on purpose."""


class ProtocolError(PrinterError):
    """A program that no Marlin can be sent: a line that is too long or that would change the numbering."""


class OptionError(PrinterError):
    """An option of the emulated printer that does not exist, or a value that it cannot have."""


class PortError(PrinterError):
    """A port that cannot be opened, or that another program holds."""


class PortNameError(PortError):
    """What can be the name of no port."""


class JournalError(PrinterError):
    """A journal that is missing or damaged, or of another program."""


class BusyError(PrinterError):
    """A port or a journal that another sender holds."""


class MovedError(PrinterError):
    """A printer that was reset or moved while a question stood."""


class ResumeError(PrinterError):
    """An interrupted job that cannot be continued safely."""


class StreamError(PrinterError):
    """A job that ended before its last line. ``report`` says how far it came."""

    def __init__(self, message: str, report: "Report") -> None:
        self.report = report
        super().__init__(message)
