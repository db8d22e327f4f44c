"""A program as it is stored: bytes of any origin become lines of text, within bounds, or a refusal."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from dialect.errors import ReadError

MAX_BYTES = 128 * 2**20
MAX_LINES = 5_000_000
"""More than a hundred times the largest sheets; what is beyond would fill the memory."""

CHUNK = 2**20
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_LINE_END = re.compile(rb"\r\n|\r")


@dataclass(frozen=True)
class Source:
    """Lines without their ends; line k of an editor is ``lines[k - 1]``. ``sha256`` is that of the bytes.

    Bytes that are no UTF-8 are kept as lone surrogates, so that a checksum over them can be verified.
    """

    name: str
    lines: list[str]
    sha256: str


def load(path: Path) -> Source:
    """Read a file.

    Raises:
        ReadError: it cannot be read, is no text, is no program, or is too large to be one.
    """
    try:
        with path.open("rb") as stream:
            return load_stream(stream, str(path))
    except FileNotFoundError:
        raise ReadError(f"{path}: there is no such file") from None
    except IsADirectoryError:
        raise ReadError(f"{path}: is a folder; name a G-code file") from None
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {error.strerror}") from None


def load_stream(stream: BinaryIO, name: str) -> Source:
    """Read what comes from a file, a pipe or a device, and no more of it than a program can have.

    Raises:
        ReadError: as ``load``.
    """
    data = bytearray()
    while chunk := stream.read(CHUNK):
        if (place := chunk.find(b"\0")) >= 0 or data[:2] in _UTF_16 or (not data and chunk[:2] in _UTF_16):
            raise ReadError(_no_text(name, bytes(data[:2]) or chunk[:2], len(data) + place))
        data += chunk
        if len(data) > MAX_BYTES:
            raise ReadError(f"{name}: has more than {MAX_BYTES // 2**20} MB, which is no program of a sheet")
    if not data.removeprefix(b"\xef\xbb\xbf").strip():
        raise ReadError(f"{name}: is empty: there is no program in it")
    return from_bytes(bytes(data), name)


def from_bytes(data: bytes, name: str) -> Source:
    """Decode a whole program; see ``load``.

    Raises:
        ReadError: as ``load``.
    """
    if data[:2] in _UTF_16 or b"\0" in data:
        raise ReadError(_no_text(name, data[:2], data.find(b"\0")))
    plain = _LINE_END.sub(b"\n", data) if b"\r" in data else data
    if plain.count(b"\n") > MAX_LINES:
        raise ReadError(f"{name}: has more than {MAX_LINES} lines, which is no program of a sheet")
    text = plain.decode("utf-8-sig", errors="surrogateescape")
    if text.lstrip()[:1] == "{":
        raise ReadError(f"{name}: is JSON, perhaps a grid, and no G-code")
    lines = text.split("\n")  # splitlines() would also split at what is no line end in a program
    if lines[-1] == "":
        lines.pop()
    return Source(name, lines, hashlib.sha256(data).hexdigest())


def _no_text(name: str, first: bytes, place: int) -> str:
    if first in _UTF_16:
        return f"{name}: is text in UTF-16; save it as UTF-8"
    return (
        f"{name}: is no text, its byte {place} is zero: a binary file, or text in UTF-16 (save it as UTF-8)"
    )
