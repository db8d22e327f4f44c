"""The pictures of docs/nozzle.md, drawn with the code's own depths.

usage: python docs/nozzle.py [FOLDER]

Draws three pictures into a folder, docs/images by default, and prints the numbers that the page states.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from gcode.nozzle_body import depths, parts_of
from gcode.preview import picture
from profiles.nozzles import nozzle_called
from profiles.sections import Nozzle
from slicer.cycles import in_cycles
from slicer.nozzle import NozzleBody
from slicer.precedence import hindering_edges
from vslice.conflicts import BODY, IN_CYCLE, PATH, PRINTED, draw_body

ROOT = Path(__file__).parents[1]
NEEDLE = Nozzle(tip_width_mm=nozzle_called("18G").tip_width_mm)
CONE = Nozzle(tip_width_mm=0.6, cone_deg=35.0)
SPACING_MM, PRESS_MM = 0.25, 0.25
WIDE_IN, HIGH_IN = 8.2, 4.2


def line(x: float, y: float, tilt_deg: float, length_mm: float) -> NDArray[np.float64]:
    """float64 (2, 2), a toolpath from its lower end."""
    step = length_mm * np.array([np.cos(np.radians(tilt_deg)), np.sin(np.radians(tilt_deg))])
    return np.array([(x, y), (x + step[0], y + step[1])])


def deepest(
    nozzle: Nozzle, printed: NDArray[np.float64], path: NDArray[np.float64]
) -> tuple[float, tuple[float, float]]:
    """How deep a printed toolpath pushes while the other is printed, and where the tip is then."""
    found = depths(parts_of(nozzle), printed.reshape(1, 4), path.reshape(1, 4))
    return float(found.depth[0]), (float(found.x[0]), float(found.y[0]))


def pressed_body(axes: Axes, nozzle: Nozzle, tip_mm: tuple[float, float]) -> None:
    """The body, and the core within it that may not be entered, dashed."""
    draw_body(axes, nozzle, tip_mm)
    lean = np.radians(nozzle.cone_deg)
    # Each face moves inwards by what may be pressed.
    half = nozzle.tip_width_mm / 2 - PRESS_MM * (1.0 / np.cos(lean) - np.tan(lean))
    core = Nozzle(tip_width_mm=2 * half, cone_deg=nozzle.cone_deg)
    draw_body(axes, core, (tip_mm[0], tip_mm[1] + PRESS_MM), facecolor="none", alpha=1.0, ls="--")


def panels(count: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Axes beside each other, in mm."""
    figure = Figure(figsize=(WIDE_IN, HIGH_IN), layout="constrained")
    found = list(figure.subplots(1, count, squeeze=False)[0])
    for axes in found:
        axes.set_xlim(-width / 2, width / 2)
        axes.set_ylim(-0.25 * height, 0.75 * height)
        axes.set_aspect("equal")
        axes.tick_params(labelsize=7)
        axes.set_xlabel("x [mm]", fontsize=8)
    found[0].set_ylabel("y [mm], build direction", fontsize=8)
    return figure, found


def show(axes: Axes, toolpath: NDArray[np.float64], color: str, label: str = "", width: float = 2.2) -> None:
    """A toolpath, with a label beside its upper end."""
    axes.plot(*toolpath.T, color=color, lw=width, zorder=5, solid_capstyle="round")
    if label:
        axes.annotate(label, toolpath[1], (4, 0), textcoords="offset points", color=color, fontsize=9)


def in_the_way() -> Figure:
    """Steep neighbours of one tile under a needle, and two tiles under a cone."""
    figure, (left, right) = panels(2, 4.0, 4.0)
    b, a = steep_pair()
    depth, tip = deepest(NEEDLE, b, a)
    pressed_body(left, NEEDLE, tip)
    show(left, a, PATH, "A")
    show(left, b, PRINTED, "B")
    left.set_title(f"a needle, 18G: B would push {depth:.2f} mm deep", fontsize=9)
    a, b = line(-0.2, 0.0, 10.0, 1.0), line(1.1, 0.3, 70.0, 1.6)
    depth, tip = deepest(CONE, b, a)
    pressed_body(right, CONE, tip)
    show(right, a, PATH, "A")
    show(right, b, PRINTED, "B")
    right.set_title(f"a cone: B would push {depth:.2f} mm deep", fontsize=9)
    print(f"in the way: needle {deepest(NEEDLE, *steep_pair())[0]:.2f} mm, cone {depth:.2f} mm")
    return figure


def steep_pair() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The printed neighbour and the path of the first picture."""
    apart = SPACING_MM / np.sin(np.radians(75.0))
    return line(apart, 0.0, 75.0, 2.0), line(0.0, 0.0, 75.0, 2.0)


def valley() -> NDArray[np.float64]:
    """float64 (2, 2, 2), two toolpaths that lean towards each other across the border of two tiles."""
    return np.stack([line(-0.02, 0.0, 120.0, 1.2), line(0.02, 0.0, 60.0, 1.2)])


def cut_valley() -> NDArray[np.float64]:
    """The same, each cut where the other stands in its way."""
    out = []
    for low, high in valley():
        middle = low + PRESS_MM / (high - low)[1] * (high - low)
        out += [[low, middle], [middle, high]]
    return np.array(out)


def cycle() -> Figure:
    """Two toolpaths in each other's way, and the pieces into which they are cut."""
    figure, (left, middle, right) = panels(3, 2.0, 2.2)
    body = NozzleBody.of(NEEDLE.tip_width_mm, press_mm=PRESS_MM)
    a, b = valley()
    whole = in_cycles(2, hindering_edges(valley(), body))
    for axes, (path, printed, names) in zip((left, middle), ((a, b, "AB"), (b, a, "BA")), strict=True):
        depth, tip = deepest(NEEDLE, printed, path)
        pressed_body(axes, NEEDLE, tip)
        show(axes, path, PATH, names[0])
        show(axes, printed, PRINTED, names[1])
        axes.set_title(f"{names[1]} printed: {depth:.2f} mm in the way of {names[0]}", fontsize=8)
    pieces = cut_valley()
    edges = hindering_edges(pieces, body)
    print(
        f"cycle: {depth:.2f} mm, {int(whole.sum())} of 2 caught; cut: {int(in_cycles(4, edges).sum())} of 4"
    )
    rank, waiting = {}, set(range(4))
    while waiting:
        ready = min(
            k for k in waiting if not any(low in waiting and high == k for low, high in edges.tolist())
        )
        waiting.remove(ready)
        rank[ready] = len(rank) + 1
    for k, piece in enumerate(pieces):
        show(right, piece, (PATH, IN_CYCLE)[k % 2], str(rank[k]))
    right.set_title("cut, and printed in this order", fontsize=8)
    return figure


def directions() -> Figure:
    """The flat of a needle on its own bead, upwards and downwards."""
    figure, (left, right) = panels(2, 3.0, 2.4)
    for axes, tilt, name in ((left, 40.0, "uphill"), (right, -40.0, "downhill")):
        slope = np.tan(np.radians(tilt))
        done = np.array([[-1.0, 0.2 - slope], [0.0, 0.2]])
        half = NEEDLE.tip_width_mm / 2
        x, y = done.T
        bead = [(x[0], y[0]), (x[1], y[1]), (x[1], y[1] - 0.18), (x[0], y[0] - 0.18)]
        axes.add_patch(Polygon(bead, closed=True, facecolor="#e8b4b4", edgecolor="none", zorder=1))
        show(axes, done, IN_CYCLE)
        axes.annotate(
            "", (0.7, 0.2 + 0.7 * slope), (0.0, 0.2), arrowprops={"arrowstyle": "->", "color": PATH}
        )
        draw_body(axes, NEEDLE, (0.0, 0.2))
        if tilt < 0:
            rear = -half * slope
            axes.annotate(
                f"r tan t = {rear:.2f} mm", (-half, 0.2 + rear), (-1.45, 0.25), fontsize=8,
                arrowprops={"arrowstyle": "-", "color": BODY},
            )  # fmt: skip
            print(f"downhill: {rear:.2f} mm at {-tilt:g} degrees")
        axes.set_title(name, fontsize=9)
    return figure


def main(folder: Path) -> None:
    """Draw all three."""
    for name, draw in (("nozzle-way", in_the_way), ("nozzle-cycle", cycle), ("nozzle-downhill", directions)):
        (folder / f"{name}.svg").write_bytes(picture(draw(), "svg"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images")
