"""The numbers that docs/how-it-works.md states, and its pictures.

usage: python docs/how_it_works.py [FOLDER]

Draws the pictures into a folder, docs/images by default, and prints what the page says in numbers. The
small sheet is that of ``vslice generate --cols 3 --rows 3 --seed 1 --spacing-mm 0.2``.
"""

import sys
from pathlib import Path

import numpy as np
from how_it_works_example import LONG_MM, ROOT, STEPS, fix, real, small, states_of
from how_it_works_pictures import draw

from slicer.sequence.bound.streamed_ascent import MOST_DOWN_SETS
from slicer.sequence.layered.streamed_beams import MOST_COLUMNS
from slicer.sequence.portfolio import CARRY_UP_TO, WINDOWS_UP_TO
from slicer.sequence.portfolio.automatic import PROVE_KNOWN_UP_TO, PROVE_UP_TO
from slicer.sequence.states.corridor import MERGED_STATES

RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def facts() -> list[str]:
    """What the page states, number by number, in its words."""
    sheet, tissue = small(), real()
    fixing = fix(sheet)
    merged = sheet.pairs(MERGED_STATES)
    merged.use_best_multipliers()
    assert merged.blocks.blocks == 1
    assert np.isclose(merged.bound, sheet.best.travel_mm, rtol=1e-9)
    assert fixing.found.lower_bound == np.inf, "the search in what is left missed nothing"
    greedy, best, found = sheet.greedy.travel_mm, sheet.best.travel_mm, fixing.found.cost
    assert np.isclose(found, best, rtol=1e-9)
    ways = sheet.travels(sheet.greedy)
    length = np.hypot(*(ways[:, 1] - ways[:, 0]).T)
    long = length[length > LONG_MM]
    one, two, three = sheet.sets.counts
    (begin, half, full), (first, second), (left, right) = fixing.rising, fixing.before, fixing.after
    counts = tissue.sets.counts
    assert len(counts) == 8
    return [
        f"has {sheet.problem.n} toolpaths",
        f"here {len(sheet.problem.edges)} arrows",
        f"in {_power(sheet.orders())} orders",
        f"in 2{str(sheet.problem.n - 1).translate(RAISED)} ways to choose the directions",
        f"travels {greedy:.3f} mm, and {best:.3f} mm are enough: greedy is {100 * (greedy / best - 1):.0f} %",
        f"Just {len(long)} travels, each longer than half a millimetre, make {long.sum():.2f} mm",
        f"It gives {fixing.cut:.3f} mm here",
        f"have {one}, {two} and {three} down-sets, and together they come to {sum(states_of(merged))} states",
        f"with {tissue.problem.n} toolpaths",
        f"make {_power(int(np.prod([int(count) for count in counts], dtype=object)))} combinations",
        f"all seven pairs together {int((counts[1:] * counts[:-1]).sum()):,}",
        f"it is {fixing.without:.3f} mm with all of these at 0, {begin:.3f} with the prices",
        f"{half:.3f} after {STEPS[1]} steps and {full:.3f} after {STEPS[2]}.",
        f"of up to {MERGED_STATES:,} states",
        f"here {fixing.cut:.3f} mm, no better sequence",
        f"{left} of {first} states are kept, of the second {right} of {second}",
        f"no sequence through it costs less than {fixing.through[fixing.worst]:.3f} mm",
        f"takes {fixing.found.nodes} nodes: the optimum is {found:.3f} mm, proved",
        f"greedy has {tissue.greedy.travel_mm:.2f} there",
        f"tried up to {PROVE_UP_TO['default']} toolpaths,",
        f"with `--effort high` up to {PROVE_KNOWN_UP_TO['high']}",
        f"sheets of up to {MOST_COLUMNS} columns",
        f"up to {WINDOWS_UP_TO:,} toolpaths",
        f"more than {MOST_DOWN_SETS} down-sets",
        f"tried up to {CARRY_UP_TO['default']} toolpaths",
    ]


def rounds() -> list[str]:
    """What the page states of a search on its way, which another processor may round a little differently."""
    tissue = real()
    assert tissue.best.proved
    told = [one for one in tissue.searched[1] if one.stage == "search"]
    out = []
    for k, one in enumerate(told):
        cost, bound = one.cost, one.lower_bound or 0.0
        out.append(f"| {k + 1} | {cost:.3f} | {bound:.3f} | {100 * (cost - bound) / cost:.2f} % |")
    cost, bound, optimum = told[0].cost, told[0].lower_bound or 0.0, tissue.best.travel_mm
    out += [
        f"was {100 * (cost / optimum - 1):.2f} % above the optimum, "
        f"the bound {100 * (1 - bound / optimum):.2f} % below",
        f"which gives {100 * (cost / bound - 1):.2f} % for round 1",
    ]
    return out


def _power(number: int) -> str:
    """A large number with two digits and a power of ten."""
    digits = len(str(number)) - 1
    return f"{number / 10**digits:.1f}·10{str(digits).translate(RAISED)}"


if __name__ == "__main__":
    for path in draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"):
        print(f"{path.name}  {path.stat().st_size / 1000:.0f} kB")
    print(*facts(), sep="\n")
