"""What Marlin makes of the bytes of a line before it looks at its meaning."""

from printer.protocol import MAX_LINE


def kept(line: bytes) -> bytes:
    """What Marlin keeps of a line: no comment, no escapes, no leading blanks, at most 95 bytes."""
    if b";" not in line and b"\\" not in line:
        return line.lstrip(b" ")[:MAX_LINE]
    text, escaped = bytearray(), False
    for byte in line:
        if escaped:
            text.append(byte)
            escaped = False
        elif byte == 0x5C:
            escaped = True
        elif byte == 0x3B:
            break
        else:
            text.append(byte)
    return bytes(text.lstrip(b" ")[:MAX_LINE])
