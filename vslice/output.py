"""Files that appear whole or not at all."""

import os
import stat
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from vslice.terminal.failure import InputError


def check_place(path: Path | None) -> None:
    """Refuse a place that ``write`` would refuse, before the work whose result is to be written there.

    Raises:
        InputError: the path is a folder, or in none, or must not be written.
    """
    if path is None:
        return
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it.")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first.")
    ordinary = not path.exists() or path.is_file()
    # An ordinary file is replaced by one that is written beside it.
    where = path.resolve().parent if ordinary else path
    if not os.access(where, os.W_OK):
        raise InputError(f"{path}: you may not write to {where}; name another place.")


def write(path: Path | None, chunks: Iterable[bytes]) -> None:
    """Write ``chunks`` to a file, or to stdout where ``path`` is None.

    The file is written beside its place and then renamed: after a failure or on a full disk, what was
    there before is still there. What is no ordinary file, such as a pipe or a device, is written to as
    it is; a link stays a link, and what it points to is replaced.

    Raises:
        InputError: see ``check_place``.
        OSError: it cannot be written, as on a full disk; the text names it. An ordinary file has not
            changed.
    """
    if path is None:
        _to_stdout(chunks)
        return
    check_place(path)
    try:
        _to_file(path, chunks)
    except OSError as error:
        raise OSError(f"{path}: cannot be written: {error.strerror or error}") from error


def _to_stdout(chunks: Iterable[bytes]) -> None:
    if sys.stdout is None:
        raise OSError("standard output: cannot be written: it is closed; name a file with -o")
    try:
        for chunk in chunks:
            sys.stdout.buffer.write(chunk)
        sys.stdout.buffer.flush()
    except BrokenPipeError:  # whoever read it has enough
        raise
    except OSError as error:
        raise OSError(f"standard output: cannot be written: {error.strerror or error}") from error


def _to_file(path: Path, chunks: Iterable[bytes]) -> None:
    mode = path.stat().st_mode if path.exists() else None
    if mode is not None and not stat.S_ISREG(mode):
        with path.open("wb") as out:
            out.writelines(chunks)
        return
    target = path.resolve()
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name[:100]}.")
    try:
        with open(handle, "wb") as out:
            out.writelines(chunks)
            out.flush()
            os.fsync(out.fileno())
        os.chmod(name, stat.S_IMODE(mode) if mode is not None else 0o666 & ~_umask())
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
