"""Known directions through every library that measures them, and through vslice: a table in Markdown.

    python benchmarks/orientation.py

Needs vslice[tissue] and scikit-image; OrientationPy is compared where it is installed. Each library gives a
structure tensor a pixel, which is averaged over tiles of 32 pixels; errors are axial, in degrees.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from pictures import axial, grating, noisy, rings, spiral

TILE = 32
SIZE = 256
RHO = 4.0
TILTS = (0, 10, 22.5, 33, 45, 60, 80, 90, -15, -45, -70)

Array = NDArray[np.float64]
Tensors = Callable[[Array], tuple[Array, Array, Array]]
"""A picture, row 0 at the top, as xx, yy and xy of its fibres in each pixel, y up."""


def vslice(picture: Array) -> tuple[Array, Array, Array]:
    """Ours, cells of one pixel."""
    from tissue.structure import structure_field

    field = structure_field(
        picture, lambda rows: np.asarray(rows, np.float32), sigma_px=1.0, rho_px=RHO, cell_px=1
    )
    xx, yy, xy = field.tensor * field.weight
    return xx, yy, xy


def structure_tensor(picture: Array) -> tuple[Array, Array, Array]:
    """The package structure-tensor: s[0] belongs to rows, downwards; s[2] is their product."""
    from structure_tensor import structure_tensor_2d

    rows, cols, both = structure_tensor_2d(picture, 1.0, RHO)
    return rows, cols, both


def scikit_image(picture: Array) -> tuple[Array, Array, Array]:
    """scikit-image, order "rc": Arr belongs to rows, downwards. Its gradient is Sobel's."""
    from skimage.feature import structure_tensor

    rows, both, cols = structure_tensor(picture, sigma=RHO, order="rc")
    return rows, cols, both


def orientationpy(mode: str) -> Tensors:
    """OrientationPy: [rows, both, columns] of the gradient, rows downwards."""

    def tensors(picture: Array) -> tuple[Array, Array, Array]:
        import orientationpy

        gradient = orientationpy.computeGradient(picture, mode=mode)
        rows, both, cols = orientationpy.computeStructureTensor(gradient, RHO)
        return rows, cols, both

    return tensors


METHODS: dict[str, Tensors] = {
    "vslice": vslice,
    "structure-tensor": structure_tensor,
    "scikit-image": scikit_image,
    "OrientationPy, finite differences": orientationpy("finite_difference"),
    "OrientationPy, Gaussian": orientationpy("gaussian"),
    "OrientationPy, splines": orientationpy("splines"),
}


def tile_angles(tensors: tuple[Array, Array, Array]) -> Array:
    """Tilt of each tile, row 0 at the top."""
    side = SIZE // TILE
    xx, yy, xy = (part.reshape(side, TILE, side, TILE).mean(axis=(1, 3)) for part in tensors)
    return np.asarray(np.degrees(np.arctan2(2 * xy, xx - yy)) / 2)


def pictures() -> dict[str, list[tuple[Array, Array | float]]]:
    """Pictures of each kind with their directions, a tile or all."""
    made: dict[str, list[tuple[Any, Any]]] = {
        "gratings": [(grating(tilt, SIZE, SIZE), tilt) for tilt in TILTS],
        "fine gratings, 5 px": [(grating(tilt, SIZE, SIZE, 5.0), tilt) for tilt in TILTS],
        "gratings, SNR 3": [(noisy(grating(tilt, SIZE, SIZE), 3), tilt) for tilt in TILTS],
        "gratings, SNR 1": [(noisy(grating(tilt, SIZE, SIZE), 1), tilt) for tilt in TILTS],
    }
    side = SIZE // TILE
    for name, (picture, direction) in {"rings": rings(SIZE, SIZE), "spiral": spiral(40, SIZE, SIZE)}.items():
        twice = np.radians(2 * direction)
        cos, sin = (
            part.reshape(side, TILE, side, TILE).mean(axis=(1, 3)) for part in (np.cos(twice), np.sin(twice))
        )
        made[name] = [(picture, np.degrees(np.arctan2(sin, cos)) / 2)]
    return made


def main() -> None:
    """Print the table: mean error, and the largest one in brackets, over all tiles."""
    print("| picture | " + " | ".join(METHODS) + " |")
    print("|---" * (len(METHODS) + 1) + "|")
    for kind, several in pictures().items():
        cells = []
        for measure in METHODS.values():
            try:
                errors = [axial(tile_angles(measure(picture)), true) for picture, true in several]
            except ImportError:
                cells.append("not installed")
                continue
            cells.append(f"{np.mean(errors):.2f} ({np.max(errors):.2f})")
        print(f"| {kind} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
