"""Images of every format, what they say of themselves, and broken ones."""

import struct
import zlib

import numpy as np
import pytest
from pictures import axial, grating, save_tiff
from PIL import Image

from tissue import picture
from tissue.colour import grey_of
from tissue.errors import TissueError
from tissue.image import measure_image
from tissue.orient import orient
from tissue.picture import read
from tissue.settings import ImageSettings, Layout

LAYOUT = Layout(tiles=(4, 3), size_mm=8, spacing_mm=0.2)
PICTURE = grating(30)
BYTES = np.round(PICTURE * 255).astype(np.uint8)


def tilts(path, layout=LAYOUT, **settings):
    return orient(measure_image(path, ImageSettings(**settings), layout), layout).sheet.angles_deg


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.tif"])
def test_each_format_is_told_by_its_first_bytes(tmp_path, name):
    Image.fromarray(BYTES).save(tmp_path / name)
    path = (tmp_path / name).rename(tmp_path / "picture.dat")
    found = read(path)
    assert (found.width, found.height) == (240, 180)
    assert axial(tilts(path), 30).max() < 0.5


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.int32, np.float32, np.float64, np.bool_])
def test_every_type_of_number(tmp_path, kind):
    scaled = (
        PICTURE > 0.5 if kind is np.bool_ else (PICTURE * (200 if kind == np.uint8 else 30000)).astype(kind)
    )
    path = save_tiff(tmp_path / "a.tif", scaled)
    assert axial(tilts(path), 30).max() < (1 if kind is np.bool_ else 0.5)


def test_values_of_any_size_are_no_problem(tmp_path):
    for factor in (1e-30, 1e30):
        path = save_tiff(tmp_path / "a.tif", (PICTURE * factor).astype(np.float32))
        assert axial(tilts(path), 30).max() < 0.5


def test_16_bit_png(tmp_path):
    Image.fromarray((PICTURE * 65535).astype(np.uint16)).save(tmp_path / "a.png")
    assert axial(tilts(tmp_path / "a.png"), 30).max() < 0.1


def test_channels_of_colours(tmp_path):
    colours = np.stack(
        [BYTES, np.round(grating(-50) * 255).astype(np.uint8), np.full_like(BYTES, 7)], axis=-1
    )
    Image.fromarray(colours).save(tmp_path / "a.png")
    assert axial(tilts(tmp_path / "a.png", channel="red"), 30).max() < 0.1
    assert axial(tilts(tmp_path / "a.png", channel="green"), -50).max() < 0.1
    assert axial(tilts(tmp_path / "a.png", channel="1"), -50).max() < 0.1
    assert axial(tilts(tmp_path / "a.png"), -50).max() < 4  # green is the most of luminance
    with pytest.raises(TissueError, match="no structure: blue is the same everywhere"):
        tilts(tmp_path / "a.png", channel="blue")
    for wrong, said in (
        ("3", "there is no channel 3; it has 3 channels"),
        ("cyan", "there is no channel cyan"),
    ):
        with pytest.raises(TissueError, match=said):
            tilts(tmp_path / "a.png", channel=wrong)
    grey = save_tiff(tmp_path / "a.tif", BYTES)
    with pytest.raises(TissueError, match="--channel red needs red, green and blue, but it has 1 channel"):
        tilts(grey, channel="red")
    with pytest.raises(TissueError, match="stains are told apart by colour"):
        tilts(grey, stain="dab")


def test_stains_are_those_of_scikit_image(tmp_path):
    skimage_color = pytest.importorskip("skimage.color")
    colours = np.random.default_rng(0).integers(20, 255, (30, 40, 3), dtype=np.uint8)
    Image.fromarray(colours).save(tmp_path / "a.png")
    found = read(tmp_path / "a.png")
    theirs = skimage_color.rgb2hed(colours)
    for k, stain in enumerate(("hematoxylin", "eosin", "dab")):
        ours = grey_of(found, None, stain)[0](found.pixels)
        # They count in another unit, and cut off what is negative.
        positive = theirs[..., k] > 1e-6
        ratio = ours[positive] / theirs[..., k][positive]
        assert ratio.std() < 1e-3 * ratio.mean()
        assert (ours[~positive] <= 1e-4).all()


def test_palettes_alpha_and_exif(tmp_path):
    Image.fromarray(BYTES).convert("P").save(tmp_path / "p.png")
    assert any("palette" in line for line in read(tmp_path / "p.png").said)
    assert axial(tilts(tmp_path / "p.png"), 30).max() < 1
    alpha = np.full(BYTES.shape, 255, np.uint8)
    alpha[:, 120:] = 0
    Image.fromarray(np.dstack([BYTES, BYTES, BYTES, alpha])).save(tmp_path / "a.png")
    found = tilts(tmp_path / "a.png")
    assert axial(found[:, :2], 30).max() < 0.5
    assert np.isnan(found[:, 2:]).all()
    assert any("50.0% of it are transparent" in line for line in read(tmp_path / "a.png").said)
    exif = Image.Exif()
    exif[0x0112] = 6  # to be shown after a quarter turn clockwise
    Image.fromarray(BYTES).save(tmp_path / "e.jpg", exif=exif, quality=95)
    assert (read(tmp_path / "e.jpg").width, read(tmp_path / "e.jpg").height) == (180, 240)
    assert axial(tilts(tmp_path / "e.jpg"), 30 - 90).max() < 0.5


def test_the_size_of_a_pixel(tmp_path):
    Image.fromarray(BYTES).save(tmp_path / "a.png", dpi=(2540, 2540))
    assert read(tmp_path / "a.png").pixel_mm == pytest.approx((0.01, 0.01), rel=1e-4)
    for dpi in (72, 96):
        Image.fromarray(BYTES).save(tmp_path / "a.png", dpi=(dpi, dpi))
        assert read(tmp_path / "a.png").pixel_mm is None
    save_tiff(tmp_path / "a.tif", BYTES, resolution=(5000, 5000), resolutionunit="CENTIMETER")
    assert read(tmp_path / "a.tif").pixel_mm == pytest.approx((0.002, 0.002))
    save_tiff(tmp_path / "a.tif", BYTES, imagej=True, resolution=(2.0, 2.0), metadata={"unit": "um"})
    assert read(tmp_path / "a.tif").pixel_mm == pytest.approx((0.0005, 0.0005))
    size = {
        "PhysicalSizeX": 0.65,
        "PhysicalSizeXUnit": "µm",
        "PhysicalSizeY": 0.65,
        "PhysicalSizeYUnit": "µm",
    }
    save_tiff(tmp_path / "a.ome.tif", BYTES, metadata={"axes": "YX", **size})
    assert read(tmp_path / "a.ome.tif").pixel_mm == pytest.approx((0.00065, 0.00065))
    assert read(save_tiff(tmp_path / "b.tif", BYTES)).pixel_mm is None


def test_pixels_that_are_not_square(tmp_path):
    # Every second row is left out: pixels are twice as high as wide.
    save_tiff(tmp_path / "a.tif", BYTES[::2], resolution=(1000, 500), resolutionunit="CENTIMETER")
    layout = Layout(tiles=(4, 3), spacing_mm=0.1)
    measured = measure_image(tmp_path / "a.tif", ImageSettings(), layout)
    found = orient(measured, layout).sheet
    assert axial(found.angles_deg, 30).max() < 1
    assert found.tile_mm == pytest.approx((0.6, 0.6))
    assert any("not square" in line for line in measured.said)


def test_pages_and_channels_of_a_stack(tmp_path):
    stack = np.stack([(grating(angle) * 255).astype(np.uint8) for angle in (10, 20, 30, 40, 50, 60)])
    for rest in ({}, {"compression": "zlib"}, {"imagej": True, "metadata": {"axes": "ZYX"}}):
        path = save_tiff(tmp_path / "a.tif", stack, **({"photometric": "minisblack"} | rest))
        assert axial(tilts(path), 10).max() < 0.5
        assert axial(tilts(path, page=4), 50).max() < 0.5
        assert any("page 0 of 6" in line for line in read(path).said)
        with pytest.raises(TissueError, match="page 6 is asked for, but it has 6"):
            read(path, page=6)
    hyper = stack.reshape(3, 2, *stack.shape[1:])
    path = save_tiff(tmp_path / "h.tif", hyper, imagej=True, metadata={"axes": "ZCYX"})
    assert axial(tilts(path, page=1, channel="1"), 40).max() < 0.5
    assert axial(tilts(path, page=2, channel="0"), 50).max() < 0.5
    path = save_tiff(tmp_path / "o.ome.tif", hyper, metadata={"axes": "ZCYX"}, compression="zlib")
    assert axial(tilts(path, page=2, channel="1"), 60).max() < 0.5
    Image.fromarray(BYTES).save(tmp_path / "a.png")
    with pytest.raises(TissueError, match="a PNG has page 0 alone"):
        read(tmp_path / "a.png", page=1)


def test_large_uncompressed_pictures_are_mapped_and_others_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "MAX_PIXELS", 1000)
    found = read(save_tiff(tmp_path / "a.tif", BYTES))
    assert isinstance(found.pixels, np.memmap)
    for name, write in (
        ("a.png", lambda path: Image.fromarray(BYTES).save(path)),
        ("z.tif", lambda path: save_tiff(path, BYTES, compression="zlib")),
    ):
        write(tmp_path / name)
        with pytest.raises(TissueError, match=r"says that it has 240x180 pixels"):
            read(tmp_path / name)


def test_a_decompression_bomb_is_refused_before_it_is_decoded(tmp_path):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0)
    data = (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(b"\0"))
        + chunk(b"IEND", b"")
    )
    (tmp_path / "bomb.png").write_bytes(data)
    with pytest.raises(TissueError, match="60000x60000 pixels, 3600 million; 400 million is the most"):
        read(tmp_path / "bomb.png")


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.tif", "z.tif"])
@pytest.mark.parametrize("part", [0.02, 0.3, 0.6, 0.9])
def test_what_was_cut_off_is_said_to_be(tmp_path, name, part):
    path = tmp_path / name
    if name == "z.tif":
        save_tiff(
            path, np.random.default_rng(0).integers(0, 255, (180, 240), dtype=np.uint8), compression="zlib"
        )
    else:
        Image.fromarray(np.random.default_rng(0).integers(0, 255, (180, 240), dtype=np.uint8)).save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * part)])
    with pytest.raises(TissueError, match=r"cut off|broken"):
        read(path)


def test_what_is_no_picture(tmp_path):
    (tmp_path / "text.png").write_text("hello")
    (tmp_path / "empty.png").write_bytes(b"")
    Image.fromarray(BYTES[:1, :1]).save(tmp_path / "one.png")
    Image.fromarray(np.zeros((50, 50), np.uint8)).save(tmp_path / "black.png")
    for name, said in (
        ("text.png", "is no PNG, JPEG, BMP or TIFF"),
        ("empty.png", "is empty"),
        ("none.png", "there is no such file"),
        (".", "is a folder"),
        ("one.png", "has 1x1 pixels; directions need at least 3x3"),
        ("black.png", "has no structure"),
    ):
        with pytest.raises(TissueError, match=said):
            tilts(tmp_path / name)
    with pytest.raises(TissueError, match="pixels of type complex"):
        tilts(save_tiff(tmp_path / "c.tif", PICTURE.astype(np.complex64)))


def test_crops(tmp_path):
    both = np.hstack([BYTES, np.round(grating(-40) * 255).astype(np.uint8)])
    Image.fromarray(both).save(tmp_path / "a.png")
    assert axial(tilts(tmp_path / "a.png", crop_px=(240, 0, 480, 180)), -40).max() < 0.1
    for crop in ((0, 0, 481, 10), (5, 5, 5, 10), (10, 0, 5, 10)):
        with pytest.raises(TissueError, match="leaves the picture of 480x180"):
            tilts(tmp_path / "a.png", crop_px=crop)
    with pytest.raises(TissueError, match="leaves 2x2 pixels"):
        tilts(tmp_path / "a.png", crop_px=(0, 0, 2, 2))


def test_without_a_size_nothing_is_guessed(tmp_path):
    Image.fromarray(BYTES).save(tmp_path / "a.png")
    with pytest.raises(
        TissueError, match="does not say how large a pixel is; give .* --size-mm, or .* --pixel-um"
    ):
        tilts(tmp_path / "a.png", Layout())
    layout = Layout(pixel_mm=0.05)
    made = orient(measure_image(tmp_path / "a.png", ImageSettings(), layout), layout)
    assert made.sheet.tile_mm == pytest.approx((240 * 0.05 / 16, 180 * 0.05 / 12))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_common_compressions_need_no_library_of_codecs(tmp_path, kind):
    values = (PICTURE * np.iinfo(kind).max).astype(kind)
    for compression in ("tiff_lzw", "tiff_adobe_deflate", "packbits"):
        Image.fromarray(values).save(tmp_path / "a.tif", compression=compression)
        np.testing.assert_array_equal(read(tmp_path / "a.tif").pixels, values)


def test_a_compression_that_nothing_reads_is_named(tmp_path, monkeypatch):
    import tifffile

    def missing(*_, **__):
        raise ValueError("<COMPRESSION.ZSTD: 50000> requires the 'imagecodecs' package")

    path = save_tiff(
        tmp_path / "a.tif", np.stack([BYTES, BYTES]), compression="zlib", photometric="minisblack"
    )
    monkeypatch.setattr(tifffile.TiffPage, "asarray", missing)
    with pytest.raises(
        TissueError, match="is compressed by ADOBE_DEFLATE; to read it: pip install imagecodecs"
    ):
        read(path)
