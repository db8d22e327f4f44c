"""TIFF: several pages and channels, and the pixel sizes of resolution tags, ImageJ and OME."""

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tissue.errors import TissueError
from tissue.libraries import library
from tissue.picture import (
    MAX_PIXELS,
    SCREEN_DPI,
    Picture,
    hash_of,
    opened_by_pillow,
    pixel_of,
    refuse_bomb,
    split_alpha,
    white_of,
)

MAX_VALUES = 4 * MAX_PIXELS
"""Most values of a stack whose pages must be decoded together."""
MM = {
    "nm": 1e-6, "µm": 1e-3, "μm": 1e-3, "um": 1e-3, "micron": 1e-3, "microns": 1e-3, "micrometer": 1e-3,
    "mm": 1.0, "millimeter": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "inches": 25.4, "in": 25.4,
}  # fmt: skip
"""What units of length are in mm, as ImageJ and OME write them."""


def read(path: Path, page: int | None) -> Picture:
    """Read one page of a TIFF with all its channels.

    What is neither compressed nor in tiles is mapped into memory, whatever its size.

    Raises:
        TissueError: it is broken, too large, compressed in a way that no library here reads, or has no
            such page.
    """
    tifffile = library("tifffile")
    try:
        with tifffile.TiffFile(path) as file:
            if not file.series:
                raise TissueError(f"{path}: holds no image.")
            return _page(path, file, page)
    except (TissueError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - broken files make its readers stumble in every way
        raise TissueError(f"{path}: is broken or cut off: {error}.") from None


def _page(path: Path, file: Any, page: int | None) -> Picture:
    series, first = file.series[0], file.pages[0]
    axes, shape = str(series.axes), tuple(int(n) for n in series.shape)
    if "Y" not in axes or "X" not in axes:
        raise TissueError(f"{path}: has axes {axes} and no image plane.")
    height, width = shape[axes.index("Y")], shape[axes.index("X")]
    # A page is what lies on no axis of the plane, of channels or of samples.
    outer = [n for n, name in zip(shape, axes, strict=True) if name not in "YXSC"]
    pages = int(np.prod(outer)) if outer else 1
    said = []
    if page is not None and page >= pages:
        raise TissueError(f"{path}: page {page} is asked for, but it has {pages}, counted from 0.")
    if page is None and pages > 1:
        said.append(f"{path}: page 0 of {pages} was taken; --page gives another")
    chosen = page or 0
    pixels = _pixels(path, file, series, axes, shape, chosen, (width, height))
    opaque = None
    if first.photometric.name == "PALETTE" and first.colormap is not None and pixels.ndim == 2:
        pixels = np.moveaxis(np.asarray(first.colormap), 0, -1)[pixels]
        said.append(f"{path}: its palette was taken as colours")
    elif first.photometric.name == "MINISWHITE" and pixels.dtype.kind == "u":
        pixels = np.iinfo(pixels.dtype).max - pixels
    samples = pixels.shape[2] if pixels.ndim == 3 else 1
    if pixels.ndim == 3 and first.extrasamples and samples in (2, 4) and "S" in axes:
        pixels, opaque = split_alpha(pixels)
        if opaque is not None:
            said.append(f"{path}: {1 - opaque.mean():.1%} of it are transparent and were left out")
    rgb = pixels.ndim == 3 and pixels.shape[2] == 3 and ("S" in axes or first.photometric.name == "PALETTE")
    facts: dict[str, Any] = {
        "format": "TIFF",
        "axes": axes,
        "size_px": [width, height],
        "type": str(pixels.dtype),
    }
    if pages > 1:
        facts["page"] = chosen
    pixel = _pixel_mm(file, first)
    return Picture(pixels, pixel, rgb, opaque, white_of(pixels), str(path), hash_of(path), facts, tuple(said))


def _pixels(
    path: Path, file: Any, series: Any, axes: str, shape: tuple[int, ...], page: int, size: tuple[int, int]
) -> NDArray[Any]:
    """(height, width) or (height, width, channels) of a page."""
    tifffile = library("tifffile")
    if series.dataoffset is not None:
        try:
            whole = tifffile.memmap(path, series=0, mode="r")
            if whole.shape == shape:
                return _plane(whole, axes, page)
        except ValueError as error:
            if "beyond" in str(error) or "length" in str(error) or "size" in str(error):
                raise TissueError(f"{path}: is cut off: {error}.") from None
    refuse_bomb(path, *size)
    per_page = int(np.prod([n for n, name in zip(shape, axes, strict=True) if name not in "YXS"]))
    try:
        if len(series.pages) == per_page > 1:
            return _of_pages(series, axes, shape, page)
        # All pages are decoded together.
        if math.prod(shape) > MAX_VALUES:
            raise TissueError(
                f"{path}: has {math.prod(shape) / 1e6:.0f} million values in one piece; split it."
            )
        return _plane(series.asarray(), axes, page)
    except (ValueError, ImportError) as error:
        if "imagecodecs" not in str(error):
            raise
    # The commonest compressions are known to Pillow as well.
    try:
        if len(axes.replace("S", "")) == 2:
            return np.asarray(opened_by_pillow(path, lambda image: np.array(image)))
    except TissueError:
        pass
    name = file.pages[0].compression.name
    raise TissueError(
        f"{path}: is compressed by {name}; to read it: pip install imagecodecs, or save it uncompressed."
    )


def _of_pages(series: Any, axes: str, shape: tuple[int, ...], page: int) -> NDArray[Any]:
    """One page out of the file's own pages, the channels of which may be pages of their own."""
    own = [(n, name) for n, name in zip(shape, axes, strict=True) if name not in "YXS"]
    index = np.arange(int(np.prod([n for n, _ in own]))).reshape([n for n, _ in own])
    names = "".join(name for _, name in own)
    if "C" in names:
        index = np.moveaxis(index, names.index("C"), -1)
    wanted = index.reshape(-1, index.shape[-1])[page] if "C" in names else index.reshape(-1)[[page]]
    planes = [np.asarray(series.pages[int(k)].asarray()) for k in wanted]
    return planes[0] if len(planes) == 1 else np.stack(planes, axis=-1)


def _plane(whole: NDArray[Any], axes: str, page: int) -> NDArray[Any]:
    """A page of a stack, with its channels last."""
    outer = [k for k, name in enumerate(axes) if name not in "YXSC"]
    inner = [axes.index("Y"), axes.index("X")]
    channels = [k for k, name in enumerate(axes) if name in "SC"]
    whole = np.transpose(whole, outer + inner + channels)
    for _ in outer[1:]:  # by hand: a reshape of a memory map may copy all of it
        count = int(np.prod(whole.shape[1 : len(outer)]))
        whole, page = whole[page // count], page % count
        outer = outer[1:]
    if outer:
        whole = whole[page]
    if whole.ndim == 4:
        whole = whole.reshape(*whole.shape[:2], -1)
    return whole[..., 0] if whole.ndim == 3 and whole.shape[2] == 1 else whole


def _pixel_mm(file: Any, first: Any) -> tuple[float, float] | None:
    """Sides of a pixel in mm, by OME, else ImageJ, else the resolution tags."""
    if file.is_ome and (found := _ome(file.ome_metadata)):
        return found
    tags = first.tags
    per_unit = [_ratio(tags[name].value) if name in tags else 0.0 for name in ("XResolution", "YResolution")]
    if min(per_unit) <= 0:
        return None
    if file.is_imagej:
        unit = str((file.imagej_metadata or {}).get("unit", "")).replace("\\u00B5", "µ").strip().lower()
        return (MM[unit] / per_unit[0], MM[unit] / per_unit[1]) if unit in MM else None
    unit_tag = int(tags["ResolutionUnit"].value) if "ResolutionUnit" in tags else 2
    if unit_tag == 2:
        return pixel_of(per_unit)
    if unit_tag == 3 and not any(round(value * 2.54) in SCREEN_DPI for value in per_unit):
        return 10 / per_unit[0], 10 / per_unit[1]
    return None


def _ratio(value: Any) -> float:
    over, under = value if isinstance(value, tuple) else (value, 1)
    return float(over) / float(under) if under else 0.0


def _ome(text: str) -> tuple[float, float] | None:
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError:
        return None
    for element in root.iter():
        if element.tag.rpartition("}")[2] == "Pixels":
            sides = []
            for axis in "XY":
                unit = element.get(f"PhysicalSize{axis}Unit", "µm")
                size = element.get(f"PhysicalSize{axis}")
                if size is None or unit not in MM:
                    return None
                sides.append(float(size) * MM[unit])
            return (sides[0], sides[1]) if min(sides) > 0 else None
    return None
