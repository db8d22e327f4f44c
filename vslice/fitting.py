"""Which nozzles print a sheet: what ``vslice nozzles`` shows, as table, JSON and picture."""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from profiles import Profile
from profiles.nozzles import KnownNozzle, known_nozzles, nozzle_called
from slicer import sequence
from slicer.cycles import in_cycles
from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.hatch import Hatch
from slicer.nozzle import NozzleBody
from slicer.precedence import hindering_edges
from vslice.nozzle import body_of, press_of
from vslice.objective import join_mm, objective_of
from vslice.pipeline import laid_out, pressing_of
from vslice.printable import counted_join_mm, printable

if TYPE_CHECKING:  # a table needs no picture
    from matplotlib.figure import Figure

STEEPEST_DEG = 85.0
CLOSE = 0.005
"""A limit is searched for until it is known to this part of itself."""


@dataclass(frozen=True)
class Fit:
    """How a nozzle prints a sheet.

    Attributes:
        in_cycles: how many toolpaths stand in one another's way in a ring, so that none can come first.
        toolpaths: how many there are.
        pieces: how many there are after cutting; None where they cannot be printed and were not cut.
        presses_mm: how deep the printed pushes into the body in the order found; likewise.
        travel_s: seconds of all travels in that order; likewise.
    """

    nozzle: str
    tip_width_mm: float
    cone_deg: float
    length_mm: float | None
    in_cycles: int
    toolpaths: int
    pieces: int | None
    presses_mm: float | None
    travel_s: float | None


@dataclass(frozen=True)
class Fits:
    """All nozzles on one sheet.

    Attributes:
        press_mm: how deep the printed may push into the body.
        widest_tip_mm: the widest blunt needle, however long, that prints the sheet without a cut; infinite
            where any does.
        cone_tip_mm: the width of tip for which the cone was searched, the profile's or that of a bead.
        steepest_cone_deg: the widest angle from the axis of a flank on such a tip that prints the sheet
            without a cut; None where not even a blunt one does.
    """

    press_mm: float
    widest_tip_mm: float
    cone_tip_mm: float
    steepest_cone_deg: float | None
    nozzles: list[Fit]


def candidates(height_mm: float, names: Sequence[str] | None = None) -> list[KnownNozzle]:
    """The nozzles to compare on a sheet of this height: of those that differ in length alone the shortest
    that reaches over it, or else the longest.
    """
    if names is not None:
        return [nozzle_called(name) for name in names]
    chosen: dict[tuple[float | str, ...], KnownNozzle] = {}
    for nozzle in sorted(known_nozzles().values(), key=lambda one: one.length_mm):
        size = (nozzle.what, nozzle.tip_width_mm, nozzle.cone_deg)
        if size not in chosen or chosen[size].length_mm < height_mm:
            chosen[size] = nozzle
    return [nozzle for nozzle in known_nozzles().values() if nozzle in chosen.values()]


def fit(sheet: Grid, lines: Hatch, profile: Profile, name: str, method: str) -> Fit:
    """How the nozzle of a profile prints a sheet; ``lines`` are its toolpaths, uncut."""
    spacing = spacing_of(sheet, lines)
    body = body_of(profile, spacing)
    caught = cyclic(lines.segments, body)
    nozzle = profile.nozzle
    found = Fit(
        name,
        nozzle.tip_width_mm,
        nozzle.cone_deg,
        nozzle.length_mm,
        caught,
        len(lines.segments),
        None,
        None,
        None,
    )
    try:
        shaped = printable(
            sheet.source, lines, "corner", body, nozzle.downhill_deg, overlap_mm=nozzle.overlap_mm
        )
    except SlicerError:  # no number of cuts is enough
        return found
    pieces = shaped.lines
    objective = objective_of(profile, "time", counted_join_mm(join_mm(profile, spacing), shaped.ends))
    result = sequence.solve(shaped.problem, method=method, objective=objective)
    _, made = laid_out(sheet, shaped, result, profile)
    pressing = pressing_of(made, profile)
    deepest = None if pressing is None else pressing.deepest
    return Fit(
        **asdict(found)
        | {
            "pieces": len(pieces.segments),
            "presses_mm": 0.0 if deepest is None else round(deepest.depth_mm, 4),
            "travel_s": round(made.times.travel_s, 2),
        }
    )


def spacing_of(sheet: Grid, lines: Hatch) -> NDArray[np.float64]:
    """float64 (n,), the spacing of each toolpath in mm."""
    return np.asarray(sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]], np.float64)


def cyclic(segments: NDArray[np.float64], body: NozzleBody) -> int:
    """How many toolpaths stand in one another's way in a ring."""
    return int(in_cycles(len(segments), hindering_edges(segments, body)).sum())


def widest_tip_mm(segments: NDArray[np.float64], press_mm: float, step: Callable[[], None]) -> float:
    """The widest blunt needle that prints toolpaths without a cut, from below; infinite where any does."""

    def prints(width_mm: float) -> bool:
        step()
        return cyclic(segments, NozzleBody.of(width_mm, press_mm=press_mm)) == 0

    # From twice the sheet's width on, all that is higher stands in the way wherever it is.
    most = 2.0 * float(np.ptp(segments[:, :, 0])) + 4.0 * press_mm
    return math.inf if prints(most) else _largest(prints, most)


def steepest_cone_deg(
    segments: NDArray[np.float64], tip_width_mm: float, press_mm: float, step: Callable[[], None]
) -> float | None:
    """The widest flank, from the axis, with which a tip of this width prints toolpaths without a cut."""

    def prints(cone_deg: float) -> bool:
        step()
        return cyclic(segments, NozzleBody.of(tip_width_mm, cone_deg, press_mm=press_mm)) == 0

    if not prints(0.0):
        return None
    return STEEPEST_DEG if prints(STEEPEST_DEG) else _largest(prints, STEEPEST_DEG)


def _largest(prints: Callable[[float], bool], too_much: float) -> float:
    """Bisection: the largest that still prints, where less prints too, and ``too_much`` does not."""
    low, high = 0.0, too_much
    while high - low > CLOSE * high and high > 1e-3:
        middle = (low + high) / 2
        low, high = (middle, high) if prints(middle) else (low, middle)
    return low


def limits(
    sheet: Grid, lines: Hatch, profile: Profile, step: Callable[[], None]
) -> tuple[float, float, float, float | None]:
    """Press, widest tip, the tip of the cone, and the steepest cone; see ``Fits``."""
    press_mm = press_of(profile, spacing_of(sheet, lines))
    tip = profile.nozzle.tip_width_mm or profile.material.width_mm
    widest = widest_tip_mm(lines.segments, press_mm, step)
    return press_mm, widest, tip, steepest_cone_deg(lines.segments, tip, press_mm, step)


def as_json(fits: Fits) -> str:
    """All of it; what is infinite is null."""
    values = asdict(fits)
    if math.isinf(fits.widest_tip_mm):
        values["widest_tip_mm"] = None
    return json.dumps(values, indent=1)


def as_table(fits: Fits) -> str:
    """All of it for people."""
    rows = [("nozzle", "tip", "cone", "in cycles", "pieces", "presses", "travel"), *map(_row, fits.nozzles)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]
    return "\n".join([*lines, "", *limits_in_words(fits), *uncut_in_words(fits)])


def _row(one: Fit) -> tuple[str, ...]:
    return (
        one.nozzle,
        f"{one.tip_width_mm:.2f} mm",
        f"{one.cone_deg:g}°" if one.cone_deg else "-",
        f"{one.in_cycles} of {one.toolpaths}",
        "-" if one.pieces is None else str(one.pieces),
        "-" if one.presses_mm is None else f"{one.presses_mm:.2f} mm",
        "-" if one.travel_s is None else f"{one.travel_s:.1f} s",
    )


def limits_in_words(fits: Fits) -> list[str]:
    """A sentence for each limit."""
    pressed = f"with {fits.press_mm:.3g} mm of pressing"
    if math.isinf(fits.widest_tip_mm):
        said = [f"A blunt needle of any width prints it without a cut, {pressed}."]
    else:
        said = [
            f"The widest blunt needle that prints it without a cut, {pressed}: {fits.widest_tip_mm:.3g} mm."
        ]
    if fits.steepest_cone_deg is None:
        return [*said, f"A tip of {fits.cone_tip_mm:g} mm does not, whatever its cone."]
    cone = f"{fits.steepest_cone_deg:.3g} degrees from the axis"
    return [*said, f"The widest cone on a tip of {fits.cone_tip_mm:g} mm that does: {cone}."]


def uncut_in_words(fits: Fits) -> list[str]:
    """Which of several nozzles print the sheet as it is, or else with the fewest pieces."""
    if len(fits.nozzles) < 2:
        return []
    whole = [one.nozzle for one in fits.nozzles if one.in_cycles == 0]
    if len(whole) == len(fits.nozzles):
        return ["All of these nozzles print it without a cut."]
    if whole:
        return [f"Of these nozzles without a cut: {', '.join(whole)}."]
    said = [(one.pieces, one.nozzle) for one in fits.nozzles if one.pieces is not None]
    fewest = f"; the fewest pieces, {min(said)[0]}, with {min(said)[1]}" if said else ""
    return [f"None of these nozzles prints it without a cut{fewest}."]


def draw(fits: Fits, title: str) -> "Figure":
    """A bar for each nozzle: the share of toolpaths in cycles, and the seconds of travels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 1.6 + 0.22 * len(fits.nozzles)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    names = [f"{one.nozzle}  {one.tip_width_mm:.2f} mm" for one in fits.nozzles]
    share = [100 * one.in_cycles / max(one.toolpaths, 1) for one in fits.nozzles]
    place = np.arange(len(names))
    left.barh(place, share, color=["#2ca02c" if part == 0 else "#d62728" for part in share])
    left.plot(np.zeros(len(names)), place, "|", color="0.4", ms=4)
    left.set_yticks(place, names, fontsize=7)
    left.invert_yaxis()
    left.set_xlim(0, 100)
    left.set_xlabel("toolpaths in cycles [%]")
    right.barh(place, [one.travel_s or 0.0 for one in fits.nozzles], color="#1f77b4")
    for k, one in enumerate(fits.nozzles):
        cut = "not printable uncut" if one.pieces is None else ""
        more = "" if one.pieces in (None, one.toolpaths) else f"{one.pieces} pieces"
        right.annotate(
            cut or more, (one.travel_s or 0.0, k), (3, 0), textcoords="offset points", va="center", size=6
        )
    right.margins(x=0.25)  # the numbers behind the bars stay within
    right.set_xlim(left=0.0)
    right.set_xlabel("travel [s]")
    figure.suptitle(title + "\n" + "\n".join(limits_in_words(fits)), fontsize=8)
    return figure
