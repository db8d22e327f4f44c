"""A grid of fibre angles: the ``Grid`` that everything starts from, read from and written to JSON."""

import hashlib
import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from slicer.errors import GridError
from slicer.grid_schema import GridFile, parse
from slicer.outline import NoAreaError, Ring, repair
from slicer.tilts import fold

MAX_FILE_BYTES = 64_000_000
MOST_SAID = 10
MAX_META_DEPTH = 200
"""Levels of lists and objects in ``meta``, far from where Python's own limit would end a program."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A sheet of tiles, each with the tilt of the fibres in it.

    Row 0 is the bottom row; tile (col, row) stands at ``angles_deg[row, col]``.

    Attributes:
        angles_deg: float64 (rows, cols), tilt in (-90, 90], counter-clockwise from +x; NaN is an empty
            tile.
        spacing_mm: float64 (rows, cols), distance between neighbouring toolpaths of a tile.
        tile_mm: width and height of every tile.
        origin_mm: x and y of the sheet's lower left corner.
        outline_mm: polygons that clip the sheet, each a list of rings, the outer one first and then its
            holes; None for the whole sheet.
        min_length_mm: shorter toolpaths are dropped; None means the tile's spacing.
        meta: anything that JSON can hold, kept as it is; an empty object if the file has none.
        source: where the grid came from, for messages.
        sha256: hash of the file's bytes in hexadecimal; empty for a grid that was made in memory.
        warnings: what was mended or looks like a mistake in the file, a line each that names the source.
    """

    angles_deg: NDArray[np.float64]
    spacing_mm: NDArray[np.float64]
    tile_mm: tuple[float, float]
    origin_mm: tuple[float, float] = (0.0, 0.0)
    outline_mm: list[list[Ring]] | None = None
    min_length_mm: float | None = None
    meta: Any = field(default_factory=dict)
    source: str = "grid"
    sha256: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of tiles from bottom to top."""
        return int(self.angles_deg.shape[0])

    @property
    def cols(self) -> int:
        """Number of tiles from left to right."""
        return int(self.angles_deg.shape[1])


def read(path: Path) -> Grid:
    """Read a grid file.

    Raises:
        GridError: the file is missing, unreadable or no grid; one line for each problem.
    """
    return from_bytes(_bytes(path), source=str(path))


def from_bytes(data: bytes, *, source: str = "grid") -> Grid:
    """Make a ``Grid`` of the bytes of a grid file, whatever they came through; ``sha256`` is theirs.

    Raises:
        GridError: they are no text in UTF-8, or no grid.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        wrong = f"is no text: byte 0x{data[error.start]:02x} at offset {error.start} is not UTF-8."
        raise GridError(source, [wrong]) from None
    if source.lower().endswith(".csv"):
        from slicer.drawn_files import from_csv

        sheet: Grid = from_csv(text, source)
    else:
        sheet = loads(text, source=source)
    return replace(sheet, sha256=hashlib.sha256(data).hexdigest())


def loads(text: str, *, source: str = "grid") -> Grid:
    """Make a ``Grid`` of the JSON text of a grid file; ``source`` is named in messages.

    Angles are folded into (-90, 90], outlines that touch or cross themselves are repaired; what the user
    should know of it stands in ``warnings``. Own toolpaths and regions become a ``DrawnSheet``.

    Raises:
        GridError: the text is no JSON or no grid.
    """
    data = _json(text, source)
    if isinstance(data, dict) and ("segments" in data or "type" in data):
        from slicer import drawn_files

        if drawn_files.is_drawn(data):
            return drawn_files.from_json(data, source)
    checked = parse(data, source)
    angles = np.array(
        [[np.nan if angle is None else angle for angle in row] for row in checked.angles_deg], np.float64
    )
    spacing = (
        np.array([[s or 0.0 for s in row] for row in checked.spacing_mm], np.float64)
        if isinstance(checked.spacing_mm, list)
        else np.full(angles.shape, checked.spacing_mm)
    )
    angles, warnings = fold(angles)
    outline = checked.outline_mm
    if outline is not None:
        try:
            outline, repaired = repair(outline)
        except NoAreaError as error:
            raise GridError(source, [f"outline_mm: {error}"]) from None
        warnings += [f"outline_mm: {line}." for line in repaired[:MOST_SAID]]
        if len(repaired) > MOST_SAID:
            warnings.append(f"outline_mm: so it is with {len(repaired) - MOST_SAID} more polygons.")
    if (depth := _depth(checked.meta)) > MAX_META_DEPTH:
        raise GridError(source, [f"meta: is nested {depth} levels deep; {MAX_META_DEPTH} is the most."])
    return Grid(
        angles_deg=angles,
        spacing_mm=spacing,
        tile_mm=checked.tile_mm,
        origin_mm=checked.origin_mm,
        outline_mm=outline,
        min_length_mm=checked.min_length_mm,
        meta=checked.meta,
        source=source,
        warnings=tuple(f"{source}: {warning}" for warning in warnings),
    )


def dumps(grid: Grid) -> str:
    """The JSON text of a grid file, a line for each row of tiles. ``loads`` gives the same grid again."""
    fields: dict[str, Any] = {
        "tile_mm": grid.tile_mm[0] if grid.tile_mm[0] == grid.tile_mm[1] else list(grid.tile_mm),
        "spacing_mm": grid.spacing_mm.flat[0]
        if (grid.spacing_mm == grid.spacing_mm.flat[0]).all()
        else grid.spacing_mm.tolist(),
        "angles_deg": [[None if np.isnan(a) else a for a in row] for row in grid.angles_deg.tolist()],
    }
    if grid.origin_mm != (0.0, 0.0):
        fields["origin_mm"] = list(grid.origin_mm)
    if grid.outline_mm is not None:
        fields["outline_mm"] = grid.outline_mm
    if grid.min_length_mm is not None:
        fields["min_length_mm"] = grid.min_length_mm
    if grid.meta != {}:
        fields["meta"] = grid.meta
    lines = []
    for key, value in fields.items():
        if key in ("angles_deg", "spacing_mm") and isinstance(value, list):
            rows = ",\n".join(f"  {json.dumps(row)}" for row in value)
            lines.append(f' "{key}": [\n{rows}\n ]')
        else:
            lines.append(f' "{key}": {_json_text(value)}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _json_text(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    # Half of a surrogate pair, which JSON can say and UTF-8 cannot.
    lone = any("\ud800" <= character <= "\udfff" for character in text)
    return json.dumps(value) if lone else text


def _depth(value: Any) -> int:
    """How many lists and objects stand in each other."""
    depth = 0
    level = [value]
    while level := [item for item in level if isinstance(item, list | dict)]:
        depth += 1
        level = [part for item in level for part in (item.values() if isinstance(item, dict) else item)]
    return depth


def schema() -> dict[str, Any]:
    """The JSON Schema of a grid file, for editors."""
    return GridFile.model_json_schema()


def _bytes(path: Path) -> bytes:
    source = str(path)
    try:
        if path.is_dir():
            raise GridError(source, ["is a folder; name a grid file in it."])
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise GridError(
                source,
                [
                    f"has {size / 1e6:.1f} MB, but a grid file may have {MAX_FILE_BYTES / 1e6:.0f} MB. "
                    "Is it the right file? Otherwise split the sheet."
                ],
            )
        return path.read_bytes()
    except FileNotFoundError:
        raise GridError(source, ["there is no such file."]) from None
    except OSError as error:
        raise GridError(source, [f"cannot be read: {error.strerror}."]) from None


def _json(text: str, source: str) -> Any:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value in pairs:
            if key in found:
                raise GridError(source, [f"key '{key}' stands twice in one object; keep one."])
            found[key] = value
        return found

    def fail(problem: str) -> NoReturn:
        raise GridError(source, [problem]) from None

    try:
        return json.loads(text, object_pairs_hook=unique)
    except json.JSONDecodeError as error:
        if not text.strip():
            fail('is empty; a grid is an object, {"tile_mm": ...}.')
        if text.lstrip()[0] not in "{[":
            fail('begins with no brace, so it is no grid, which is an object, {"tile_mm": ...}.')
        if not text[error.pos :].strip():
            lines = len(text.rstrip().splitlines())
            many = f"{lines} lines" if lines > 1 else "1 line"
            fail(f"ends too early, after {many}: a bracket or a quote is not closed. Was the file cut off?")
        rest, before = text[error.pos :].lstrip(), text[: error.pos].rstrip()
        if before.endswith(",") and rest[:1] in ("]", "}"):
            fail(f"line {error.lineno}, column {error.colno}: a comma stands before {rest[0]}; take it away.")
        fail(f"line {error.lineno}, column {error.colno}: this is no JSON: {error.msg}.")
    except RecursionError:
        fail("is nested too deeply; a grid has four levels of lists at most.")
    except ValueError as error:  # an integer of more digits than Python converts
        fail(f"holds a number that cannot be read: {error}.")
