"""A plane of a diffusion volume, in scanner coordinates: directions that stand in a file, or are fitted here.

Scanner coordinates are those of NIfTI: x to the right of the person, y to the front, z up. An axial sheet
shows x and y, a coronal one x and z, a sagittal one y and z, the first to the right and the second up.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tissue.errors import TissueError
from tissue.field import Field
from tissue.libraries import library, versions
from tissue.measurement import Measurement
from tissue.picture import checked_file, hash_of
from tissue.settings import Layout, VolumeSettings

PLANES = {"axial": (0, 1, 2), "coronal": (0, 2, 1), "sagittal": (1, 2, 0)}
"""Scanner axes to the right, up, and out of the sheet."""
MAX_VOXELS = 1_000_000_000
B0_MOST = 50.0
"""b-values up to this, in s/mm², are taken as without diffusion weighting."""
LEAST_DIRECTIONS = 6


def measure_volume(path: Path, settings: VolumeSettings, layout: Layout) -> Measurement:
    """Take the fibre directions in one slice of a volume, projected on a plane of the scanner.

    Args:
        path: NIfTI of principal directions (x, y, z, 3), or with ``bval`` and ``bvec`` of diffusion-weighted
            data (x, y, z, n).
        layout: not looked at; a volume knows its size.

    Raises:
        TissueError: it cannot be read, or files do not fit each other.
    """
    image = _load(path)
    shape = tuple(int(n) for n in image.shape)
    across, up, out = PLANES[settings.plane]
    affine = np.asarray(image.affine, np.float64)
    if not np.isfinite(affine).all() or abs(np.linalg.det(affine[:3, :3])) < 1e-12:
        raise TissueError(f"{path}: its affine does not say where the voxels are.")
    axis = _slice_axis(affine, out)
    said: list[str] = []
    _check_shape(path, shape, settings)
    index = _slice_index(path, shape, axis, settings, said)
    in_slice = [k for k in range(3) if k != axis]
    if settings.bval is None or settings.bvec is None:
        vectors, fa = _stored(path, image, axis, index, said), None
        if settings.fa is not None:
            fa = _scalar(settings.fa, shape[:3], axis, index)
        method: dict[str, Any] = {"what": "principal directions as they stand in the file"}
    else:
        vectors, fa = _fitted(path, image, axis, index, settings.bval, settings.bvec)
        method = {
            "what": "diffusion tensor, weighted least squares, principal eigenvector",
            "fitted_by": "dipy",
        }
    world = _in_scanner(vectors, affine, settings.vectors)
    length = np.linalg.norm(world, axis=-1)
    counts = np.isfinite(length) & (length > 0)
    bad = int((~np.isfinite(length)).sum())
    if bad:
        said.append(f"{path}: {bad} voxels of the slice are NaN and were left out")
    if settings.min_fa > 0:
        if fa is None:
            raise TissueError(f"{path}: --min-fa needs the fractional anisotropy; give it with --fa.")
        counts &= np.nan_to_num(fa) >= settings.min_fa
    if settings.mask is not None:
        counts &= np.nan_to_num(_scalar(settings.mask, shape[:3], axis, index)) > 0
    if not counts.any():
        raise TissueError(
            f"{path}: no voxel of slice {index} counts; try another --slice or a lower --min-fa."
        )
    unit = np.where(counts[..., None], np.nan_to_num(world) / np.where(counts, length, 1.0)[..., None], 0.0)
    # The first axis of the slice becomes columns, the second one rows of cells.
    u, v, w = (unit[..., k].T for k in (across, up, out))
    steps = affine[[across, up], :3]
    corner = affine[[across, up], 3] + steps[:, axis] * index
    field = Field(
        np.stack([u * u, v * v, u * v]),
        counts.T.astype(np.float64),
        corner,
        steps[:, in_slice[0]].copy(),
        steps[:, in_slice[1]].copy(),
        w * w,
    )
    tilt = np.degrees(np.arccos(min(1.0, abs(affine[out, axis]) / np.linalg.norm(affine[:3, axis]))))
    if tilt > 0.5:
        said.append(
            f"{path}: its slices stand {tilt:.1f}° off the {settings.plane} plane; places and directions of "
            f"slice {index} were projected on it"
        )
    method |= {
        "plane": settings.plane,
        "slice": index,
        "voxel_axis": "ijk"[axis],
        "vectors": settings.vectors,
        "min_fa": settings.min_fa,
    }
    shown = fa if fa is not None else np.hypot(unit[..., across], unit[..., up])
    facts = {
        "source": {
            "file": path.name,
            "sha256": hash_of(path),
            "format": "NIfTI",
            "shape": list(shape),
            "voxel_mm": [round(float(side), 4) for side in np.linalg.norm(affine[:3, :3], axis=0)],
        },
        "method": method,
        "versions": versions(("numpy", "nibabel", *(("dipy",) if settings.bval is not None else ()))),
    }
    backdrop = np.nan_to_num(shown).T.astype(np.float32)
    return Measurement(field, 1.0, backdrop, (1.0, 1.0), str(path), facts, tuple(said), not counts.all())


def _load(path: Path) -> Any:
    checked_file(path)
    nibabel = library("nibabel")
    try:
        image = nibabel.load(path)
        if not hasattr(image, "affine") or image.affine is None:
            raise TissueError(f"{path}: has no affine, which says where voxels are.")
        if int(np.prod(image.shape[:3])) > MAX_VOXELS:
            raise TissueError(f"{path}: says that it has {image.shape} voxels; {MAX_VOXELS} is the most.")
        return image
    except TissueError:
        raise
    except Exception as error:  # noqa: BLE001 - broken files make its readers stumble in every way
        raise TissueError(f"{path}: is no NIfTI that can be read: {_first_line(error)}.") from None


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")


def _part(path: Path, image: Any, axis: int, index: int) -> NDArray[np.float64]:
    """One slice of a volume, the slice's axis taken out."""
    place = (slice(None),) * axis + (index,)
    try:
        return np.asarray(image.dataobj[place], np.float64)
    except Exception as error:  # noqa: BLE001 - see _load
        raise TissueError(f"{path}: is broken or cut off: {_first_line(error)}.") from None


def _slice_axis(affine: NDArray[np.float64], out: int) -> int:
    """Voxel axis that stands nearest to a scanner axis, each voxel axis going to one of them."""
    found = library("nibabel").io_orientation(affine)[:, 0]
    return int(np.flatnonzero(found == out)[0])


def _check_shape(path: Path, shape: tuple[int, ...], settings: VolumeSettings) -> None:
    shown = "x".join(map(str, shape))
    if settings.bval is not None:
        if len(shape) != 4:
            raise TissueError(
                f"{path}: has {len(shape)} dimensions ({shown}); diffusion-weighted data have 4."
            )
        return
    vectors = shape[3:] in ((3,), (1, 3))
    if not vectors:
        what = "four, the last of 3" if len(shape) != 4 else f"3 numbers a voxel, not {shape[3]}"
        raise TissueError(
            f"{path}: is {shown}; principal directions (V1) need {what}. Of diffusion-weighted data give "
            "--bval and --bvec."
        )


def _slice_index(
    path: Path, shape: tuple[int, ...], axis: int, settings: VolumeSettings, said: list[str]
) -> int:
    count = shape[axis]
    if settings.slice_index is None:
        if count > 1:
            said.append(
                f"{path}: slice {count // 2} of {count} was taken, the middle one; --slice gives another"
            )
        return count // 2
    if settings.slice_index >= count:
        raise TissueError(
            f"{path}: there is no slice {settings.slice_index}; {count} are {settings.plane}, counted from 0."
        )
    return settings.slice_index


def _stored(path: Path, image: Any, axis: int, index: int, said: list[str]) -> NDArray[np.float64]:
    vectors = _part(path, image, axis, index)
    vectors = vectors.reshape(*vectors.shape[:2], 3)
    length = np.linalg.norm(vectors, axis=-1)
    there = length[np.isfinite(length) & (length > 0)]
    if there.size and not 0.95 < float(np.median(there)) < 1.05:
        said.append(
            f"{path}: its directions are {np.median(there):.3g} long in the middle, not 1; only where they "
            "point was used"
        )
    return vectors


def _scalar(path: Path, shape: tuple[int, ...], axis: int, index: int) -> NDArray[np.float64]:
    """A slice of a 3-D volume of the same voxels."""
    image = _load(path)
    found = tuple(int(n) for n in image.shape)
    if found != shape and found != (*shape, 1):
        raise TissueError(
            f"{path}: is {'x'.join(map(str, found))}, but the directions are {'x'.join(map(str, shape))}; "
            "both must have the same voxels."
        )
    return _part(path, image, axis, index).reshape([n for k, n in enumerate(shape) if k != axis])


def _in_scanner(
    vectors: NDArray[np.float64], affine: NDArray[np.float64], written: str
) -> NDArray[np.float64]:
    """Directions in scanner axes.

    FSL writes them along the voxel axes, but with the first one mirrored where the affine's determinant is
    positive (FSL, bvecs and dtifit: "radiological" voxel order).
    """
    if written == "scanner":
        return vectors
    axes = affine[:3, :3]
    if written == "fsl" and np.linalg.det(axes) > 0:
        vectors = vectors * np.array([-1.0, 1.0, 1.0])
    return np.asarray(vectors @ (axes / np.linalg.norm(axes, axis=0)).T)


def _fitted(
    path: Path, image: Any, axis: int, index: int, bval: Path, bvec: Path
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Principal directions and fractional anisotropy of a slice, by dipy."""
    b, directions = _numbers(bval).ravel(), _numbers(bvec)
    count = int(image.shape[3])
    if directions.shape[0] == 3 and directions.shape[1] != 3:
        directions = directions.T
    if directions.shape[1] != 3:
        shown = "x".join(map(str, directions.shape))
        raise TissueError(f"{bvec}: is {shown} numbers; 3 rows or 3 columns are needed.")
    if directions.shape[0] == 3 == count and directions.shape == (3, 3):
        directions = directions.T  # FSL's own form has three rows
    for file, found in ((bval, len(b)), (bvec, len(directions))):
        if found != count:
            raise TissueError(
                f"{file}: has {found} entries, but {path} has {count} volumes; both must agree."
            )
    if not (np.isfinite(b).all() and (b >= 0).all()):
        raise TissueError(f"{bval}: every b-value must be finite and at least 0.")
    weighted = b > B0_MOST
    directions = np.where(weighted[:, None], np.nan_to_num(directions), 0.0)
    length = np.linalg.norm(directions, axis=1)
    wrong = np.flatnonzero(weighted & (np.abs(length - 1) > 0.05))
    if len(wrong):
        raise TissueError(
            f"{bvec}: direction {wrong[0]} is {length[wrong[0]]:.3g} long; unit vectors are needed."
        )
    if weighted.sum() < LEAST_DIRECTIONS or weighted.all():
        raise TissueError(
            f"{path}: a tensor needs {LEAST_DIRECTIONS} directions and a volume without weighting (b up to "
            f"{B0_MOST:g}); there are {int(weighted.sum())} and {int((~weighted).sum())}."
        )
    directions[weighted] /= length[weighted, None]
    data = _part(path, image, axis, index)
    finite = np.isfinite(data).all(axis=-1) & (data.max(axis=-1, initial=0.0) > 0)
    gradients = library("dipy.core.gradients").gradient_table(b, bvecs=directions, b0_threshold=B0_MOST)
    model = library("dipy.reconst.dti").TensorModel(gradients, fit_method="WLS")
    fit = model.fit(np.where(finite[..., None], data, 0.0), mask=finite)
    vectors = np.where(finite[..., None], np.asarray(fit.evecs, np.float64)[..., :, 0], np.nan)
    return vectors, np.where(finite, np.nan_to_num(np.asarray(fit.fa, np.float64)), 0.0)


def _numbers(path: Path) -> NDArray[np.float64]:
    """Numbers of a text file, a row a line."""
    checked_file(path)
    try:
        rows = [
            list(map(float, line.replace(",", " ").split())) for line in path.read_text("utf-8").splitlines()
        ]
    except (ValueError, UnicodeDecodeError):
        raise TissueError(f"{path}: holds something that is no number.") from None
    rows = [row for row in rows if row]
    if not rows or len({len(row) for row in rows}) != 1:
        raise TissueError(f"{path}: must hold rows of as many numbers each.")
    return np.array(rows, np.float64)
