"""The check accepts what is right, and finds and names every kind of damage."""

import math
import re

import numpy as np
import pytest
from fields import grids
from hypothesis import assume, given, settings
from making import POINT, make_grid, make_lines, read_lines

import profiles
from gcode.check import check
from slicer.hatch import hatch

PROFILES = ["marlin-generic", "marlin-syringe", "marlin-pneumatic"]
SHEET = make_grid([[-45, -20], [30, 80]], spacing=0.2)


def violations(lines, profile="marlin-generic", grid=None, *settings):
    loaded = profiles.load(profile, [POINT, *settings])
    return check(read_lines(lines, loaded.machine.plane), loaded, grid).violations


def kinds(found):
    return {violation.kind for violation in found}


@settings(max_examples=60, deadline=None)
@given(grids())
@pytest.mark.parametrize("profile", PROFILES)
def test_every_sheet_passes(profile, sheet):
    assume(len(hatch(sheet).segments))
    assert violations(make_lines(sheet, profile), profile, sheet) == []


def test_lines_a_thousandth_apart_are_told_apart():
    """Two steep lines on either side of a border that only one of them reaches over."""
    nan = math.nan
    grid = make_grid([[nan, 0, 90], [nan, nan, nan], [nan, 89.97, -89.9]], spacing=0.2, tile=(2.0, 1.0))
    assert violations(make_lines(grid, "marlin-generic"), "marlin-generic", grid) == []


def test_the_other_plane_passes_too():
    lines = make_lines(SHEET, "marlin-generic", 'machine.plane="YZ"')
    assert violations(lines, "marlin-generic", SHEET, 'machine.plane="YZ"') == []
    assert "plane" in kinds(violations(lines, "marlin-generic", SHEET))


def test_a_foreign_program_without_our_comments_passes():
    lines = [line.lower() for line in make_lines(SHEET) if not line.startswith(";")]
    assert violations(lines, "marlin-generic", SHEET) == []


def test_firmware_retraction_and_extra_prime_pass():
    for setting in ("motion.firmware_retraction=true", "motion.retract_extra_mm=0.2"):
        lines = make_lines(make_grid([[-45, None, None, -45]]), "marlin-generic", setting)
        assert violations(lines, "marlin-generic", None, setting) == []


@pytest.mark.parametrize(("gone", "kind"), [("G10", "leak"), ("G11", "flow")])
def test_firmware_retraction_comes_in_pairs(gone, kind):
    setting = "motion.firmware_retraction=true"
    lines = make_lines(make_grid([[-45, None, None, -45]]), "marlin-generic", setting)
    assert kinds(violations([l for l in lines if l != gone], "marlin-generic", None, setting)) == {kind}


@pytest.mark.parametrize(
    "angles", [[[90, 89.99]], [[90, 89.9999999]], [[-0.01], [0.01]], [[0, 1e-14], [1e-14, 0]]]
)
@pytest.mark.parametrize("tile", [1.0, 5.0])
@pytest.mark.parametrize("with_grid", [True, False])
def test_lines_that_nearly_coincide_on_a_border_pass(angles, tile, with_grid):
    sheet = make_grid(angles, spacing=tile / 10, tile=(tile, tile))
    assert violations(make_lines(sheet), "marlin-generic", sheet if with_grid else None) == []


def test_feeds_below_the_last_decimal_still_extrude():
    wide = ["material.syringe_bore_mm=40.0", "material.width_mm=0.1"]
    lines = make_lines(SHEET, "marlin-syringe", *wide)
    assert not any(line.endswith("E0.00000") or " E0.00000 " in line for line in lines)
    assert "missing" not in kinds(violations(lines, "marlin-syringe", SHEET, *wide))


def toolpath_blocks(lines):
    """(head, the lines of each toolpath, tail)."""
    at = [k for k, line in enumerate(lines) if line.startswith(";TOOLPATH")]
    end = max(k for k, line in enumerate(lines) if line == ";TYPE:Custom")
    bounds = [*at, end]
    return lines[: at[0]], [lines[a:b] for a, b in zip(bounds, bounds[1:], strict=False)], lines[end:]


def extrusion(lines, nth=5):
    return [
        k
        for k, line in enumerate(lines)
        if line.startswith("G1 ") and "E" in line and re.search("[XZ]", line)
    ][nth]


def absolute(lines):
    """The same program with X and Z in every movement, so that lines can change places."""
    at, out = {}, []
    for line in lines:
        words = line.split()
        if words and words[0] in ("G0", "G1") and any(word[0] in "XZ" for word in words[1:]):
            at |= {word[0]: word for word in words[1:] if word[0] in "XYZ"}
            rest = [word for word in words[1:] if word[0] not in "XYZ"]
            line = " ".join([words[0], *(at[axis] for axis in "XZ" if axis in at), *rest])
        out.append(line)
    return out


def swapped(lines):
    """Upside down: the toolpaths of the program from the last to the first."""
    head, blocks, tail = toolpath_blocks(absolute(lines))
    return [*head, *(line for block in reversed(blocks) for line in block), *tail]


def without_one(lines):
    head, blocks, tail = toolpath_blocks(absolute(lines))
    extrudes = [k for k, line in enumerate(blocks[7]) if line.startswith("G1 X")]
    blocks[7] = [
        line.replace("G1", "G0").split(" E")[0] if k in extrudes else line for k, line in enumerate(blocks[7])
    ]
    return [*head, *(line for block in blocks for line in block), *tail]


def twice(lines):
    head, blocks, tail = toolpath_blocks(absolute(lines))
    back = absolute([*head, *blocks[0]])[-1]
    start = next(line for line in reversed(absolute(head)) if line.startswith("G0") and "X" in line)
    return [*head, *blocks[0], start, back, *(line for block in blocks[1:] for line in block), *tail]


def edited(change, nth=5):
    def damage(lines):
        k = extrusion(lines, nth)
        return [*lines[:k], *change(lines[k]), *lines[k + 1 :]]

    return damage


def through_the_print(lines):
    """After the last toolpath, straight through the whole sheet from side to side at half height."""
    return [*lines[:-6], "G0 X9.000 Z1.000 F600", "G0 X13.000 Z1.000", *lines[-6:]]


DAMAGE = {
    "upside down": (swapped, "printability", r"extrusion to \(.*\) passes \d\.\d+ mm below what line \d+ printed, at"),
    "travel through material": (through_the_print, "collision", r"travel to \(13.000, 1.000\) passes \d\.\d+ mm below"),
    "left out": (without_one, "missing", r"tile \(\d, \d\): its hatch line from .* is not printed"),
    "printed twice": (twice, "twice", r"a hatch line of tile \(0, 0\) that is printed by another line too"),
    "moved aside": (edited(lambda l: [re.sub(r"X(\S+)", lambda m: f"X{float(m[1]) + 0.05:.3f}", l)]), "stray", "is no hatch line"),
    "outside": (edited(lambda l: [re.sub(r"X\S+", "X230.000", l)]), "volume", "X 230.000 is outside the build volume, 0 to 220 mm"),
    "below the bed": (edited(lambda l: [re.sub(r"Z\S+", "Z-0.500", l)]), "volume", "Z -0.500 is outside the build volume"),
    "too fast": (edited(lambda l: [re.sub(r" F\S+|$", " F9000", l, count=1)]), "speed", "Z would move at .* its limit is 10"),
    "too much": (edited(lambda l: [re.sub(r"E(\S+)", lambda m: f"E{1.1 * float(m[1]):.5f}", l)]), "flow", "per mm, others"),
    "too little": (edited(lambda l: [re.sub(r"E(\S+)", lambda m: f"E{0.9 * float(m[1]):.5f}", l)]), "flow", "per mm, others"),
    "rapid that extrudes": (edited(lambda l: [l.replace("G1", "G0")]), "leak", "extrudes .* while travelling"),
    "drawn back": (edited(lambda l: ["G1 E-2.00000 F1800", l]), "flow", "extrudes while the feed is drawn back by 2.0"),
    "blob": (edited(lambda l: ["G1 E0.50000 F1800", l]), "leak", "feeds 0.50000 mm more than was drawn back"),
    "out of the plane": (edited(lambda l: [l + " Y111.000"]), "plane", "leaves the plane of the sheet by 1.000 mm"),
    "beside the plane": (lambda ls: [*ls[:40], "G0 Y140.000", *ls[40:]], "plane", "extrudes at 140.000 across the sheet, which stands at 110.000"),
    "no speed": (lambda ls: [re.sub(r" F\S+", "", l) if l[0] == "G" else l for l in ls], "speed", "before any speed above 0"),
    "flow factor": (lambda ls: ["M221 S300", *ls], "command", "M221 S300 is not followed"),
    "other tool": (lambda ls: ["T1", *ls], "command", "T1 is not followed"),
    "all too thick, comments gone": (lambda ls: [re.sub(r"(G1 .*)E(\d\S*)", lambda m: f"{m[1]}E{2 * float(m[2]):.5f}", l) for l in ls if l[0] != ";"], "flow", "the profile's bead needs"),
    "all too thick": (lambda ls: [re.sub(r"(G1 .*)E(\d\S*)", lambda m: f"{m[1]}E{1.5 * float(m[2]):.5f}", l) for l in ls], "flow", "the profile's bead needs"),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGE)
def test_every_kind_of_damage_is_found_and_named(name):
    damage, kind, says = DAMAGE[name]
    lines = make_lines(SHEET)
    damaged = damage(lines)
    assert damaged != lines
    found = [
        violation for violation in violations(damaged, "marlin-generic", SHEET) if violation.kind == kind
    ]
    assert found, f"only {kinds(violations(damaged, 'marlin-generic', SHEET))}"
    assert re.search(says, found[0].message)
    assert all((violation.line == 0) == (kind == "missing") for violation in found)


@pytest.mark.parametrize(
    ("damage", "kind"),
    [
        (
            lambda ls: [line for k, line in enumerate(ls) if not (line == "M107" and k > 40 and k < 60)],
            "leak",
        ),
        (lambda ls: [line for line in ls if not line.startswith("G4 ")], "flow"),
        (lambda ls: ["M106 S250" if line == "M106 S255" else line for line in ls], "missing"),
    ],
    ids=["valve stays open", "valve is given no time", "valve never opens"],
)
def test_valves(damage, kind):
    lines = make_lines(SHEET, "marlin-pneumatic")
    assert violations(lines, "marlin-pneumatic", SHEET) == []
    assert kind in kinds(violations(damage(lines), "marlin-pneumatic", SHEET))


def test_a_violation_names_the_line_that_an_editor_shows():
    lines = make_lines(SHEET)
    k = extrusion(lines)
    lines[k] = re.sub(r"X\S+", "X230.000", lines[k])
    outside = [violation for violation in violations(lines) if violation.kind == "volume"]
    assert [violation.line for violation in outside] == [k + 1]
    assert str(outside[0]).startswith(f"line {k + 1}: volume: X 230.000")


def test_lines_may_be_drawn_in_several_straight_movements():
    lines = ["M109 S200", "G92 X0 Y110 Z0", "M83", "G0 X10 Z0.05 F600"]
    sheet = make_grid([[0]], spacing=0.6, tile=(1.0, 1.0))
    whole = float(
        next(line for line in make_lines(sheet) if line.startswith("G1 X")).split("E")[1].split()[0]
    )
    lines += [f"G1 X10.5 E{whole / 2:.5f}", f"G1 X11 E{whole / 2:.5f}"]
    found = violations(lines, "marlin-generic", sheet)
    assert kinds(found) == set()


def test_two_hatch_lines_that_meet_end_to_end_are_two():
    """Tiles whose lines go on in the next tile: neither is missing, neither is twice."""
    sheet = make_grid([[0, 0]], spacing=0.3)
    assert violations(make_lines(sheet), "marlin-generic", sheet) == []


@pytest.mark.parametrize("with_grid", [True, False])
def test_uprights_of_one_x_are_printed_from_below(with_grid):
    sheet = make_grid([[90], [90]])
    grid = sheet if with_grid else None
    assert violations(make_lines(sheet), "marlin-generic", grid) == []
    assert "printability" in kinds(violations(swapped(make_lines(sheet)), "marlin-generic", grid))


def test_an_order_that_rounding_hides_is_seen_with_the_grid():
    """Lines that lean by less than the last decimal: only the grid tells that one is above the other."""
    sheet = make_grid([[89.98], [89.98]], spacing=0.3)
    lines = make_lines(sheet)
    assert violations(lines, "marlin-generic", sheet) == []
    found = violations(swapped(lines), "marlin-generic", sheet)
    assert any("the hatch line that it prints" in violation.message for violation in found)


def test_the_report_counts_what_it_saw():
    profile = profiles.load("marlin-generic")
    lines = make_lines(SHEET)
    report = check(read_lines(lines), profile)
    lengths = np.hypot(*(hatch(SHEET).segments[:, 1] - hatch(SHEET).segments[:, 0]).T)
    assert report.extrusions == len(lengths)
    assert report.printed_mm == pytest.approx(lengths.sum(), abs=0.001 * len(lengths))
    assert report.travel_mm > 0


def test_a_program_that_is_cut_off_is_incomplete():
    lines = ["; vslice toolpaths = 99", *make_lines(SHEET)]
    (found,) = violations(lines)
    assert "its head speaks of 99 toolpaths" in found.message


def test_a_program_that_prints_nothing_is_refused():
    (found,) = violations(["; nothing"])
    assert (found.kind, found.line) == ("missing", 0)
    assert "nothing is extruded" in found.message
    assert kinds(violations(["; nothing"], "marlin-generic", SHEET)) == {"missing"}


@pytest.mark.parametrize("x", [10.5, 11.3, 11.7])
def test_a_travel_straight_down_into_the_print_is_a_collision(x):
    lines = make_lines(make_grid([[-45, -20], [30, 80]], spacing=0.2))
    last = max(k for k, line in enumerate(lines) if line.startswith("G1") and " E" in line)
    down = [*lines[: last + 1], "G0 Z20 F600", f"G0 X{x} F6000", "G0 Z0.05 F600", *lines[last + 1 :]]
    collision, *_ = [v for v in violations(down) if v.kind == "collision"]
    assert f"travel to ({x:.3f}, 0.050) passes" in collision.message
    assert collision.line == last + 4


def cut(line, *parts):
    """The moves of a toolpath's block, drawn in parts from one share of it to another, with travels between."""
    x0, y0, x1, y1 = line
    out = []
    for begin, end in parts:
        (ax, ay), (bx, by) = ((x0 + t * (x1 - x0), y0 + t * (y1 - y0)) for t in (begin, end))
        out += [
            f"G0 X{ax:.3f} Z{ay:.3f} F600",
            f"G1 X{bx:.3f} Z{by:.3f} E{0.012 * np.hypot(bx - ax, by - ay):.5f} F1200",
        ]
    return out


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ([(0.0, 0.4), (0.4, 1.0)], []),
        ([(0.0, 0.4), (1.0, 0.3)], []),
        ([(0.6, 1.0), (0.0, 0.6)], []),
        ([(0.0, 0.4), (0.6, 1.0)], ["missing"]),
        ([(0.0, 0.4)], ["missing"]),
        ([(0.0, 0.7), (0.3, 0.6), (0.7, 1.0)], ["twice"]),
    ],
)  # fmt: skip
def test_a_hatch_line_may_be_printed_in_pieces_at_different_times(parts, says):
    sheet = make_grid([[20]], spacing=0.5)
    lines = hatch(sheet).segments
    order = np.argsort(lines[:, :, 1].sum(axis=1))
    moves = ["; vslice shift_mm = 0.000000 0.000000", "M302 P1", "M83", "G0 X0 Y110 Z5 F600"]
    for k in order[:-1]:
        moves += cut(lines[k].ravel(), (0.0, 1.0))
    moves += cut(lines[order[-1]].ravel(), *parts)
    found = violations(moves, "marlin-generic", sheet)
    assert [v.kind for v in found if v.kind in ("missing", "twice", "stray")] == says
    assert "printability" not in kinds(found)
