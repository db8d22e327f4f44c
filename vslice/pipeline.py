"""The main job, grid file to program: what ``slice`` writes and ``send`` streams."""

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import profiles
from gcode import program, volume
from gcode.bead import bead_height_mm, press_mm
from gcode.check import RESOLUTION_MM
from gcode.errors import BuildVolumeError
from gcode.moves import Kind
from gcode.pressing import Pressing, check_nozzle
from gcode.strokes import motions
from profiles import Profile, ProfileError
from slicer import hatch, sequence, travel
from slicer.cutting import overlapping
from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.hatch import Hatch
from slicer.joins import fewest_beads
from slicer.sequence import Result
from slicer.sequence.problem import Objective, Progress
from slicer.support import hanging_of
from slicer.travel import Plan
from vslice import __version__, last_order
from vslice.nozzle import body_of
from vslice.objective import join_mm, objective_name, objective_of
from vslice.pressed import nozzle_name
from vslice.printable import Conflicts, Printable, counted_join_mm, printable
from vslice.reading import read_grid
from vslice.sliced import Sliced, in_its_unit

MOST_META = 1000
"""Characters of ``meta`` in the head of a program; of more than that its hash is written."""


@dataclass(frozen=True)
class Search:
    """How an order of toolpaths is looked for; see ``sequence.solve``.

    With ``recall`` it starts from the last order of the same sheet, and what it comes to is kept; see
    ``vslice.last_order``.
    """

    method: str = "auto"
    effort: str = "default"
    objective: str = "time"
    start: str = "corner"
    conflicts: Conflicts = "cut"
    seed: int = 0
    time_limit_s: float | None = None
    workers: int = 1
    recall: bool = False


def meta_line(meta: Any) -> str:
    """The ``meta`` of a grid as one line of JSON in printable ASCII, for a comment in a program.

    Beyond ``MOST_META`` characters it is {"characters": how many, "sha256": of the whole line}.
    """
    text = json.dumps(meta, separators=(",", ":"))
    if len(text) <= MOST_META:
        return text
    digest = hashlib.sha256(text.encode("ascii")).hexdigest()
    return json.dumps({"characters": len(text), "sha256": digest}, separators=(",", ":"))


def hatched(sheet: Grid) -> Hatch:
    """The toolpaths of a grid.

    Raises:
        SlicerError: there are none.
    """
    lines = hatch.hatch(sheet)
    if len(lines.segments) == 0:
        if lines.dropped:
            limit = (
                "spacing_mm, the default" if sheet.min_length_mm is None else f"{sheet.min_length_mm:g} mm"
            )
            what = "its only line is" if lines.dropped == 1 else f"all {lines.dropped} lines are"
            why = f"{what} shorter than min_length_mm ({limit})"
        else:
            why = "all tiles are empty" if np.isnan(sheet.angles_deg).all() else "outline_mm leaves nothing"
        raise SlicerError(f"{sheet.source}: the sheet has no toolpaths: {why}.")
    return lines


def slice_grid(
    grid_file: Path | Grid,
    profile_name: str,
    overrides: tuple[str, ...],
    *,
    search: Search,
    step: Callable[[str], None],
    progress: Callable[[Progress], None] | None = None,
) -> Sliced:
    """Turn a grid into a program.

    Args:
        grid_file: - is standard input; or a grid that was read or measured before.
        step: told what begins.
        progress: told how the search for an order goes.
    """
    profile = profiles.load(profile_name, overrides)
    try:
        volume.check_machine(profile)
    except BuildVolumeError as error:
        raise ProfileError(f"{profile_name}: {error}.") from None
    step("reading")
    sheet = grid_file if isinstance(grid_file, Grid) else read_grid(grid_file)
    step("hatching")
    lines = hatched(sheet)
    # Said before the search, which takes minutes for a large sheet; where travels go is not known until then.
    col, row = lines.tile.T
    height = bead_height_mm(profile.material, sheet.spacing_mm[row, col])
    volume.check_sheet(lines.segments, height, profile, lines.tile)
    step("sequencing")
    shaped, objective, result, recalled = ordered(sheet, lines, profile, search, progress)
    lines, problem = shaped.lines, shaped.problem
    body = problem.body
    step("routing")
    plan = routed(sheet, shaped, result, profile)
    step("building")
    tile = lines.tile[result.order]
    made = program.build(plan, profile, sheet.spacing_mm[tile[:, 1], tile[:, 0]], tile, problem.body)
    # The same search of an order that the result came out of, but for its method: what it is compared with.
    simple = sequence.solve(problem, method="greedy", objective=objective, bounded=False)
    greedy_plan, greedy_made = laid_out(sheet, shaped, simple, profile)
    greedy = in_its_unit(result.objective, greedy_plan, greedy_made)
    facts = {
        "version": __version__,
        "grid_sha256": sheet.sha256,
        "profile": profile_name if profile_name in profiles.shipped() else Path(profile_name).name,
        "method": result.method,
        "objective": search.objective,
        "effort": search.effort + (" (ended early)" if result.stopped else ""),
        "seed": str(search.seed),
        "initial": "the last order of the same sheet" if recalled else "none",
        "toolpaths": str(len(lines.segments)),
        "beads": str(plan.beads),
        "travel_straight_mm": f"{plan.straight_mm:.3f}",
        "travel_routed_mm": f"{plan.routed_mm:.3f}",
        "printed_mm": f"{plan.printed_mm:.3f}",
    }
    if not body.is_point:
        facts["nozzle"] = nozzle_name(profile)
    if sheet.meta != {}:
        facts["meta"] = meta_line(sheet.meta)
    hangs = hanging_of(plan, made.height_mm)
    pressing = pressing_of(made, profile)
    other = profiles.taken_over(profile_name, overrides)
    spacing = sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]]
    beads = fewest_beads(lines.segments, join_mm(profile, spacing), shaped.ends)
    return Sliced(
        sheet, shaped, result, plan, made, profile, facts, greedy, pressing, hangs, recalled, beads, other
    )


class Ordered(NamedTuple):
    """The toolpaths of a sheet as a profile's nozzle can print them, what they cost, their order, and
    whether the search for it started from the last order of the same sheet.
    """

    printable: Printable
    objective: Objective
    result: Result
    recalled: bool


def ordered(
    sheet: Grid,
    lines: Hatch,
    profile: Profile,
    search: Search,
    progress: Callable[[Progress], None] | None = None,
) -> Ordered:
    """Make the toolpaths of a sheet printable with a profile's nozzle and order them.

    What cutting takes counts towards the time limit: the search has the rest of it.
    """
    begin = time.perf_counter()
    spacing = sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]]
    body = body_of(profile, spacing)
    nozzle = profile.nozzle
    shaped = printable(
        sheet.source, lines, search.start, body, nozzle.downhill_deg, search.conflicts, nozzle.overlap_mm
    )
    join = counted_join_mm(join_mm(profile, spacing), shaped.ends)
    objective = objective_of(profile, objective_name(search.objective), join)
    asked = last_order.asked(shaped.problem.body, profile.nozzle, objective, search, __version__)
    recalled = last_order.recall(lines.segments, shaped, asked) if search.recall else None
    limit_s = search.time_limit_s
    if limit_s is not None:
        limit_s = max(0.0, limit_s - (time.perf_counter() - begin))
    result = sequence.solve(
        shaped.problem,
        initial=recalled,
        method=search.method,
        effort=search.effort,
        time_limit_s=limit_s,
        seed=search.seed,
        objective=objective,
        workers=search.workers,
        progress=progress,
    )
    if search.recall:
        last_order.keep(lines.segments, shaped, result, asked)
    return Ordered(shaped, objective, result, recalled is not None)


def routed(sheet: Grid, shaped: Printable, result: Result, profile: Profile) -> Plan:
    """The routes of a sequence under a machine and its nozzle."""
    lines = shaped.lines
    spacing = sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]]
    body = body_of(profile, spacing)
    laid = None
    if shaped.cut is not None and profile.nozzle.overlap_mm > 0:
        laid = overlapping(shaped.cut, result.order, body, profile.nozzle.overlap_mm)
    return travel.plan(
        lines.segments,
        result.order,
        result.flipped,
        clearance_mm=profile.motion.clearance_mm,
        body=body,
        join_mm=join_mm(profile, spacing),
        ends=shaped.ends,
        laid=laid,
        downhill_deg=profile.nozzle.downhill_deg,
    )


def laid_out(
    sheet: Grid, shaped: Printable, result: Result, profile: Profile
) -> tuple[Plan, program.Program]:
    """Routes and moves of a sequence, whether the machine reaches them or not: for comparisons."""
    plan = routed(sheet, shaped, result, profile)
    tile = shaped.lines.tile[result.order]
    spacing = sheet.spacing_mm[tile[:, 1], tile[:, 0]]
    return plan, program.lay_out(plan, profile, spacing, body_of(profile, spacing))


def pressing_of(made: program.Program, profile: Profile) -> Pressing | None:
    """How deep the printed pushes into the nozzle, as the check will see it in the text."""
    laid = motions(made.moves, [move.kind == Kind.EXTRUDE for move in made.moves])
    return check_nozzle(laid, profile.nozzle, press_mm(profile.nozzle, made.height_mm), RESOLUTION_MM)[1]
