"""A sidecar beside a measured grid: its record, with the keys of the Brain Imaging Data Structure."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslice import __version__

if TYPE_CHECKING:
    from slicer.grid import Grid

TABLES = ("coherence", "deviation_deg", "off_plane_deg")


def sidecar(sheet: "Grid", file: Path) -> bytes:
    """JSON with the keys of BIDS 1.10 (derivatives, microscopy) where it has any, and the rest of ``meta``.

    ``PixelSize`` is [x, y] in µm. Tables are those of the grid, row 0 at the bottom.
    """
    meta: dict[str, Any] = dict(sheet.meta or {})
    source = meta.pop("source", {})
    told: dict[str, Any] = {
        "Description": "Fibre angles of a tissue, averaged over tiles",
        "Sources": [str(source.get("file", file.name))],
        "SourceSHA256": source.get("sha256"),
        "GeneratedBy": [{"Name": "vslice", "Version": __version__, "Dependencies": meta.pop("versions", {})}],
    }
    if (pixel := source.get("pixel_um")) is not None:
        told |= {"PixelSize": pixel if isinstance(pixel, list) else [pixel, pixel], "PixelSizeUnits": "um"}
    told["SourceProperties"] = source
    told["TileSize"] = list(sheet.tile_mm)
    told["TileSizeUnits"] = "mm"
    told |= {key: value for key, value in meta.items() if key not in TABLES}
    told |= {key: meta[key] for key in TABLES if key in meta}
    return (json.dumps(told, indent=1, ensure_ascii=False) + "\n").encode("utf-8")
