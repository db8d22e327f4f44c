"""The last order of a sheet, kept in the user's cache: slicing it again with other speeds or another nozzle
starts from there.

Orders are known by the hatch lines that they are of. Another nozzle may hinder and cut otherwise; then what
is kept is followed as far as it can be printed. Whoever asks the same again is given the same again: an order
is not recalled by the search that it came out of.
"""

import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import platformdirs
from numpy.typing import NDArray

from slicer.sequence import Result, followed
from vslice.printable import Printable

VARIABLE = "VSLICE_ORDERS"
"""Names another folder than the usual one."""

MOST_KEPT = 200
"""Sheets; the one that was not used for the longest time goes first."""


def folder() -> Path:
    """Where orders are kept."""
    if named := os.environ.get(VARIABLE):
        return Path(named)
    return Path(platformdirs.user_cache_dir("vslice", appauthor=False)) / "orders"


def asked(*what: object) -> str:
    """What a search was asked for, as a hash of its parts' representations, which hold all there is."""
    return hashlib.sha256(repr(what).encode()).hexdigest()


def recall(
    hatch_lines: NDArray[np.float64], shaped: Printable, asked: str
) -> tuple[NDArray[np.int64], NDArray[np.bool_]] | None:
    """The last order of a sheet's hatch lines (m, 2, 2), as its toolpaths can be printed now.

    Returns:
        The order and its directions, (n,) each; None where nothing is kept that can be followed, or it came
        out of a whole search for the same.
    """
    file = _file(hatch_lines)
    try:
        with np.load(file) as kept:
            toolpath, middle, towards = kept["toolpath"], kept["middle"], kept["towards"]
            if str(kept["asked"]) == asked:
                return None
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        file.unlink(missing_ok=True)  # cut short, or of another version
        return None
    if not len(toolpath) == len(middle) == len(towards) or len(np.unique(toolpath)) != len(hatch_lines):
        return None
    segments = shaped.problem.segments
    near = _nearest(toolpath, middle, shaped.toolpath, segments.mean(axis=1))
    vector = segments[:, 1] - segments[:, 0]
    oriented = followed(shaped.problem, near, (vector * towards[near]).sum(axis=1) < 0)
    if oriented is None:
        return None
    return (oriented >> 1).astype(np.int64), (oriented & 1).astype(np.bool_)


def keep(hatch_lines: NDArray[np.float64], shaped: Printable, result: Result, asked: str) -> None:
    """Keep an order, in place of the one that is kept of the same sheet.

    Where nothing can be written, nothing is kept: the cache saves time and holds nothing of value.
    """
    segments = shaped.problem.segments[result.order]
    towards = np.where(result.flipped[:, None], -1.0, 1.0) * (segments[:, 1] - segments[:, 0])
    file = _file(hatch_lines)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".part", delete=False) as beside:
            try:
                np.savez(
                    beside,
                    toolpath=shaped.toolpath[result.order],
                    middle=segments.mean(axis=1),
                    towards=towards,
                    asked="" if result.stopped else asked,
                )
                beside.close()
                os.replace(beside.name, file)
            except BaseException:
                Path(beside.name).unlink(missing_ok=True)
                raise
        kept = sorted(file.parent.glob("*.npz"), key=lambda one: one.stat().st_mtime)
        for old in kept[:-MOST_KEPT]:
            old.unlink(missing_ok=True)
    except OSError:
        return


def _file(hatch_lines: NDArray[np.float64]) -> Path:
    lines = np.ascontiguousarray(hatch_lines, dtype="<f8")
    return folder() / f"{hashlib.sha256(lines.tobytes()).hexdigest()[:32]}.npz"


def _nearest(
    kept_toolpath: NDArray[np.int32],
    kept_middle: NDArray[np.float64],
    toolpath: NDArray[np.int32],
    middle: NDArray[np.float64],
) -> NDArray[np.int64]:
    """When the nearest kept piece of the same hatch line came, for each piece of now."""
    # By hatch line, so that the pieces of each lie side by side.
    places = np.argsort(kept_toolpath, kind="stable")
    start = np.searchsorted(kept_toolpath[places], np.arange(int(toolpath.max(initial=-1)) + 2))
    near = np.empty(len(toolpath), np.int64)
    for k, s in enumerate(toolpath.tolist()):
        mine = places[start[s] : start[s + 1]]
        near[k] = mine[((kept_middle[mine] - middle[k]) ** 2).sum(axis=1).argmin()]
    return near
