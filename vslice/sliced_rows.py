"""What a user is told of a sliced sheet, row by row."""

from typing import TYPE_CHECKING

from vslice.pressed import pressed

if TYPE_CHECKING:  # it imports all that is heavy
    from slicer.sequence import Result
    from vslice.sliced import Sliced


def sliced_rows(sliced: "Sliced") -> dict[str, str]:
    """What a user wants to know of a sliced sheet."""
    plan, made = sliced.plan, sliced.program
    dropped = f"  ({sliced.lines.dropped} too short, dropped)" if sliced.lines.dropped else ""
    primed = f", {made.primed_mm:.2f} mm more to fill the nozzle" if made.primed_mm else ""
    feed = f" ({made.feed_mm:.2f} mm of feed{primed})" if made.feed_mm else ""
    room = sliced.room_ul
    result = sliced.result
    early = ", ended early" if result.stopped else ""
    # Rounded first, so that what is shown adds up.
    parts = [round(seconds, 1) for seconds in made.times]
    printing, between, other = parts
    least = f"at least {sliced.fewest_beads} in any order"
    joined = f"  ({plan.joined_mm:.1f} mm of hops extruded; {least})" if plan.joined.any() else f"  ({least})"
    rows = {
        "toolpaths": f"{sliced.printable.hatch_lines}{dropped}",
        "beads": f"{plan.beads}{joined}",
        "printed length": f"{plan.printed_mm:.1f} mm",
        "straight travel J": f"{plan.straight_mm:.3f} mm{_known_travel(result)}",
        "routed travel": f"{plan.routed_mm:.3f} mm{_known(result) if result.objective == 'routed' else ''}",
        "material": f"{made.material_ul:.1f} µL{feed}, {made.material_ul / room:.0%} of the room for it",
        "printing": f"{printing:.1f} s",
        "travel": f"{between:.1f} s",
        "before and after": f"{other:.1f} s",
        "estimated time": f"{sum(parts):.1f} s, without homing and heating",
        "saved": f"{_saved(sliced)}, by {result.method}{early}",
    }
    if sliced.recalled:
        rows["started from"] = "the last order of the same sheet (--fresh does not)"
    rows |= _nozzle_rows(sliced)
    rows["hanging"] = (
        f"{sliced.hanging.length_mm.sum():.1f} mm, {sliced.hanging.bridge_mm.max():.2f} mm at once"
    )
    if result.timed:
        rows["minimised"] = f"{result.cost:.1f} s of travels from stop to stop{_known(result)}"
    return rows


def _nozzle_rows(sliced: "Sliced") -> dict[str, str]:
    """What the nozzle's body took."""
    rows = {}
    if sliced.pressing is not None:
        rows["nozzle"] = pressed(sliced.pressing, sliced.profile)
    cut, forced = sliced.printable.cut, sliced.printable.pressed
    if cut is not None:
        rows["cut"] = (
            f"{cut.toolpaths_cut} of {sliced.printable.hatch_lines} toolpaths, {len(cut.segments)} pieces; "
            f"{cut.cuts} cuts, and no way takes fewer than {cut.fewest}"
        )
    if forced is not None:
        beyond = float((forced.depth_mm - sliced.printable.problem.body.press).sum())
        best = "the least possible" if forced.least else "as little as was found"
        rows["pressed"] = f"{len(forced.pairs)} times too deep, by {beyond:.3f} mm in all ({best})"
    return rows


def _saved(sliced: "Sliced") -> str:
    """What the order gained against the source paper's hill climbing, in the unit of the objective."""
    unit, objective = sliced.result.unit, sliced.result.objective
    what = "travel" if sliced.result.timed else f"{objective} travel"
    gained = sliced.greedy - sliced.travel
    part = gained / sliced.greedy if sliced.greedy else 0.0
    before = f"{sliced.greedy:.1f} {unit} of {what}"
    return f"{gained:.1f} {unit} of {before} ({part:.0%}) in the paper's greedy order"


def _known_travel(result: "Result") -> str:
    """What is known of the least straight travel, for people."""
    if result.travel_proved:
        return "  (the least possible)"
    if result.lower_bound_mm is not None:
        return f"  (at least {result.lower_bound_mm:.3f})"
    return ""


def _known(result: "Result") -> str:
    """What is known of the least cost by the objective, for people."""
    if result.proved:
        return "  (the least possible)"
    return "" if result.lower_bound is None else f"  (at least {result.lower_bound:.3f})"
