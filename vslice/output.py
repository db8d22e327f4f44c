"""Files that appear whole or not at all."""

import os
import stat
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path


def write(path: Path | None, chunks: Iterable[bytes]) -> None:
    """Write ``chunks`` to a file, or to stdout where ``path`` is None.

    The file is written beside its place and then renamed: after a failure or on a full disk, what was
    there before is still there. What is no ordinary file, such as a pipe or a device, is written to as
    it is; a link stays a link, and what it points to is replaced.

    Raises:
        OSError: it cannot be written; nothing has changed.
    """
    if path is None:
        for chunk in chunks:
            sys.stdout.buffer.write(chunk)
        sys.stdout.buffer.flush()
        return
    target = path.resolve()
    mode = target.stat().st_mode if target.exists() else None
    if mode is not None and not stat.S_ISREG(mode):
        with target.open("wb") as out:
            out.writelines(chunks)
        return
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
