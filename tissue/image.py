"""An image is measured: read, cropped, masked, and its structure tensor taken."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tissue import mask as masks
from tissue.colour import Grey, grey_of
from tissue.errors import TissueError
from tissue.field import Field
from tissue.layout import DEFAULT_COLS
from tissue.libraries import versions
from tissue.measurement import Measurement, Progress
from tissue.picture import Picture, read
from tissue.settings import ImageSettings, Layout
from tissue.structure import structure_field

SIGMA_A_TILE, RHO_A_TILE = 1 / 40, 1 / 10
"""Default scales as parts of a tile's side."""
LEAST_SIGMA_PX, MOST_SIGMA_PX = 1.0, 3.0
CELLS_A_TILE = 8
BACKDROP_PX = 1200
LIBRARIES = ("numpy", "scipy", "structure_tensor", "PIL", "tifffile")


def measure_image(
    path: Path, settings: ImageSettings, layout: Layout, progress: Progress | None = None
) -> Measurement:
    """Measure the fibre directions in an image.

    Args:
        layout: the default scales follow its tiles.

    Raises:
        TissueError: the image cannot be read, or has not what is asked for.
    """
    picture = read(path, page=settings.page)
    left, top, right, bottom = _crop(picture, settings.crop_px)
    pixels = picture.pixels[top:bottom, left:right]
    height, width = bottom - top, right - left
    grey, name = grey_of(picture, settings.channel, settings.stain)
    said = list(picture.said)
    keep = picture.opaque
    if settings.mask is not None:
        drawn = masks.read_mask(settings.mask, picture.width, picture.height)
        keep = drawn if keep is None else keep & drawn
    if keep is not None:
        keep = keep[top:bottom, left:right]
    pixel, aspect = _pixel(picture, layout, said)
    sigma, rho, tile = _scales(width, height * aspect, settings, layout, pixel)
    cell = max(1, min(math.floor(rho / 2), math.floor(tile / CELLS_A_TILE)))
    try:
        field = structure_field(
            pixels, grey, sigma_px=sigma, rho_px=rho, cell_px=cell, keep=keep, progress=progress
        )
    except TissueError as error:
        raise TissueError(f"{path}: {error}") from None
    field = _square(field, aspect)
    if not (np.isfinite(field.tensor).all() and field.tensor[:2].max() > 0):
        raise TissueError(
            f"{path}: has no structure: {name} is the same everywhere; try another --channel, --page, --crop."
        )
    if settings.auto_mask:
        found = masks.found_mask(field)
        share = found.mean()
        said.append(f"{path}: --auto-mask keeps {share:.0%} of the picture")
        field = Field(field.tensor, field.weight * found, field.origin, field.right, field.down)
    facts = _facts(picture, name, sigma, rho, cell, pixel)
    if settings.crop_px is not None:
        facts["source"]["crop_px"] = {"x0": left, "y0": top, "x1": right, "y1": bottom}
    if settings.mask is not None:
        facts["method"]["mask"] = settings.mask.name
    if settings.auto_mask:
        facts["method"]["mask"] = "found: Otsu's threshold of the logarithm of the tensor's trace"
    backdrop, step = _backdrop(pixels, grey)
    return Measurement(
        field,
        pixel,
        backdrop,
        (step / cell, step / cell),
        str(path),
        facts,
        tuple(said),
        settings.auto_mask or keep is not None,
    )


def _crop(picture: Picture, crop: tuple[int, int, int, int] | None) -> tuple[int, int, int, int]:
    if crop is None:
        return 0, 0, picture.width, picture.height
    left, top, right, bottom = crop
    if not (0 <= left < right <= picture.width and 0 <= top < bottom <= picture.height):
        raise TissueError(
            f"{picture.source}: --crop {left},{top},{right},{bottom} leaves the picture of {picture.width}x"
            f"{picture.height} pixels; give left, top, right, bottom with left < right and top < bottom."
        )
    if min(right - left, bottom - top) < 3:
        raise TissueError(
            f"{picture.source}: --crop leaves {right - left}x{bottom - top} pixels; 3x3 is least."
        )
    return left, top, right, bottom


def _pixel(picture: Picture, layout: Layout, said: list[str]) -> tuple[float | None, float]:
    """Width of a pixel in mm, and its height in widths."""
    if layout.pixel_mm is not None:
        return layout.pixel_mm, 1.0
    if picture.pixel_mm is None:
        return None, 1.0
    x, y = picture.pixel_mm
    if abs(y / x - 1) < 1e-3:
        return x, 1.0
    said.append(
        f"{picture.source}: its pixels are {x * 1000:.4g} x {y * 1000:.4g} µm, "
        "which are not square, as was taken into account"
    )
    return x, y / x


def _scales(
    width: float, height: float, settings: ImageSettings, layout: Layout, pixel_mm: float | None
) -> tuple[float, float, float]:
    """Sigma, rho and the side of a tile, in pixels."""
    if layout.tile_mm is not None and (layout.size_mm is not None or pixel_mm is not None):
        scale = layout.size_mm / width if layout.size_mm is not None else pixel_mm
        tile = layout.tile_mm / (scale or 1.0)
    else:
        cols, rows = layout.tiles or (DEFAULT_COLS, None)
        tile = min(width / cols, height / rows if rows else math.inf)
    sigma = settings.sigma_px
    if sigma is None:
        sigma = round(min(max(tile * SIGMA_A_TILE, LEAST_SIGMA_PX), MOST_SIGMA_PX), 2)
    rho = settings.rho_px
    if rho is None:
        rho = round(max(tile * RHO_A_TILE, 1.0), 2)
    return sigma, rho, tile


def _square(field: Field, aspect: float) -> Field:
    """A field whose pixels are ``aspect`` times as high as wide, in widths of pixels.

    A gradient along y is that much less steep, so the fibres' tensor, which lies across it, shrinks along x.
    """
    if aspect == 1.0:
        return field
    shrink = np.array([aspect**-2, 1.0, 1 / aspect])[:, None, None]
    stretch = np.array([1.0, aspect])
    return Field(
        field.tensor * shrink,
        field.weight,
        field.origin * stretch,
        field.right * stretch,
        field.down * stretch,
    )


def _facts(
    picture: Picture, name: str, sigma: float, rho: float, cell: int, pixel_mm: float | None
) -> dict[str, Any]:
    um = {} if pixel_mm is None else {"pixel_um": round(pixel_mm * 1000, 6)}
    return {
        "source": {"file": Path(picture.source).name, "sha256": picture.sha256, **picture.facts, **um},
        "method": {
            "what": "2-D structure tensor of Gaussian derivatives, smoothed, averaged over each tile; "
            "fibre = gradient + 90 deg",
            "of": name,
            "sigma_px": sigma,
            "rho_px": rho,
            "cell_px": cell,
        },
        "versions": versions(LIBRARIES),
    }


def _backdrop(pixels: NDArray[Any], grey: Grey) -> tuple[NDArray[np.float32], int]:
    step = max(1, -(-max(pixels.shape[:2]) // BACKDROP_PX))
    return grey(np.asarray(pixels[::step, ::step])), step
