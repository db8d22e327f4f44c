"""One number a pixel: a channel, the luminance, or how much of a stain there is."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tissue.errors import TissueError
from tissue.picture import Picture

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""ITU-R BT.709."""
MEAN = (1 / 3, 1 / 3, 1 / 3)
COLOURS = ("red", "green", "blue")
STAINS = ("hematoxylin", "eosin", "dab")
OPTICAL_DENSITY = {
    "hematoxylin": (0.65, 0.70, 0.29),
    "eosin": (0.07, 0.99, 0.11),
    "dab": (0.27, 0.57, 0.78),
}
"""Of red, green and blue light: A. C. Ruifrok, D. A. Johnston, Quantification of histochemical staining by
color deconvolution, Anal. Quant. Cytol. Histol. 23 (2001) 291-299."""

Grey = Callable[[NDArray[np.generic]], NDArray[np.float32]]


def grey_of(picture: Picture, channel: str | None, stain: str | None) -> tuple[Grey, str]:
    """What turns rows of pixels into float32 (rows, width), and its name for the record.

    Args:
        channel: red, green, blue, luminance, mean or the number of a channel from 0; None for luminance,
            or for the first channel of what has no colours.
        stain: one of ``STAINS``.

    Raises:
        TissueError: the picture has no such channel.
    """
    colours = picture.rgb
    count = picture.pixels.shape[2] if picture.pixels.ndim == 3 else 1
    if stain is not None:
        if not colours:
            raise TissueError(
                f"{picture.source}: stains are told apart by colour, but it has {_channels(count)} and no "
                "red, green and blue; leave out --stain."
            )
        return _stain(stain, picture.white), f"stain {stain}"
    if channel is None:
        channel = "luminance" if colours else "0"
    if channel in ("luminance", "mean") and colours:
        return _weighted(LUMINANCE if channel == "luminance" else MEAN, picture.white), channel
    if channel in ("luminance", "mean") and count == 1:
        channel = "0"
    if channel in COLOURS and colours:
        return _picked(COLOURS.index(channel), picture.white), channel
    if channel in (*COLOURS, "luminance", "mean"):
        raise TissueError(
            f"{picture.source}: --channel {channel} needs red, green and blue, but it has {_channels(count)}"
            f"; give the number of one, 0 to {count - 1}."
        )
    if not channel.isdecimal() or int(channel) >= count:
        raise TissueError(
            f"{picture.source}: there is no channel {channel}; it has {_channels(count)}, counted from 0."
        )
    return _picked(int(channel), picture.white), f"channel {channel}"


def _channels(count: int) -> str:
    return f"{count} channels" if count > 1 else "1 channel"


def _picked(channel: int, white: float) -> Grey:
    def grey(rows: NDArray[np.generic]) -> NDArray[np.float32]:
        one = rows if rows.ndim == 2 else rows[..., channel]
        return one.astype(np.float32) / np.float32(white)

    return grey


def _weighted(weights: tuple[float, ...], white: float) -> Grey:
    factors = np.array(weights, np.float32) / np.float32(white)

    def grey(rows: NDArray[np.generic]) -> NDArray[np.float32]:
        return np.asarray(rows.astype(np.float32) @ factors, np.float32)

    return grey


def _stain(stain: str, white: float) -> Grey:
    """The share of a stain in the optical density, by the inverse of the three stains' densities."""
    densities = np.array([OPTICAL_DENSITY[name] for name in STAINS])
    unmix = np.linalg.inv(densities / np.linalg.norm(densities, axis=1, keepdims=True))
    factors = unmix[:, STAINS.index(stain)].astype(np.float32)

    def grey(rows: NDArray[np.generic]) -> NDArray[np.float32]:
        light = np.maximum(rows.astype(np.float32) / np.float32(white), np.float32(1e-3))
        return np.asarray(-np.log10(light) @ factors, np.float32)

    return grey
