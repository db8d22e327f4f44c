"""Fibre directions on a lattice of cells: what every input becomes before it is tiled."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Field:
    """Fibres in cells, as tensors: directions are axial and never averaged as numbers.

    The tensor of a fibre along the unit vector u with weight w is w u uᵀ; that of many fibres is the sum.
    Its largest eigenvector is their axial mean. Coordinates have x right and y up; their unit is that
    of ``origin``, pixels for an image and mm for a volume.

    Attributes:
        tensor: float64 (3, rows, cols), xx, yy and xy of each cell.
        weight: float64 (rows, cols), share of the cell that counts, 0 to 1.
        origin: float64 (2,), centre of cell [0, 0].
        right, down: float64 (2,), steps to the cells [0, 1] and [1, 0].
        off_plane: float64 (rows, cols), mean square of the component of the fibres that leaves the
            plane, 0 to 1; None for an image, which has no depth.
        size: how many steps the tissue reaches down and right; None for whole cells. The last row and
            column of an image are narrower, unless its sides are multiples of a cell.
    """

    tensor: NDArray[np.float64]
    weight: NDArray[np.float64]
    origin: NDArray[np.float64]
    right: NDArray[np.float64]
    down: NDArray[np.float64]
    off_plane: NDArray[np.float64] | None = None
    size: tuple[float, float] | None = None

    @property
    def corners(self) -> NDArray[np.float64]:
        """float64 (4, 2), corners of the tissue, which begins half a step outside the first centres."""
        rows, cols = self.size or self.weight.shape
        steps = np.array([(-0.5, -0.5), (-0.5, cols - 0.5), (rows - 0.5, cols - 0.5), (rows - 0.5, -0.5)])
        return self.origin + steps[:, :1] * self.down + steps[:, 1:] * self.right

    def turned(self, angle_deg: float) -> "Field":
        """The tissue turned counter-clockwise about the origin; quarter turns are exact."""
        c, s = _cos_sin(angle_deg)
        turn = np.array([[c, -s], [s, c]])
        xx, yy, xy = self.tensor
        tensor = np.stack(
            [
                c * c * xx - 2 * c * s * xy + s * s * yy,
                s * s * xx + 2 * c * s * xy + c * c * yy,
                c * s * (xx - yy) + (c * c - s * s) * xy,
            ]
        )
        return replace(
            self, tensor=tensor, origin=turn @ self.origin, right=turn @ self.right, down=turn @ self.down
        )

    def mirrored(self, axis: str) -> "Field":
        """The tissue with its left and right ("x") or its top and bottom ("y") exchanged."""
        mirror = np.array([-1.0, 1.0] if axis == "x" else [1.0, -1.0])
        return replace(
            self,
            tensor=self.tensor * np.array([1.0, 1.0, -1.0])[:, None, None],
            origin=self.origin * mirror,
            right=self.right * mirror,
            down=self.down * mirror,
        )

    def scaled(self, factor: float) -> "Field":
        """The same in another unit of length."""
        return replace(self, origin=self.origin * factor, right=self.right * factor, down=self.down * factor)


def tilt_deg(tensor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axial mean direction of tensors (3, ...), degrees in (-90, 90], counter-clockwise from +x."""
    xx, yy, xy = tensor
    angle = np.degrees(np.arctan2(2 * xy, xx - yy)) / 2
    return np.asarray(np.where(angle <= -90, angle + 180, angle))


def anisotropy(tensor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Difference of the eigenvalues of tensors (3, ...): how much of a direction there is."""
    xx, yy, xy = tensor
    return np.asarray(np.hypot(xx - yy, 2 * xy))


def coherence(tensor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Anisotropy as a share of the trace, 0 for no direction to 1 for one alone; 0 where all is zero."""
    trace = tensor[0] + tensor[1]
    return np.asarray(np.divide(anisotropy(tensor), trace, out=np.zeros_like(trace), where=trace > 0))


def axial_difference_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle between axes, 0 to 90 degrees."""
    return np.asarray(np.abs((a - b + 90) % 180 - 90))


def _cos_sin(angle_deg: float) -> tuple[float, float]:
    quarter, rest = divmod(angle_deg, 90)
    if rest == 0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    return float(np.cos(np.radians(angle_deg))), float(np.sin(np.radians(angle_deg)))
