"""Volumes of known directions: planes, slices, mirrored, turned and oblique affines, and fits."""

import nibabel
import numpy as np
import pytest
from pictures import axial

from tissue.diffusion import measure_volume
from tissue.errors import TissueError
from tissue.orient import orient
from tissue.settings import Layout, VolumeSettings

PLANES = {"axial": (0, 1, 2), "coronal": (0, 2, 1), "sagittal": (1, 2, 0)}


def turn_about(axis, angle_deg):
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    a, b = [k for k in range(3) if k != axis]
    turn = np.eye(3)
    turn[[a, a, b, b], [a, b, a, b]] = c, -s, s, c
    return turn


def affine_of(axes, voxel_mm=(2.0, 2.0, 2.0)):
    affine = np.eye(4)
    affine[:3, :3] = np.asarray(axes) * voxel_mm
    affine[:3, 3] = -7, 11, 5
    return affine


def volume(path, world, affine, shape=(8, 9, 10), written="scanner"):
    """A volume in which every fibre has the scanner direction ``world``, written as asked for."""
    axes = affine[:3, :3] / np.linalg.norm(affine[:3, :3], axis=0)
    vector = np.asarray(world, float) / np.linalg.norm(world)
    if written != "scanner":
        vector = np.linalg.solve(axes, vector)
    if written == "fsl" and np.linalg.det(axes) > 0:
        vector[0] *= -1
    nibabel.save(nibabel.Nifti1Image(np.tile(vector, (*shape, 1)).astype(np.float32), affine), path)
    return path


def angles(path, plane, tiles=(3, 3), **rest):
    settings = VolumeSettings(plane=plane, **({"vectors": "scanner"} | rest))
    layout = Layout(tiles=tiles, spacing_mm=0.4)
    return orient(measure_volume(path, settings, layout), layout)


AFFINES = {
    "RAS": np.eye(3),
    "LAS": np.diag([-1.0, 1, 1]),
    "LPI": np.diag([-1.0, -1, -1]),
    "axes exchanged": np.array([[0, 0, 1.0], [-1, 0, 0], [0, 1, 0]]),
    "oblique": turn_about(0, 20) @ turn_about(2, -35),
}


@pytest.mark.parametrize("name", AFFINES)
@pytest.mark.parametrize("written", ["fsl", "voxel", "scanner"])
@pytest.mark.parametrize("plane", PLANES)
def test_directions_are_those_of_the_scanner(tmp_path, name, written, plane):
    world = np.array([0.6, -0.3, 0.5])
    affine = affine_of(AFFINES[name], (2.0, 1.5, 3.0))
    found = angles(volume(tmp_path / "V1.nii.gz", world, affine, written=written), plane, vectors=written)
    right, up, out = PLANES[plane]
    expected = np.degrees(np.arctan2(world[up], world[right]))
    assert axial(found.sheet.angles_deg[found.kept], expected).max() < 0.01
    share = world[out] ** 2 / (world**2).sum()
    assert found.off_plane_deg == pytest.approx(np.degrees(np.arcsin(np.sqrt(share))), abs=0.01)


def test_places_are_those_of_the_scanner(tmp_path):
    """Fibres stand in one corner of the slice alone; whichever way it is stored, that corner is the same."""
    for name in ("RAS", "LAS", "LPI", "axes exchanged"):
        affine = affine_of(AFFINES[name])
        place = np.stack(np.meshgrid(*[np.arange(8)] * 3, indexing="ij"), axis=-1) @ affine[:3, :3].T
        x, y = place[..., 0] - place[..., 0].min(), place[..., 1] - place[..., 1].min()
        vectors = np.where(((x > 7) & (y < 7))[..., None], [0.8, 0.6, 0.0], [0.0, 1.0, 0.0])
        nibabel.save(nibabel.Nifti1Image(vectors.astype(np.float32), affine), tmp_path / "v.nii")
        found = angles(tmp_path / "v.nii", "axial", (2, 2)).sheet.angles_deg
        assert axial(found[0, 1], 36.87) < 0.1, name
        assert axial(found[[0, 1, 1], [0, 0, 1]], 90).max() < 0.1, name


def test_an_oblique_slice_says_so_and_which_slice_was_taken(tmp_path):
    path = volume(tmp_path / "v.nii", [1, 0, 0], affine_of(AFFINES["oblique"]))
    said = measure_volume(path, VolumeSettings(vectors="scanner"), Layout()).said
    assert any("20.0° off the axial plane" in line for line in said)
    assert any("slice 5 of 10 was taken" in line for line in said)
    with pytest.raises(TissueError, match="there is no slice 10; 10 are axial"):
        angles(path, "axial", slice_index=10)


def test_fa_masks_and_nan(tmp_path):
    affine = affine_of(np.eye(3))
    path = volume(tmp_path / "v.nii.gz", [1, 1, 0], affine)
    fa = np.full((8, 9, 10), 0.5, np.float32)
    fa[4:] = 0.1
    nibabel.save(nibabel.Nifti1Image(fa, affine), tmp_path / "fa.nii.gz")
    found = angles(path, "axial", (2, 2), fa=tmp_path / "fa.nii.gz", min_fa=0.3)
    assert found.kept.tolist() == [[True, False], [True, False]]
    found = angles(path, "axial", (2, 2), mask=tmp_path / "fa.nii.gz")
    assert found.kept.all()
    with pytest.raises(TissueError, match="--min-fa needs the fractional anisotropy"):
        angles(path, "axial", min_fa=0.3)
    with pytest.raises(TissueError, match="no voxel of slice 5 counts"):
        angles(path, "axial", fa=tmp_path / "fa.nii.gz", min_fa=0.9)
    vectors = np.asarray(nibabel.load(path).dataobj).copy()
    vectors[:4, 4:] = np.nan
    nibabel.save(nibabel.Nifti1Image(vectors, affine), tmp_path / "nan.nii")
    measured = measure_volume(tmp_path / "nan.nii", VolumeSettings(vectors="scanner"), Layout())
    assert any("20 voxels of the slice are NaN" in line for line in measured.said)
    nibabel.save(nibabel.Nifti1Image(np.zeros((8, 9, 3), np.float32), affine), tmp_path / "flat.nii")
    for file, said in (
        (tmp_path / "nan.nii", "is 8x9x10x3, but the directions are 8x9x10"),
        (tmp_path / "flat.nii", "is 8x9x3, but the directions are 8x9x10"),
    ):
        with pytest.raises(TissueError, match=said):
            angles(path, "axial", mask=file)


def test_wrong_volumes(tmp_path):
    affine = affine_of(np.eye(3))
    three = tmp_path / "three.nii"
    nibabel.save(nibabel.Nifti1Image(np.ones((8, 9, 10), np.float32), affine), three)
    four = tmp_path / "four.nii"
    nibabel.save(nibabel.Nifti1Image(np.ones((8, 9, 10, 7), np.float32), affine), four)
    with pytest.raises(TissueError, match="is 8x9x10; principal directions .* need four"):
        angles(three, "axial")
    with pytest.raises(TissueError, match="3 numbers a voxel, not 7"):
        angles(four, "axial")
    (tmp_path / "text.nii").write_text("hello")
    for name in ("text.nii", "text.nii.gz"):
        (tmp_path / name).write_text("hello")
        with pytest.raises(TissueError, match="is no NIfTI that can be read|cut off"):
            angles(tmp_path / name, "axial")
    for name in ("v.nii", "v.nii.gz"):
        path = volume(tmp_path / name, [1, 0, 0], affine)
        path.write_bytes(path.read_bytes()[: len(path.read_bytes()) * 2 // 3])
        with pytest.raises(TissueError, match="cut off|can be read"):
            angles(path, "axial")
    with pytest.raises(TissueError, match="no such file"):
        angles(tmp_path / "none.nii", "axial")


@pytest.fixture
def weighted(tmp_path):
    """Diffusion-weighted data of fibres along (0.6, 0.8, 0), with bval and bvec in FSL's form."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    b = np.array([0.0] + [1000.0] * 20)
    directions = np.vstack([np.zeros(3), directions])
    fibre = np.array([0.6, 0.8, 0.0])
    tensor = 0.0003 * np.eye(3) + 0.0014 * np.outer(fibre, fibre)
    signal = 1000 * np.exp(-b * np.einsum("ij,jk,ik->i", directions, tensor, directions))
    affine = affine_of(np.eye(3))
    data = np.tile(signal, (6, 7, 5, 1)).astype(np.float32)
    nibabel.save(nibabel.Nifti1Image(data, affine), tmp_path / "dwi.nii.gz")
    # The determinant is positive: FSL mirrors the first axis.
    np.savetxt(tmp_path / "bvec", (directions * [-1, 1, 1]).T)
    np.savetxt(tmp_path / "bval", b[None])
    return tmp_path


def test_a_tensor_is_fitted(weighted):
    files = {"bval": weighted / "bval", "bvec": weighted / "bvec"}
    found = angles(weighted / "dwi.nii.gz", "axial", vectors="fsl", min_fa=0.5, **files)
    assert axial(found.sheet.angles_deg, 53.13).max() < 0.2
    assert found.sheet.meta["versions"]["dipy"]
    np.savetxt(weighted / "columns", np.loadtxt(weighted / "bvec").T)
    again = angles(
        weighted / "dwi.nii.gz", "axial", vectors="fsl", **(files | {"bvec": weighted / "columns"})
    )
    np.testing.assert_array_equal(again.sheet.angles_deg, found.sheet.angles_deg)


def test_tables_of_gradients_that_do_not_fit(weighted):
    def said(**files):
        given = {"bval": weighted / "bval", "bvec": weighted / "bvec"} | files
        with pytest.raises(TissueError) as raised:
            angles(weighted / "dwi.nii.gz", "axial", vectors="fsl", **given)
        return str(raised.value)

    short = weighted / "short"
    np.savetxt(short, np.loadtxt(weighted / "bval")[None, :-1])
    assert "short: has 20 entries, but" in said(bval=short)
    np.savetxt(short, np.loadtxt(weighted / "bvec")[:, :-1])
    assert "has 20 entries" in said(bvec=short)
    short.write_text("1 2 x\n")
    assert "no number" in said(bval=short)
    np.savetxt(short, 3 * np.loadtxt(weighted / "bvec"))
    assert "unit vectors are needed" in said(bvec=short)
    np.savetxt(short, np.zeros((1, 21)))
    assert "a tensor needs 6 directions" in said(bval=short)
