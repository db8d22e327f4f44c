"""What Marlin has room for in a line, and what it must never be sent."""

import math
import re

MAX_LINE = 95
"""Longest line in bytes, newline apart: Marlin keeps MAX_CMD_SIZE = 96 with the end mark."""


def unescaped(line: bytes) -> bytes:
    """The line as Marlin stores it: a backslash goes, and the byte behind it stays."""
    return re.sub(rb"\\(.?)", rb"\1", line, flags=re.DOTALL)


def fault_of(
    command: str, highest_number: int, max_line: int | None = MAX_LINE, title: str = "Marlin"
) -> str | None:
    """Why ``command`` must never be sent as a numbered line, or None if it may be.

    Args:
        max_line: the longest line of the firmware, number and checksum included; None for any.
        title: its name, for the message.
    """
    length = len(unescaped(command.encode(errors="replace")))
    room = math.inf if max_line is None else max_line - len(b"N%d *255" % highest_number)
    if length > room:
        return (
            f"it has {length} bytes, and {title} takes at most {room} beside line number and checksum: "
            "shorten it"
        )
    if any(letter < " " or letter == "\x7f" for letter in command):
        return "a control character ends or garbles the line: remove it"
    if "M110" in command:
        return "M110 anywhere in a line makes Marlin reset its line counter: remove it"
    return None
