"""Images as they come from a microscope or a scanner: PNG, JPEG, BMP and TIFF, told by their first bytes."""

import hashlib
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tissue.errors import TissueError
from tissue.libraries import library

MAX_PIXELS = 400_000_000
"""Most pixels of an image that must be decoded as a whole; larger ones are taken for bombs."""
MAX_BYTES = 8_000_000_000
SCREEN_DPI = (0, 1, 72, 96)
"""Resolutions that programs write when they know none."""
MM_PER_INCH = 25.4
SIGNATURES = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"II+\0": "TIFF",
    b"MM\0+": "TIFF",
}


@dataclass(frozen=True, eq=False)
class Picture:
    """An image, row 0 at the top.

    Attributes:
        pixels: (height, width) or (height, width, channels), of any number type; may be a memory map.
        pixel_mm: width and height of a pixel, None if the file does not say.
        rgb: whether the channels are red, green and blue.
        opaque: bool (height, width), False where the image is transparent; None if it nowhere is.
        white: value of full brightness.
        source: the file, for messages.
        sha256: hash of its bytes.
        facts: what belongs into a method section: format, page, size.
        said: what was assumed, a line each.
    """

    pixels: NDArray[Any]
    pixel_mm: tuple[float, float] | None
    rgb: bool
    opaque: NDArray[np.bool_] | None
    white: float
    source: str
    sha256: str
    facts: dict[str, Any] = field(default_factory=dict)
    said: tuple[str, ...] = ()

    @property
    def height(self) -> int:
        """Rows of pixels."""
        return int(self.pixels.shape[0])

    @property
    def width(self) -> int:
        """Columns of pixels."""
        return int(self.pixels.shape[1])


def kind_of(path: Path) -> str | None:
    """The format of an image by its first bytes; None if it is none of ours, or cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(16)
    except OSError:
        return None
    return next((kind for start, kind in SIGNATURES.items() if head.startswith(start)), None)


def read(path: Path, *, page: int | None = None) -> Picture:
    """Read an image.

    Args:
        page: which one of several, from 0; None for the first one.

    Raises:
        TissueError: it cannot be read, is broken, of a format that is not known, or too large.
    """
    checked_file(path)
    kind = kind_of(path)
    if kind is None:
        raise TissueError(f"{path}: is no PNG, JPEG, BMP or TIFF by its first bytes.")
    if kind == "TIFF":
        from tissue import tiff

        made = tiff.read(path, page)
    else:
        if page:
            raise TissueError(f"{path}: page {page} is asked for, but a {kind} has page 0 alone.")
        made = _pillow(path, kind)
    height, width = made.pixels.shape[:2]
    if min(height, width) < 3:
        raise TissueError(f"{path}: has {width}x{height} pixels; directions need at least 3x3.")
    if made.pixels.dtype.kind not in "uif" and made.pixels.dtype != np.bool_:
        raise TissueError(f"{path}: has pixels of type {made.pixels.dtype}; integers and floats are read.")
    return made


def checked_file(path: Path) -> None:
    """Refuse what is no file that can be read.

    Raises:
        TissueError: it is missing, a folder, empty, or must not be read.
    """
    try:
        if path.is_dir():
            raise TissueError(f"{path}: is a folder; name a file in it.")
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except FileNotFoundError:
        raise TissueError(f"{path}: there is no such file.") from None
    except OSError as error:
        raise TissueError(f"{path}: cannot be read: {error.strerror}.") from None
    if size == 0:
        raise TissueError(f"{path}: is empty.")
    if size > MAX_BYTES:
        raise TissueError(f"{path}: has {size / 1e9:.1f} GB; {MAX_BYTES / 1e9:.0f} GB is the most.")


def hash_of(path: Path) -> str:
    """SHA-256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def refuse_bomb(path: Path, width: int, height: int) -> None:
    """Refuse an image that is too large to decode.

    Raises:
        TissueError: it has more than ``MAX_PIXELS``.
    """
    if width * height > MAX_PIXELS:
        raise TissueError(
            f"{path}: says that it has {width}x{height} pixels, {width * height / 1e6:.0f} million; "
            f"{MAX_PIXELS / 1e6:.0f} million is the most that is decoded at once. Crop or shrink it, or save "
            "it as an uncompressed TIFF, which is read in strips."
        )


def opened_by_pillow(path: Path, use: Callable[[Any], Any]) -> Any:
    """What ``use`` makes of an image that Pillow opened, with its errors in our words."""
    images = library("PIL.Image")
    most, images.MAX_IMAGE_PIXELS = images.MAX_IMAGE_PIXELS, None  # the size is checked here, with our limit
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with images.open(path) as image:
                refuse_bomb(path, *image.size)
                return use(image)
    except TissueError:
        raise
    except MemoryError:
        raise TissueError(f"{path}: does not fit into memory.") from None
    # Broken files make its readers stumble in every way.
    except Exception as error:  # noqa: BLE001
        raise TissueError(f"{path}: is broken or cut off: {error}.") from None
    finally:
        images.MAX_IMAGE_PIXELS = most


def split_alpha(pixels: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
    """Colours without the last channel, and where that is above 0; None if it is so everywhere."""
    opaque = pixels[..., -1] > 0
    colours = pixels[..., :-1]
    return (colours[..., 0] if colours.shape[-1] == 1 else colours), (None if opaque.all() else opaque)


def white_of(pixels: NDArray[Any]) -> float:
    """Full brightness: of integers the largest that their type holds, of floats the largest there is."""
    if pixels.dtype.kind not in "uif":
        return 1.0
    if pixels.dtype.kind in "ui":
        return float(np.iinfo(pixels.dtype).max)
    most = 0.0
    for strip in np.array_split(pixels, max(1, pixels.shape[0] // 1024)):
        finite = strip[np.isfinite(strip)]
        most = max(most, float(finite.max(initial=0.0)))
    return most if most > 0 else 1.0


def _pillow(path: Path, kind: str) -> Picture:
    made: Picture = opened_by_pillow(path, lambda image: _decoded(image, path, kind))
    return made


def _decoded(image: Any, path: Path, kind: str) -> Picture:
    said = []
    mode, dpi = str(image.mode), image.info.get("dpi")
    turned = library("PIL.ImageOps").exif_transpose(image)
    if turned.size != image.size or image.getexif().get(0x0112, 1) != 1:
        said.append(f"{path}: was turned as its EXIF orientation says")
    image = turned
    if mode == "P":
        said.append(f"{path}: its palette was taken as colours")
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
    elif mode in ("CMYK", "YCbCr", "LAB", "HSV"):
        said.append(f"{path}: was converted from {mode} to RGB")
        image = image.convert("RGB")
    elif mode == "PA":
        image = image.convert("RGBA")
    elif mode == "1":
        image = image.convert("L")
    pixels, opaque = np.asarray(image), None
    if image.mode in ("LA", "RGBA"):
        pixels, opaque = split_alpha(pixels)
        if opaque is not None:
            said.append(f"{path}: {1 - opaque.mean():.1%} of it are transparent and were left out")
    white = 65535.0 if image.mode == "I" and kind == "PNG" else white_of(pixels)
    facts = {"format": kind, "mode": mode, "size_px": [image.width, image.height]}
    return Picture(
        pixels, pixel_of(dpi), pixels.ndim == 3, opaque, white, str(path), hash_of(path), facts, tuple(said)
    )


def pixel_of(dpi: Sequence[float] | None) -> tuple[float, float] | None:
    """Sides of a pixel in mm by dots an inch, None if that is what programs write when they know none."""
    if dpi is None:
        return None
    x, y = (float(value) for value in dpi[:2])
    if round(x) in SCREEN_DPI or round(y) in SCREEN_DPI or not (0 < x < 1e9 and 0 < y < 1e9):
        return None
    return MM_PER_INCH / x, MM_PER_INCH / y
