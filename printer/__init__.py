"""A text program becomes a print: protocol, sender, journal, emulator. Knows no geometry: it sends lines.

A reply is parsed in ``protocol``, its free text read in ``firmware_words``, and what was not done is judged
in ``refusals``.

`stream` is the public call. Importing this package teaches pyserial the scheme ``marlin://``.
"""

import serial

from printer.commands import Program, make_program, read_program
from printer.errors import (
    BusyError,
    JournalError,
    MovedError,
    PortError,
    PrinterError,
    ProtocolError,
    ResumeError,
    StreamError,
)
from printer.job import Job, stream
from printer.journal import Journal
from printer.report import Progress, Report, State
from printer.settings import Safety, Settings

HANDLERS = "printer.urlhandler"
if HANDLERS not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append(HANDLERS)

__all__ = [
    "BusyError",
    "Job",
    "Journal",
    "JournalError",
    "MovedError",
    "PortError",
    "PrinterError",
    "Program",
    "Progress",
    "ProtocolError",
    "Report",
    "ResumeError",
    "Safety",
    "Settings",
    "State",
    "StreamError",
    "make_program",
    "read_program",
    "stream",
]
