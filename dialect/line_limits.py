"""What Marlin has room for in a line, and what it must never be sent."""

import re

MAX_LINE = 95
"""Longest line in bytes, newline apart: Marlin keeps MAX_CMD_SIZE = 96 with the end mark."""


def unescaped(line: bytes) -> bytes:
    """The line as Marlin stores it: a backslash goes, and the byte behind it stays."""
    return re.sub(rb"\\(.?)", rb"\1", line, flags=re.DOTALL)


def fault_of(command: str, highest_number: int) -> str | None:
    """Why ``command`` must never be sent as a numbered line, or None if it may be."""
    length = len(unescaped(command.encode(errors="replace")))
    room = MAX_LINE - len(b"N%d *255" % highest_number)
    if length > room:
        return (
            f"it has {length} bytes, and Marlin takes at most {room} beside line number and checksum: "
            "shorten it"
        )
    if any(letter < " " or letter == "\x7f" for letter in command):
        return "a control character ends or garbles the line: remove it"
    if "M110" in command:
        return "M110 anywhere in a line makes Marlin reset its line counter: remove it"
    return None
