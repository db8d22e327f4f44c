"""What a user can ask of a measurement, whatever the input."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Layout:
    """How a sheet is laid out.

    Attributes:
        tiles: columns and rows; rows None for tiles that are about square. None for ``tile_mm``.
        tile_mm: side of a tile, about.
        size_mm: width of the sheet; None for the tissue's own size.
        pixel_mm: side of a pixel where the file does not say it, or says it wrong.
        spacing_mm: distance between toolpaths.
        min_coherence: tiles below it are empty.
        min_cover: tiles of which less was measured are empty; None for a half, or 0.05 with ``outline``.
        outline: whether the sheet is clipped to what was measured.
        turn: degrees counter-clockwise, "best" for the flattest fibres, None for none.
        flip: "x" for left and right exchanged, "y" for top and bottom; before the turn.
        max_tilt_deg: turn so that the least of the fibres is steeper.
    """

    tiles: tuple[int, int | None] | None = None
    tile_mm: float | None = None
    size_mm: float | None = None
    pixel_mm: float | None = None
    spacing_mm: float = 0.4
    min_coherence: float = 0.0
    min_cover: float | None = None
    outline: bool = False
    turn: float | str | None = None
    flip: str | None = None
    max_tilt_deg: float | None = None


@dataclass(frozen=True)
class ImageSettings:
    """How an image is measured.

    Attributes:
        channel: red, green, blue, luminance, or the number of a channel.
        stain: hematoxylin, eosin or dab instead.
        page: of a file with several, from 0.
        crop_px: left, top, right, bottom in pixels, right and bottom excluded.
        sigma_px, rho_px: scales of the structure tensor; None for a default from the tile.
        mask: an image or polygons.
        auto_mask: find the tissue.
    """

    channel: str | None = None
    stain: str | None = None
    page: int | None = None
    crop_px: tuple[int, int, int, int] | None = None
    sigma_px: float | None = None
    rho_px: float | None = None
    mask: Path | None = None
    auto_mask: bool = False


@dataclass(frozen=True)
class VolumeSettings:
    """How a plane is taken out of a diffusion volume.

    Attributes:
        plane: axial, coronal or sagittal, in the scanner's coordinates.
        slice_index: which slice of the volume, from 0; None for the middle one.
        fa: fractional anisotropy beside principal directions.
        min_fa: voxels below it do not count.
        bval, bvec: of raw diffusion-weighted data.
        vectors: the axes in which directions are written: "fsl", "voxel" or "scanner".
        mask: volume whose voxels above 0 count.
    """

    plane: str = "axial"
    slice_index: int | None = None
    fa: Path | None = None
    min_fa: float = 0.0
    bval: Path | None = None
    bvec: Path | None = None
    vectors: str = "fsl"
    mask: Path | None = None
