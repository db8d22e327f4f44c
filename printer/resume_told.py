"""How an interrupted job goes on, in words."""

from bisect import bisect_right

from printer.commands import Program
from printer.records import Entry
from printer.safety import number


def way(target: dict[str, float], axis: str, safe: float, doubt: str | None) -> tuple[str, ...]:
    """How the nozzle gets to ``target`` over what stands; ``doubt`` is why it homes first, if it does."""
    place = ", ".join(f"{a} {number(v)}" for a, v in target.items())
    return (
        *([f"{doubt}: it homes first, as the profile says."] if doubt else []),
        f"The nozzle rises to {axis} {number(safe)}, crosses over the print, and comes down at {place} (mm).",
    )


def where_it_goes_on(
    program: Program, entry: Entry, start: int, carried_out: int | None = None
) -> tuple[str, ...]:
    """How far the job came, and what is printed again if command ``start`` is the next.

    ``carried_out`` commands were, as the printer's place tells; None if it does not.
    """
    done = program.index_of_line(entry.acknowledged_line) if carried_out is None else carried_out
    came = f"acknowledged up to line {entry.furthest_line}, job {entry.ended or 'cut off'}"
    if entry.furthest_line > entry.acknowledged_line:
        came += f" again after it had gone back to line {program.lines[start]}"
    if carried_out is not None:
        came += f", and the printer stands where line {program.acknowledged_line(done)} leads"
    line = program.lines[start] if start < len(program) else program.acknowledged_line(start)
    toolpath = bisect_right(program.toolpaths, start) - 1
    what = f"toolpath {toolpath} begins" if program.toolpaths else "the last travel move begins"
    if start >= done:
        going = f"Going on at line {line}, where {what.replace('last', 'next')}; nothing is printed twice."
    elif bisect_right(program.toolpaths, done - 1) - 1 == toolpath or not program.toolpaths:
        going = (
            f"Going back to line {line}, where {what} that was under way; what it printed is printed again."
        )
    else:
        going = (
            f"Going back to line {line}, where {what}: it and what follows may not have been carried out, "
            "though acknowledged. What was printed from there on stands in the way and is printed again."
        )
    return f"{program.name}: {came}.", going
