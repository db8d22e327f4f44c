"""What was measured, before it is tiled; the same for images and volumes."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tissue.field import Field

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Measurement:
    """A field of fibres with what is known of it.

    Attributes:
        field: fibres in cells.
        unit_mm: what the field's unit of length is in mm; None if the file does not say.
        backdrop: float32 (height, width), a picture to draw behind the directions.
        backdrop_cells: how many cells a pixel of it is wide; pixel [0, 0] begins where cell [0, 0] does.
        source: the file, for messages.
        facts: for the record: source, method, versions.
        said: what was assumed, a line each.
        masked: whether a part of it was left out on purpose.
    """

    field: Field
    unit_mm: float | None
    backdrop: NDArray[np.float32]
    backdrop_cells: tuple[float, float]
    source: str
    facts: dict[str, Any] = dataclasses.field(default_factory=dict)
    said: tuple[str, ...] = ()
    masked: bool = False
