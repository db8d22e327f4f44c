"""Files that appear whole or not at all."""

import os
import stat
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import click


def write(path: Path | None, chunks: Iterable[bytes]) -> None:
    """Write ``chunks`` to a file, or to stdout where ``path`` is None.

    The file is written beside its place and then renamed: after a failure or on a full disk, what was
    there before is still there. What is no ordinary file, such as a pipe or a device, is written to as
    it is; a link stays a link, and what it points to is replaced.

    Raises:
        ClickException: the path is a folder, or in none.
        OSError: it cannot be written; nothing has changed.
    """
    if path is None:
        for chunk in chunks:
            sys.stdout.buffer.write(chunk)
        sys.stdout.buffer.flush()
        return
    mode = path.stat().st_mode if path.exists() else None
    if path.is_dir():
        raise click.ClickException(f"{path} is a folder; name a file in it.")
    if not path.parent.is_dir():
        raise click.ClickException(f"{path}: there is no folder {path.parent}; make it first.")
    if mode is not None and not stat.S_ISREG(mode):
        with path.open("wb") as out:
            out.writelines(chunks)
        return
    target = path.resolve()
    with tempfile.NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}.", delete=False) as out:
        try:
            out.writelines(chunks)
            out.flush()
            os.fsync(out.fileno())
            os.chmod(out.name, stat.S_IMODE(mode) if mode is not None else 0o666 & ~_umask())
            os.replace(out.name, target)
        except BaseException:
            os.unlink(out.name)
            raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
