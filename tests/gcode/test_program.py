"""Moves of a plan: feed along the path in the plane, retraction and valves, the build volume."""

import math

import numpy as np
import pytest
from making import BARE, make_grid, make_plan, make_program

import profiles
from gcode import program
from gcode.bead import bead_area_mm2
from gcode.errors import BuildVolumeError
from gcode.moves import Kind


def moves_of(sheet, profile="marlin-generic", *settings):
    return make_program(sheet, profiles.load(profile, [BARE, *settings])).moves


def extrusions(moves):
    """(length, move) of every extrusion."""
    out, x, y = [], math.nan, math.nan
    for move in moves:
        if move.kind == Kind.EXTRUDE:
            out.append((math.hypot(move.x_mm - x, move.y_mm - y), move))
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE):
            x, y = move.x_mm, move.y_mm
    return out


@pytest.mark.parametrize("angle", [-60, -45, 0, 30, 90])
def test_feed_follows_the_path_in_the_plane_at_every_tilt(angle):
    laid = extrusions(moves_of(make_grid([[angle]])))
    assert len(laid) >= 3
    width, height = 0.4, 0.25
    area = (width - height) * height + math.pi / 4 * height**2
    for length, move in laid:
        assert move.e_mm == pytest.approx(length * area / (math.pi / 4 * 1.75**2))


def test_a_syringe_divides_by_its_bore():
    laid = extrusions(moves_of(make_grid([[-45]]), "marlin-syringe", 'material.bead_shape="circle"'))
    for length, move in laid:
        assert move.e_mm == pytest.approx(length * 0.4**2 / 12.0**2)


def test_flow_and_height_of_the_profile():
    plain, changed = (
        extrusions(moves_of(make_grid([[0]]), "marlin-generic", 'material.bead_shape="rectangle"', *settings))
        for settings in ([], ["material.flow=2.0", "material.height_mm=0.5"])
    )
    for (_, a), (_, b) in zip(plain, changed, strict=True):
        assert b.e_mm == pytest.approx(a.e_mm * 2 * 0.5 / 0.25)


def test_bead_areas():
    heights = np.array([0.2, 0.4, 0.8])
    areas = {
        shape: bead_area_mm2(
            profiles.load("marlin-generic", [f'material.bead_shape="{shape}"']).material, heights
        )
        for shape in ("rectangle", "stadium", "circle")
    }
    np.testing.assert_allclose(areas["rectangle"], [0.08, 0.16, 0.32])
    circle = math.pi / 4 * 0.16
    np.testing.assert_allclose(areas["circle"], [circle] * 3)
    np.testing.assert_allclose(areas["stadium"], [0.04 + math.pi / 4 * 0.04, circle, 0.16 + circle])


def test_the_lowest_bead_lies_on_the_bed():
    for offset in (0.0, -7.0):
        moves = moves_of(make_grid([[0]], origin_mm=(0.0, offset)), "marlin-generic", "machine.bed_z_mm=2.0")
        assert min(m.y_mm for m in moves if m.kind == Kind.EXTRUDE) == pytest.approx(2.0 + 0.25 / 2)


def test_the_first_move_goes_up_and_the_nozzle_arrives_from_above():
    moves = [m for m in moves_of(make_grid([[-45]])) if m.kind == Kind.TRAVEL]
    assert math.isnan(moves[0].x_mm)
    assert moves[0].y_mm == moves[1].y_mm == pytest.approx(moves[2].y_mm + 5.0)
    assert moves[1].x_mm == moves[2].x_mm
    last = moves_of(make_grid([[-45]]))
    top = max(m.y_mm for m in last if m.kind == Kind.EXTRUDE)
    assert [m for m in last if m.kind == Kind.TRAVEL][-1].y_mm == pytest.approx(top + 5.0)


def test_retraction_around_long_travels_only():
    sheet = make_grid([[-45, None, None, -45]])
    moves = moves_of(sheet, "marlin-generic", "motion.retract_extra_mm=0.1")
    feeds = [m.e_mm for m in moves if m.kind == Kind.FEED]
    assert feeds == [-1.0, 1.1, -1.0]  # over the gap and back, and at the end
    assert [
        m.e_mm for m in moves_of(sheet, "marlin-generic", "motion.retract_mm=0.0") if m.kind == Kind.FEED
    ] == []
    assert [m.e_mm for m in moves_of(make_grid([[-45]])) if m.kind == Kind.FEED] == [-1.0]


def test_firmware_retraction():
    kinds = [
        m.kind
        for m in moves_of(
            make_grid([[-45, None, None, -45]]), "marlin-generic", "motion.firmware_retraction=true"
        )
    ]
    assert kinds.count(Kind.FIRMWARE_RETRACT) == 2
    assert kinds.count(Kind.FIRMWARE_PRIME) == 1
    assert Kind.FEED not in kinds


def test_a_valve_opens_for_every_toolpath_and_closes_for_every_travel():
    moves = moves_of(make_grid([[-45, -30]]), "marlin-pneumatic")
    is_open, seen = False, 0
    for k, move in enumerate(moves):
        if move.text == "M106 S255":
            is_open, seen = True, seen + 1
            assert moves[k + 1].kind == Kind.DWELL
            assert moves[k + 1].seconds == 0.06
        elif move.text == "M107":
            is_open = False
        elif move.kind == Kind.EXTRUDE:
            assert is_open
            assert move.e_mm == 0
        elif move.kind == Kind.TRAVEL:
            assert not is_open
    assert seen == len(extrusions(moves))
    assert not is_open


def test_no_axis_is_asked_for_more_than_it_can():
    for length, move in extrusions(
        moves_of(make_grid([[90, -45, 10]]), "marlin-generic", "motion.print_speed_mm_s=150")
    ):
        assert move.speed_mm_s <= 150
        assert move.speed_mm_s * move.e_mm / length <= 50 + 1e-9
    steep = extrusions(moves_of(make_grid([[90]]), "marlin-generic", "motion.print_speed_mm_s=150"))
    assert {round(m.speed_mm_s, 9) for _, m in steep} == {10.0}


def test_outside_the_build_volume_names_tile_toolpath_axis_and_numbers():
    with pytest.raises(
        BuildVolumeError, match=r"tile \(1, 0\), toolpath \d+: X 220\.\d+ mm is outside .* 0 to 220 mm"
    ):
        moves_of(make_grid([[-45, -45]], tile=(120.0, 10.0), spacing=3.0))
    with pytest.raises(BuildVolumeError, match=r"Z 2\d\d\.\d+ mm is outside the build volume, 0 to 250 mm"):
        moves_of(make_grid([[-45]], tile=(10.0, 260.0), spacing=3.0))
    with pytest.raises(
        BuildVolumeError, match="fixed_mm 300 is outside the build volume: Y runs from 0 to 220"
    ):
        moves_of(make_grid([[-45]]), "marlin-generic", "machine.fixed_mm=300.0")
    with pytest.raises(BuildVolumeError, match="Y 22"):
        moves_of(make_grid([[-45]], tile=(220.0, 10.0), spacing=3.0), "marlin-generic", 'machine.plane="YZ"')


def test_a_route_may_leave_the_build_volume_too():
    angles = np.random.default_rng(0).uniform(-90, 90, (3, 3)).tolist()
    plan, spacing, tile = make_plan(make_grid(angles), clearance_mm=300.0)
    assert len(plan.via), "the sheet has no travel that must be routed"
    with pytest.raises(BuildVolumeError, match="the travel to toolpath"):
        program.build(plan, profiles.load("marlin-generic"), spacing, tile)


def test_time_and_material():
    made = make_program(make_grid([[0]]), profiles.load("marlin-generic"))
    assert made.material_ul == pytest.approx(made.feed_mm * math.pi / 4 * 1.75**2)
    assert made.seconds > 5 * 1.0 / 20


@pytest.mark.parametrize(
    ("grid", "setting", "says"),
    [
        (
            {"tile": (120.0, 10.0), "angles": [[-45, -45]]},
            "offset_mm=10.0",
            r"X 10\.000 to 250\.000 mm, 20\.000 mm more than the machine has: make the sheet smaller",
        ),
        (
            {"tile": (100.0, 10.0), "angles": [[0, 0]]},
            "offset_mm=40.0",
            r"it fits with \[machine\] offset_mm from 0 to 20, which is 40 now",
        ),
        (
            {"tile": (10.0, 10.0), "angles": [[0]]},
            "bed_z_mm=245.0",
            r"Z 2\d\d\.\d+ to 25\d\.\d+ mm, \d\.\d+ mm beyond it, since the bed is at \[machine\] bed_z_mm 245",
        ),
    ],
    ids=["too wide", "to be moved", "bed too high"],
)
def test_it_says_by_how_much_and_what_to_do(grid, setting, says):
    sheet = make_grid(grid["angles"], tile=grid["tile"], spacing=3.0)
    with pytest.raises(BuildVolumeError, match=says):
        moves_of(sheet, "marlin-generic", f"machine.{setting}")
