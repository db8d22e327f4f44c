"""The structure tensor of an image, in strips: the direction in which it changes least is that of its fibres.

For each pixel the products of the image's gradient (Gaussian derivatives of the scale sigma) are summed over
cells, and smoothed with the integration scale rho. Sums are linear, so a cell of a few pixels loses nothing,
and an image of any size is read once, strip by strip.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from tissue.colour import Grey
from tissue.errors import TissueError
from tissue.field import Field
from tissue.libraries import library

STRIP_PIXELS = 4_000_000
THREADS = 2
BORDER = 2.0
"""Gradients within this many sigma of the picture's border saw pixels that are made up, and do not count."""
TRUNCATE = 4.0
"""Gaussians end after this many standard deviations."""

Progress = Callable[[float], None]


def structure_field(
    pixels: NDArray[np.generic],
    grey: Grey,
    *,
    sigma_px: float,
    rho_px: float,
    cell_px: int,
    keep: NDArray[np.bool_] | None = None,
    progress: Progress | None = None,
) -> Field:
    """Fibre directions of an image, in pixels, y up from its lower left corner.

    Args:
        pixels: (height, width) or (height, width, channels), row 0 at the top.
        grey: makes float32 of rows of pixels.
        sigma_px, rho_px: scales of the gradient and of the integration.
        cell_px: side of a cell.
        keep: bool (height, width), the pixels that count; None for all. NaN and infinite pixels never do.
        progress: told the share that is done.

    Raises:
        TissueError: no pixel counts.
    """
    height, width = pixels.shape[:2]
    sums = np.zeros((4, -(-height // cell_px), -(-width // cell_px)))
    strips = _strips(height, width, cell_px)
    halo = int(np.ceil(TRUNCATE * sigma_px)) + 1

    def strip(top: int, bottom: int) -> NDArray[np.float64]:
        low, high = max(0, top - halo), min(height, bottom + halo)
        block, finite = _finite(grey(pixels[low:high]), sigma_px)
        products = library("structure_tensor").structure_tensor_2d(block, sigma_px, 0.0)
        inner = slice(top - low, bottom - low)
        weight = np.ones((bottom - top, width), np.float32) if finite is None else finite[inner].copy()
        if keep is not None:
            weight *= keep[top:bottom]
        _without_border(weight, top, height, round(BORDER * sigma_px))
        return _binned(products[:, inner] * weight, weight, cell_px)

    library("structure_tensor")  # rather here than in a thread
    with ThreadPoolExecutor(THREADS) as pool:
        for done, (top, binned) in enumerate(_in_order(pool, strip, strips), 1):
            at = top // cell_px
            sums[:, at : at + binned.shape[1]] = binned
            if progress is not None:
                progress(done / len(strips))
    counted = sums[3] > 0
    if not counted.any():
        raise TissueError("no pixel counts: the mask is empty, or all are NaN.")
    weight = np.minimum(sums[3] / cell_px**2, 1.0)
    _smooth(sums, rho_px, cell_px)
    mean = np.divide(sums[:3], sums[3], out=np.zeros_like(sums[:3]), where=counted)
    # The library's first axis are the rows, downwards: its gradient (gr, gc) is (gc, -gr) with y up, and
    # fibres lie across it, along (gr, gc). So its tensor is that of the fibres as it stands.
    return Field(
        mean,
        weight,
        np.array([cell_px / 2, height - cell_px / 2]),
        np.array([float(cell_px), 0.0]),
        np.array([0.0, -float(cell_px)]),
        size=(height / cell_px, width / cell_px),
    )


def _strips(height: int, width: int, cell_px: int) -> list[tuple[int, int]]:
    """First and last row of each strip, at borders of cells."""
    tall = max(1, STRIP_PIXELS // width // cell_px) * cell_px
    return [(top, min(top + tall, height)) for top in range(0, height, tall)]


def _in_order(
    pool: ThreadPoolExecutor,
    strip: Callable[[int, int], NDArray[np.float64]],
    strips: list[tuple[int, int]],
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """The result of each strip, with no more of them under way than there are threads: they take memory."""
    waiting: list[tuple[int, Future[NDArray[np.float64]]]] = []
    for top, bottom in strips:
        if len(waiting) == THREADS:
            at, future = waiting.pop(0)
            yield at, future.result()
        waiting.append((top, pool.submit(strip, top, bottom)))
    for at, future in waiting:
        yield at, future.result()


def _without_border(weight: NDArray[np.float32], top: int, height: int, border: int) -> None:
    """Weigh pixels at the picture's border with 0, unless that would be much of a small picture."""
    if 16 * border > min(height, weight.shape[1]) or border == 0:
        return
    weight[:, :border] = weight[:, -border:] = 0
    weight[: max(0, border - top)] = 0
    weight[max(0, height - border - top) :] = 0


def _finite(
    block: NDArray[np.float32], sigma_px: float
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    """A block without NaN, and 1 for pixels whose gradient saw none, 0 for others; None if there are none."""
    finite = np.isfinite(block)
    if finite.all():
        return block, None
    filled = np.where(finite, block, block[finite].mean() if finite.any() else np.float32(0))
    size = 2 * int(np.ceil(3 * sigma_px)) + 1
    clear = library("scipy.ndimage").minimum_filter(finite.astype(np.uint8), size=size, mode="nearest")
    return filled.astype(np.float32), clear.astype(np.float32)


def _binned(products: NDArray[np.float32], weight: NDArray[np.float32], cell_px: int) -> NDArray[np.float64]:
    """Sums (4, rows, cols) of three products and the weight over cells; the last ones may be narrower."""
    height, width = weight.shape
    down, across = np.arange(0, height, cell_px), np.arange(0, width, cell_px)
    found = np.empty((4, len(down), len(across)))
    for k, values in enumerate((*products, weight)):
        if cell_px == 1:
            found[k] = values
        else:
            found[k] = np.add.reduceat(
                np.add.reduceat(values, across, axis=1), down, axis=0, dtype=np.float64
            )
    return found


def _smooth(sums: NDArray[np.float64], rho_px: float, cell_px: int) -> None:
    """Smooth with rho, of which the cells have done a part: a box of width b has the variance b² / 12."""
    rest = np.sqrt(max(rho_px**2 - cell_px**2 / 12, 0.0)) / cell_px
    if rest > 0.1:
        gaussian = library("scipy.ndimage").gaussian_filter
        for k in range(len(sums)):
            gaussian(sums[k], rest, output=sums[k], mode="nearest", truncate=TRUNCATE)
