"""Programs for the tests of gcode/: from a grid all the way to text, and back to moves."""

import numpy as np

import profiles
from dialect.flavor import MARLIN
from gcode import emit, program
from gcode.parse import parse
from slicer import hatch, sequence, travel
from slicer.grid import Grid

BARE = "motion.prime_mm=0"
"""Programs of the print alone; the line that fills the nozzle has tests of its own (test_prime)."""
POINT = "nozzle.tip_width_mm=0"
"""The sheets of these tests are planned for the paper's nozzle; bodies have tests of their own."""
FACTS = {"version": "test", "method": "greedy"}


def make_grid(angles, spacing=0.25, tile=(1.0, 1.0), **rest):
    """A sheet with these angles, row 0 first."""
    angles = np.array([[np.nan if a is None else a for a in row] for row in angles], float)
    return Grid(angles, np.full(angles.shape, spacing), tile, **rest)


def make_plan(sheet, clearance_mm=0.2, join_mm=0.0):
    """(plan, spacing and tile of each toolpath in the order of printing)."""
    lines = hatch.hatch(sheet)
    chosen = sequence.solve(lines.segments, method="greedy")
    plan = travel.plan(
        lines.segments, chosen.order, chosen.flipped, clearance_mm=clearance_mm, join_mm=join_mm
    )
    tile = lines.tile[chosen.order]
    return plan, sheet.spacing_mm[tile[:, 1], tile[:, 0]], tile


def make_program(sheet, profile):
    """The program of a sheet for a profile."""
    return program.build(*_arguments(sheet, profile))


def _arguments(sheet, profile):
    plan, spacing, tile = make_plan(sheet, profile.motion.clearance_mm, profile.motion.join_mm)
    return plan, profile, spacing, tile


def make_lines(sheet, profile_name="marlin-generic", *settings):
    """The G-code of a sheet, a list of lines."""
    profile = profiles.load(profile_name, [BARE, POINT, *settings])
    return list(emit.emit(make_program(sheet, profile), profile, FACTS))


def read_lines(lines, plane="XZ", flavor=MARLIN):
    """Lines of G-code as moves."""
    return list(parse(lines, plane=plane, flavor=flavor))
