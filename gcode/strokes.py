"""The lines that a program draws, and whether they are the hatch lines of a grid."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcode.moves import Kind, Move
from gcode.violation import Violation

if TYPE_CHECKING:  # it imports shapely, which a program alone does not take
    from slicer.grid import Grid
    from slicer.hatch import Hatch

MATCH_MM = 0.01
STRAIGHT_MM = 0.002
ROUNDING_MM = 0.0015
ROUNDED_MM = 0.00075
"""So far a point moves at most when its coordinates are written with three decimals."""


class Stroke(NamedTuple):
    """A straight movement from (x0, y0) to (x1, y1) in the plane, by program lines ``line`` to ``last``."""

    x0: float
    y0: float
    x1: float
    y1: float
    line: int
    last: int
    prints: bool
    off_plane: float
    depth: float


SKIRTS = frozenset({"TYPE:Skirt/Brim", "TYPE:Skirt", "TYPE:SKIRT"})
"""What PrusaSlicer, its older versions and Cura call what is printed beside the part."""


def motions(moves: Sequence[Move], printing: Sequence[bool]) -> list[Stroke]:
    """Every movement in the plane of which both ends are known.

    Args:
        printing: for each move, whether it lays material.
    """
    found = []
    x = y = depth = math.nan
    for move, prints in zip(moves, printing, strict=True):
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE) and not (math.isnan(x) or math.isnan(y)):
            off = 0.0 if math.isnan(depth) else abs(move.depth_mm - depth)
            found.append(Stroke(x, y, move.x_mm, move.y_mm, move.line, move.line, prints, off, move.depth_mm))
        x, y, depth = move.x_mm, move.y_mm, move.depth_mm
    return found


def strokes(moves: Iterable[Stroke]) -> list[Stroke]:
    """Join extrusions that go straight on where the one before them ended."""
    joined: list[Stroke] = []
    for move in moves:
        if joined and move.prints and joined[-1].prints and goes_on(joined[-1], move):
            last = joined[-1]
            joined[-1] = last._replace(x1=move.x1, y1=move.y1, last=move.line)
        else:
            joined.append(move)
    return joined


def goes_on(a: Stroke, b: Stroke) -> bool:
    """Whether ``b`` begins where ``a`` ends, and goes straight on."""
    if max(abs(b.x0 - a.x1), abs(b.y0 - a.y1)) > ROUNDING_MM:
        return False
    ax, ay, bx, by = a.x1 - a.x0, a.y1 - a.y0, b.x1 - b.x0, b.y1 - b.y0
    length = max(float(np.hypot(ax + bx, ay + by)), 1e-12)
    return ax * bx + ay * by > 0 and abs(ax * by - ay * bx) / length <= STRAIGHT_MM


def named_joins(moves: Sequence[Move], printing: Sequence[bool]) -> set[int]:
    """Program lines of what is laid right behind the comment ``;JOIN``: the first move only, if it prints."""
    found, next_is = set(), False
    for move, prints in zip(moves, printing, strict=True):
        if move.kind == Kind.COMMENT:
            next_is = move.text == "JOIN"
        elif next_is:
            next_is = False
            if prints:
                found.add(move.line)
    return found


class Compared(NamedTuple):
    """What a comparison with the hatch of a grid found.

    Attributes:
        violations: what is wrong.
        exact: float64 (n, 5), the hatch lines in the order in which they were drawn, as exact as the grid
            gives them: from (x, y) to (x, y) and the program line.
        joins: program lines of the hops over which the bead goes on from one hatch line to the next.
    """

    violations: list[Violation]
    exact: NDArray[np.float64]
    joins: set[int]


def compare_with_hatch(
    drawn: list[Stroke], grid: "Grid", shift_mm: tuple[float, float] | None, join_mm: float = 0.0
) -> Compared:
    """Every hatch line of the grid must be drawn once, and nothing else; and the lines must fill the tiles.

    A hatch line may be drawn in one movement, in several that go straight on, or in pieces at different
    times, as a nozzle with a body needs it; pieces may overlap. That the hatch itself leaves nothing out is
    tested by the area of each tile, see ``coverage``. Between two hatch lines, or pieces, that follow one
    another the bead may go on over a short hop.

    Args:
        drawn: the movements that lay material.
        shift_mm: what lies between sheet and machine; where it is None, the lower left corners of all
            that is drawn and of all that should be are laid on each other.
        join_mm: the longest such hop.
    """
    from gcode.coverage import shortfalls
    from gcode.pieces import pieces_of
    from slicer.hatch import hatch

    wanted = hatch(grid)
    lines = _ends(drawn)
    if shift_mm is not None:
        shift = np.array(shift_mm)
    elif len(wanted.segments) and len(drawn):
        shift = lines.min(axis=(0, 1)) - wanted.segments.min(axis=(0, 1))
    else:
        shift = np.zeros(2)
    target = wanted.segments + shift
    owner, used = _assign(target, lines)
    unused = [drawn[k] for k in np.flatnonzero(~used)]
    rest = strokes(unused)
    open_lines = np.flatnonzero(owner < 0)
    later, used = _assign(target[open_lines], _ends(rest))
    in_pieces = open_lines[later < 0]
    joined = {line for k in np.flatnonzero(used) for line in range(rest[k].line, rest[k].last + 1)}
    unused = [stroke for stroke in unused if stroke.line not in joined]
    pieces = pieces_of(target[in_pieces], unused)
    missing = in_pieces[pieces.open_mm > 0]
    out = []
    for k, open_mm in zip(missing, pieces.open_mm[pieces.open_mm > 0], strict=True):
        (x0, y0), (x1, y1) = target[k]
        col, row = wanted.tile[k]
        which = f"from ({x0:.3f}, {y0:.3f}) to ({x1:.3f}, {y1:.3f})"
        part = "" if open_mm > np.hypot(x1 - x0, y1 - y0) - MATCH_MM else f" on {open_mm:.3f} mm of it"
        text = f"tile ({col}, {row}): its hatch line {which} is not printed{part}"
        out.append(Violation(0, "missing", text))
    strange = {stroke.line for k, stroke in enumerate(unused) if pieces.owner[k] < 0}
    joins = _joins(drawn, strange, join_mm)
    part_of = {k: in_pieces[of] for k, of in enumerate(pieces.owner.tolist()) if of >= 0}
    extra = [k for k in range(len(unused)) if pieces.again[k] or unused[k].line in strange - joins]
    out += _superfluous(unused, extra, part_of, target, wanted, grid.source)
    said = set(map(tuple, wanted.tile[missing].tolist()))
    hops = np.array([stroke.line in joins for stroke in drawn], np.bool_)
    for short in shortfalls(lines[~hops] - shift, grid):
        if (short.col, short.row) not in said:
            x, y = short.x_mm + shift[0], short.y_mm + shift[1]
            text = (
                f"tile ({short.col}, {short.row}): {short.printed_mm:.3f} mm are printed where its area "
                f"needs {short.needed_mm:.3f} mm, in rows as that through ({x:.3f}, {y:.3f})"
            )
            out.append(Violation(0, "missing", text))
    owner[open_lines[later >= 0]] = len(drawn) + later[later >= 0]
    line = np.array([s.line for s in [*drawn, *rest]], np.float64)[owner[owner >= 0]]
    exact = np.column_stack([target[owner >= 0].reshape(-1, 4), line]).astype(np.float64)
    exact = np.concatenate([exact, pieces.exact])
    return Compared(out, exact[np.argsort(exact[:, 4], kind="stable")], joins)


def _joins(drawn: list[Stroke], strange: set[int], join_mm: float) -> set[int]:
    """Of the strokes on no hatch line, those that lead from one that is straight to the next."""
    found = set()
    for before, stroke, after in zip(drawn, drawn[1:], drawn[2:], strict=False):
        if stroke.line not in strange or {before.line, after.line} & strange:
            continue
        meets = _apart(before.x1, before.y1, stroke.x0, stroke.y0) <= ROUNDING_MM
        meets &= _apart(stroke.x1, stroke.y1, after.x0, after.y0) <= ROUNDING_MM
        if meets and np.hypot(stroke.x1 - stroke.x0, stroke.y1 - stroke.y0) <= join_mm + 2 * ROUNDING_MM:
            found.add(stroke.line)
    return found


def _apart(x0: float, y0: float, x1: float, y1: float) -> float:
    return max(abs(x1 - x0), abs(y1 - y0))


def _superfluous(
    unused: list[Stroke],
    extra: list[int],
    part_of: dict[int, int],
    target: NDArray[np.float64],
    wanted: "Hatch",
    source: str,
) -> list[Violation]:
    """What is printed beside one print of each hatch line.

    Args:
        unused: strokes that print no whole hatch line first.
        extra: the places among them of what is too much.
        part_of: of some of them, by their place, the hatch line that they are pieces of.
    """
    i, j, _ = _near(_ends([unused[k] for k in extra]), target)
    whole = dict(zip(i.astype(int).tolist(), j.astype(int).tolist(), strict=True))
    out = []
    for place, k in enumerate(extra):
        stroke = unused[k]
        if place in whole or k in part_of:
            col, row = wanted.tile[whole[place] if place in whole else part_of[k]]
            what = "a hatch line" if place in whole else "a part of a hatch line"
            text = f"{what} of tile ({col}, {row}) that is printed by another line too"
            out.append(Violation(stroke.line, "twice", text))
        else:
            which = f"({stroke.x0:.3f}, {stroke.y0:.3f}) to ({stroke.x1:.3f}, {stroke.y1:.3f})"
            out.append(Violation(stroke.line, "stray", f"{which} is no hatch line of {source}"))
    return out


def prime_strokes(laid: list[Stroke], moves: Sequence[Move], prime_mm: float = 0.0) -> set[int]:
    """The program lines that only fill the nozzle: printed behind ``;TYPE:Skirt/Brim``, before all toolpaths,
    and beside all of them. The comment alone excuses nothing: a line over the sheet is one of the sheet.

    Hosts strip comments. Where a program has none of a type, its first line is that line if it is level, as
    long as the profile's ``prime_mm``, no higher than anything else, and beside all the rest.
    """
    if not any(move.kind == Kind.COMMENT and move.text.startswith("TYPE:") for move in moves):
        return _bare_prime(laid, prime_mm)
    skirt = False
    marked: set[int] = set()
    for move in moves:
        if move.kind == Kind.COMMENT:
            if move.text.startswith("TOOLPATH"):
                break
            if move.text.startswith("TYPE:"):
                skirt = move.text in SKIRTS
        elif skirt and move.kind in (Kind.TRAVEL, Kind.EXTRUDE):
            marked.add(move.line)
    first = [stroke for stroke in laid if stroke.prints and stroke.line in marked]
    rest = [stroke for stroke in laid if stroke.prints and stroke.line not in marked]
    if not rest:
        return set()
    low = min(min(stroke.x0, stroke.x1) for stroke in rest)
    high = max(max(stroke.x0, stroke.x1) for stroke in rest)
    return {s.line for s in first if max(s.x0, s.x1) < low or min(s.x0, s.x1) > high}


def _bare_prime(laid: list[Stroke], prime_mm: float) -> set[int]:
    drawn = [stroke for stroke in laid if stroke.prints]
    if prime_mm <= 0 or len(drawn) < 2:
        return set()
    first, rest = drawn[0], drawn[1:]
    level = abs(first.y1 - first.y0) <= ROUNDING_MM
    long = abs(abs(first.x1 - first.x0) - prime_mm) <= ROUNDING_MM
    lowest = first.y0 <= min(min(s.y0, s.y1) for s in rest) + ROUNDING_MM
    low = min(min(s.x0, s.x1) for s in rest)
    high = max(max(s.x0, s.x1) for s in rest)
    beside = max(first.x0, first.x1) < low or min(first.x0, first.x1) > high
    return {first.line} if level and long and lowest and beside else set()


def _ends(drawn: list[Stroke]) -> NDArray[np.float64]:
    return np.array([(s.x0, s.y0, s.x1, s.y1) for s in drawn], np.float64).reshape(-1, 2, 2)


def _assign(
    target: NDArray[np.float64], found: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Give each target one found line, the nearest pairs first: which (or -1), and whether each is used.

    Of pairs that rounding cannot tell apart the lower target goes with the earlier line.
    """
    a, b, distance = _near(target, found)
    owner = np.full(len(target), -1, np.intp)
    used = np.zeros(len(found), np.bool_)
    distance = np.where(distance <= ROUNDED_MM, 0.0, distance)
    for k in np.lexsort((b, a, distance)):
        t, f = int(a[k]), int(b[k])
        if owner[t] < 0 and not used[f]:
            owner[t] = f
            used[f] = True
    return owner, used


def _near(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pairs of lines whose ends lie within ``MATCH_MM``, whichever way they run: float (3, p), the index
    in a, the index in b, and how far the farther ends are apart.
    """
    if len(a) == 0 or len(b) == 0:
        return np.empty((3, 0))
    import shapely

    tree = shapely.STRtree(shapely.points(b.mean(axis=1)))
    i, j = tree.query(shapely.points(a.mean(axis=1)), predicate="dwithin", distance=MATCH_MM)
    same = np.hypot(*np.moveaxis(a[i] - b[j], -1, 0)).max(axis=1)
    turned = np.hypot(*np.moveaxis(a[i] - b[j][:, ::-1], -1, 0)).max(axis=1)
    distance = np.minimum(same, turned)
    near = distance <= MATCH_MM
    return np.stack([i[near], j[near], distance[near]])
