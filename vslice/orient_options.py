"""Options of what is measured in tissue, for ``orient`` and for ``slice`` of an image."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice.options import Decorator, Number, given

if TYPE_CHECKING:
    from tissue.settings import ImageSettings, Layout, VolumeSettings

IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
VOLUME_ENDINGS = (".nii", ".nii.gz")

length_mm = Number(0.01, 10_000)
angle = Number(-360, 360)
file_path = click.Path(path_type=Path)


if TYPE_CHECKING:
    _Type = click.ParamType[Any]
else:  # earlier ones of click take no type
    _Type = click.ParamType


class Tiles(_Type):
    """COLSxROWS, or columns alone."""

    name = "COLS[xROWS]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d{1,5})(?:[xX](\d{1,5}))?", str(value).strip())
        if match is None or int(match[1]) == 0 or (match[2] is not None and int(match[2]) == 0):
            self.fail(f"{value!r} is no number of tiles, such as 16 or 16x12.", param, ctx)
        return int(match[1]), None if match[2] is None else int(match[2])


class Numbers(_Type):
    """Whole numbers with commas between them."""

    def __init__(self, name: str, count: int | None, low: int, high: int) -> None:
        self.name, self.count, self.low, self.high = name, count, low, high

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        words = str(value).split(",")
        wanted = f"{self.count} " if self.count else ""
        if not all(re.fullmatch(r"\s*\d{1,9}\s*", word) for word in words) or self.count not in (
            None,
            len(words),
        ):
            self.fail(f"{value!r} must be {wanted}whole numbers with commas between them.", param, ctx)
        numbers = tuple(map(int, words))
        if min(numbers) < self.low or max(numbers) > self.high:
            self.fail(f"{value!r}: each must be from {self.low} to {self.high}.", param, ctx)
        return numbers


class Turn(_Type):
    """Degrees, or the word best."""

    name = "DEG|best"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return "best" if value == "best" else angle.convert(value, param, ctx)


_LAYOUT = (
    click.option("--tiles", type=Tiles(), help="How many tiles; rows follow the shape. By default 16."),
    click.option("--tile-mm", type=length_mm, metavar="MM", help="Side of a tile instead of --tiles."),
    click.option(
        "--size-mm",
        type=length_mm,
        metavar="MM",
        help="Width of the sheet. By default the tissue's own size.",
    ),
    click.option(
        "--pixel-um",
        type=Number(1e-4, 1e7),
        metavar="UM",
        help="Side of a pixel, where the file does not say it.",
    ),
    click.option(
        "--spacing-mm",
        type=length_mm,
        metavar="MM",
        help="Distance between toolpaths. By default 0.4, or the width of a line of the profile.",
    ),
    click.option("--rotate", type=Turn(), help="Turn the tissue counter-clockwise; best gives flat fibres."),
    click.option(
        "--flip",
        type=click.Choice(["x", "y"]),
        help="Before that, exchange left and right (x), or top and bottom (y).",
    ),
    click.option(
        "--max-tilt",
        type=Number(0, 90),
        metavar="DEG",
        help="Turn the tissue so that as few fibres as possible are steeper.",
    ),
    click.option(
        "--min-coherence",
        type=Number(0, 1),
        metavar="C",
        help="Tiles of less are empty: 0 for no direction to 1 for one alone.",
    ),
    click.option(
        "--min-cover",
        type=Number(0, 1),
        metavar="SHARE",
        help="Tiles are empty of which less was measured. By default 0.5, and 0.05 with --outline.",
    ),
    click.option("--outline", is_flag=True, help="Clip the sheet to what was measured."),
)
_IMAGE = (
    click.option(
        "--channel",
        metavar="NAME|N",
        help="Of an image: red, green, blue, luminance, mean, or the number of a channel.",
    ),
    click.option(
        "--stain",
        type=click.Choice(["hematoxylin", "eosin", "dab"]),
        help="Of an image: a stain, by colour deconvolution.",
    ),
    click.option(
        "--page", type=click.IntRange(0, 1_000_000), metavar="N", help="Of an image with several, from 0."
    ),
    click.option(
        "--crop",
        type=Numbers("X0,Y0,X1,Y1", 4, 0, 10**9),
        help="Of an image: left, top, right, bottom in pixels.",
    ),
    click.option("--sigma", type=Number(0.3, 100), metavar="PX", help="Scale of the image's gradient."),
    click.option(
        "--rho", type=Number(0, 10_000), metavar="PX", help="Scale over which directions are averaged."
    ),
    click.option("--auto-mask", is_flag=True, help="Of an image: leave out what has no structure."),
    click.option(
        "--mask", type=file_path, metavar="FILE", help="What counts: an image of the same size, or GeoJSON."
    ),
)
_VOLUME = (
    click.option(
        "--plane",
        type=click.Choice(["axial", "coronal", "sagittal"]),
        help="Of a volume: which plane. By default axial.",
    ),
    click.option(
        "--slice", "slice_index", type=click.IntRange(0, 1_000_000), metavar="K", help="Of a volume: from 0."
    ),
    click.option("--fa", type=file_path, metavar="FILE", help="Fractional anisotropy beside V1."),
    click.option("--min-fa", type=Number(0, 1), metavar="FA", help="Voxels of less do not count."),
    click.option("--bval", type=file_path, metavar="FILE", help="Of diffusion-weighted data, to be fitted."),
    click.option("--bvec", type=file_path, metavar="FILE", help="Of diffusion-weighted data, to be fitted."),
    click.option(
        "--vectors",
        type=click.Choice(["fsl", "voxel", "scanner"]),
        help="Axes of the directions in V1 and bvec. By default fsl.",
    ),
)
_TABLE = (
    click.option("--unit", type=click.Choice(["degrees", "radians"]), help="Of a table of angles."),
    click.option(
        "--rows-from",
        type=click.Choice(["top", "bottom"]),
        help="Where a table begins. By default at the top.",
    ),
)
_SIZES = ("tiles", "tile_mm", "size_mm", "pixel_um", "spacing_mm")
LAYOUT = (*_SIZES, "rotate", "flip", "max_tilt", "min_coherence", "min_cover", "outline")
IMAGE = ("channel", "stain", "page", "crop", "sigma", "rho", "auto_mask")
VOLUME = ("plane", "slice_index", "fa", "min_fa", "bval", "bvec", "vectors")
TABLE = ("unit", "rows_from")
ALL = (*LAYOUT, *IMAGE, "mask", *VOLUME, *TABLE)


def measuring_options(*, shown: tuple[str, ...] | None = None) -> Decorator:
    """All options of what is measured.

    Args:
        shown: those that the help tells of; None for all.
    """

    def declare(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed((*_LAYOUT, *_IMAGE, *_VOLUME, *_TABLE)):
            command = option(command)
        if shown is not None:
            for parameter in command.__click_params__:  # type: ignore[attr-defined]
                if parameter.name in ALL and parameter.name not in shown:
                    parameter.hidden = True
        return command

    return declare


def measured_kind(file: Path) -> str | None:
    """Whether a file is an image or a volume, by its name or its first bytes; None for neither."""
    name = file.name.lower()
    if name.endswith(VOLUME_ENDINGS):
        return "volume"
    if file.is_file():
        from tissue.picture import kind_of

        if kind_of(file) is not None:
            return "image"
    # What is called an image and is none is refused as one.
    return "image" if name.endswith(IMAGE_ENDINGS) else None


def means_angles(file: Path) -> bool:
    """Whether a table is one of angles, not of toolpaths of one's own: .npy, or with an option for angles."""
    name = file.name.lower()
    return name.endswith(".npy") or (
        name.endswith(".csv") and any(map(given, ("tile_mm", "size_mm", "unit")))
    )


def layout_of(asked: Mapping[str, Any], spacing_mm: float) -> "Layout":
    """The layout that was asked for; ``spacing_mm`` where none was.

    Raises:
        UsageError: two options contradict each other.
    """
    from tissue.settings import Layout

    for one, other, why in (
        ("tiles", "tile_mm", "one says how many tiles, the other how large"),
        ("rotate", "max_tilt", "each says by how much to turn"),
    ):
        if asked[one] is not None and asked[other] is not None:
            raise click.UsageError(
                f"--{one.replace('_', '-')} and --{other.replace('_', '-')}: {why}; give one."
            )
    return Layout(
        tiles=asked["tiles"],
        tile_mm=asked["tile_mm"],
        size_mm=asked["size_mm"],
        pixel_mm=None if asked["pixel_um"] is None else asked["pixel_um"] / 1000,
        spacing_mm=spacing_mm if asked["spacing_mm"] is None else asked["spacing_mm"],
        min_coherence=asked["min_coherence"] or 0.0,
        min_cover=asked["min_cover"],
        outline=asked["outline"],
        turn=asked["rotate"],
        flip=asked["flip"],
        max_tilt_deg=asked["max_tilt"],
    )


def image_of(asked: Mapping[str, Any]) -> "ImageSettings":
    """How an image is to be measured."""
    from tissue.settings import ImageSettings

    if asked["channel"] is not None and asked["stain"] is not None:
        raise click.UsageError("--channel and --stain: each says what of the colours is looked at; give one.")
    if asked["mask"] is not None and asked["auto_mask"]:
        raise click.UsageError("--mask and --auto-mask: each says what counts; give one.")
    return ImageSettings(
        channel=asked["channel"],
        stain=asked["stain"],
        page=asked["page"],
        crop_px=asked["crop"],
        sigma_px=asked["sigma"],
        rho_px=asked["rho"],
        mask=asked["mask"],
        auto_mask=asked["auto_mask"],
    )


def volume_of(asked: Mapping[str, Any]) -> "VolumeSettings":
    """How a volume is to be measured."""
    from tissue.settings import VolumeSettings

    if (asked["bval"] is None) != (asked["bvec"] is None):
        raise click.UsageError("--bval and --bvec go together; give both.")
    if asked["bval"] is not None and asked["fa"] is not None:
        raise click.UsageError("--fa stands beside V1; of data that is fitted (--bval) it is found here.")
    return VolumeSettings(
        plane=asked["plane"] or "axial",
        slice_index=asked["slice_index"],
        fa=asked["fa"],
        min_fa=asked["min_fa"] or 0.0,
        bval=asked["bval"],
        bvec=asked["bvec"],
        vectors=asked["vectors"] or "fsl",
        mask=asked["mask"],
    )
