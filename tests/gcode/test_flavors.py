"""Programs of all four flavours: the same print in each, written as its firmware wants it and read back."""

import re

import numpy as np
import pytest
from making import BARE, POINT, make_grid, make_lines, read_lines

import profiles
from dialect.flavor import FLAVORS, MARLIN, flavor_called
from gcode import carried
from gcode.check import check
from gcode.estimate import seconds_of
from gcode.limits import Dynamics
from gcode.moves import Kind
from gcode.preview import Drawing, not_drawn
from profiles import ProfileError
from slicer.hatch import hatch

SHEET = make_grid([[-45, -20], [30, 90]])
SHIPPED = [name for name in profiles.shipped() if name != "paper"]


def made(name, *settings):
    """(lines, moves, profile) of the sheet."""
    profile = profiles.load(name, [BARE, POINT, *settings])
    lines = make_lines(SHEET, name, *settings)
    return lines, read_lines(lines, flavor=profile.flavor), profile


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_machine_prints_what_the_check_passes(name):
    lines, moves, profile = made(name)
    assert check(moves, profile, SHEET).violations == []
    assert f";FLAVOR:{profile.flavor.title}" in lines[:3]
    assert seconds_of(moves, profile).sum() > 1
    assert not_drawn(moves, profile) == []
    drawn = Drawing.of_moves(moves, profile)
    assert len(drawn.toolpaths) == len(hatch(SHEET).segments)
    assert len(drawn.travels) == len(Drawing.of_moves(*made(f"marlin-{name.partition('-')[2]}")[1:]).travels)
    # Read as another firmware's it would be another print, or none.
    if name.startswith("grbl"):
        assert check(moves, profiles.load("marlin-generic", [POINT]), SHEET).violations != []


@pytest.mark.parametrize("feed", ["generic", "syringe", "pneumatic"])
def test_the_print_is_the_same_whatever_the_flavour(feed):
    laid = {}
    for name in (name for name in SHIPPED if name.endswith(feed)):
        _, moves, _ = made(name)
        laid[name] = [
            (m.x_mm, m.y_mm, m.e_mm, m.speed_mm_s)
            for m in moves
            if m.kind in (Kind.EXTRUDE, Kind.FEED, Kind.TRAVEL)
        ]
    first, *others = laid.values()
    assert len(others) == (2 if feed == "generic" else 3)
    for other in others:
        np.testing.assert_allclose(np.nan_to_num(other), np.nan_to_num(first), atol=1.1e-5)


def test_grbl_gets_words_that_it_has():
    lines = made("grbl-syringe")[0]
    commands = [line for line in lines if not line.startswith(";")]
    assert {re.split(r"[ ;]", line)[0] for line in commands} == {
        "$H",
        "G54",
        "G92",
        "G21",
        "G90",
        "G94",
        "G0",
        "G1",
        "M2",
    }
    assert max(map(len, commands)) < 80
    assert max(map(len, lines)) < 100  # comments too, but for where they cannot be cut beside a blank
    assert carried.read([line[1:] for line in lines if line[0] == ";"], "part").profile.gcode.flavor == "grbl"
    assert not any("E" in line for line in commands)
    along = [float(word[1:]) for line in commands[3:] for word in line.split() if word[0] == "A"]
    drawn_back = profiles.load("grbl-syringe").motion.retract_mm
    assert min(np.diff(along)) == pytest.approx(-drawn_back)  # absolute: it grows but for what is drawn back
    valve = made("grbl-pneumatic")[0]
    assert "G4 P0.060" in valve
    assert valve[valve.index("M8") + 1].startswith("G4 P")


@pytest.mark.parametrize(
    ("name", "command", "says"),
    [
        ("klipper-generic", "M302 P1", "is no command of Klipper"),
        ("klipper-generic", "M205 X8", "is no command of Klipper"),
        ("klipper-generic", "G4 S1", "has no time that is followed"),
        ("grbl-syringe", "M106 S255", "is no command of Grbl"),
        ("grbl-syringe", "G28", "is not followed"),
        ("grbl-syringe", "G55", "is not followed"),
        ("grbl-pneumatic", "M8 ", None),
        ("reprapfirmware-generic", "M203 X1", "sets X to 1; 6 to 600000 are taken here"),
        ("reprapfirmware-generic", "M204 P100 T100", None),
        ("klipper-generic", "SET_VELOCITY_LIMIT ACCEL=500", None),
        ("klipper-generic", "SET_VELOCITY_LIMIT VELOCITY=500", "is not followed in the middle"),
        ("klipper-generic", "SET_GCODE_OFFSET Z=1", "puts the tool elsewhere"),
        ("marlin-generic", "M218 T1 X5", "puts the tool elsewhere"),
        ("reprapfirmware-generic", "G10 P0 X5", "puts the tool elsewhere"),
        ("reprapfirmware-generic", "G10", None),
        ("grbl-syringe", "G10 L20 P1 X5", "puts the tool elsewhere"),
        ("grbl-syringe", "G43.1 Z2", "puts the tool elsewhere"),
        ("klipper-generic", "RESPOND MSG=half", None),
        ("klipper-generic", "RESPOND MSG=action:cancel", "asks the host"),
        ("klipper-generic", "SET_DISPLAY_TEXT MSG=half", None),
        ("marlin-generic", "M117 half", None),
        ("grbl-syringe", "M117", "is no command of Grbl"),
    ],
)
def test_the_check_knows_what_each_firmware_knows(name, command, says):
    lines, _, profile = made(name)
    middle = lines.index(";TOOLPATH 5")
    lines.insert(middle, command)
    found = check(read_lines(lines, flavor=profile.flavor), profile).violations
    mine = [v for v in found if v.line == middle + 1 and v.kind == "command"]
    assert [says in v.message for v in mine] == [True] if says else mine == []


def test_a_valve_of_reprapfirmware_waits_for_the_moves_before_it():
    lines, _, profile = made("reprapfirmware-pneumatic")
    assert all(lines[k - 1] == "M400" for k, line in enumerate(lines) if line == "M42 P0 S1")
    bare = [line for line in lines if line != "M400"]
    assert {v.kind for v in check(read_lines(bare, flavor=profile.flavor), profile).violations} == {"flow"}
    assert "M400" not in made("klipper-pneumatic")[0]


def test_what_a_firmware_does_not_have_is_refused():
    for setting, says in (
        ("motion.firmware_retraction=true", "has none"),
        ("gcode.progress_m73=true", "no M73"),
    ):
        with pytest.raises(ProfileError, match=says):
            profiles.load("grbl-syringe", [setting])
    for name, line, says in (
        ("klipper-generic", "M302 P1", r"start, line 2: 'M302 P1': M302 is no command of Klipper; if yours"),
        ("klipper-generic", "M201 X500", "M201 is no command of Klipper"),
        ("grbl-syringe", "M104 S200", "M104 is no command of Grbl"),
    ):
        home = profiles.load(name).flavor.homing
        with pytest.raises(ProfileError, match=says):
            profiles.load(name, [f'gcode.start=["{home}", "{line}"]'])
    allowed = 'gcode.allowed_commands=["M302"]'
    assert profiles.load("klipper-generic", ['gcode.start=["G28", "M302 P1"]', allowed])
    with pytest.raises(ProfileError, match="grbl has no axis E"):
        profiles.load("grbl-syringe", ['gcode.end=["G1 E5"]'])
    with pytest.raises(ProfileError, match="no comment in parentheses"):
        profiles.load("klipper-generic", ['gcode.end=["M84 (off)"]'])


@pytest.mark.parametrize(
    ("name", "command", "changed"),
    [
        ("reprapfirmware-generic", "M203 X3000", {"speed": 50.0}),
        ("marlin-generic", "M203 X50", {"speed": 50.0}),
        ("klipper-generic", "M203 X50", {}),
        ("klipper-generic", "M204 P100", {}),
        ("klipper-generic", "M204 P100 T90", {"printing": 90.0, "travelling": 90.0}),
        ("klipper-generic", "SET_VELOCITY_LIMIT ACCEL=77", {"printing": 77.0, "travelling": 77.0}),
        ("grbl-syringe", "M204 S100", {}),
    ],
)
def test_limits_change_as_the_firmware_obeys(name, command, changed):
    before = Dynamics.of(profiles.load(name))
    after = before.after(command)
    assert (after.speed.x if "speed" in changed else None) == changed.get("speed")
    assert (after.printing, after.travelling) == (
        changed.get("printing", before.printing),
        changed.get("travelling", before.travelling),
    )


def test_corners_of_grbl_and_reprapfirmware():
    """Two moves at a right angle: grbl by junction deviation, RepRapFirmware by the jerk of each axis."""
    lines = ["$H", "G90", "G0 X50 Y50 Z50 F6000", "G1 X60 F1200", "G1 Y60", "G1 X70"]
    base = [
        "machine.max_acceleration_mm_s2=[1000.0, 1000.0, 1000.0, 1000.0]",
        "motion.print_acceleration_mm_s2=1000.0",
    ]
    base += ["motion.travel_acceleration_mm_s2=1000.0"]

    def corners(name, *settings):
        profile = profiles.load(name, [*base, *settings])
        text = lines if name.startswith("grbl") else ["G28", *lines[1:]]
        return seconds_of(read_lines(text, flavor=profile.flavor), profile)[-2]

    ramp = 20 / 1000  # seconds to 20 mm/s
    stops = 10 / 20 + ramp
    assert corners("reprapfirmware-generic", "machine.jerk_mm_s=[0.001, 0.001, 1.0, 1.0]") == pytest.approx(
        stops, abs=1e-4
    )
    assert corners("reprapfirmware-generic", "machine.jerk_mm_s=[20.0, 20.0, 1.0, 1.0]") == pytest.approx(
        10 / 20
    )
    half = corners("reprapfirmware-generic", "machine.jerk_mm_s=[10.0, 10.0, 1.0, 1.0]")
    assert half == pytest.approx(10 / 20 + 2 * (0.01 - (0.01 * 15) / 20))  # from 10 to 20 mm/s at either end
    tight = corners("grbl-syringe", "machine.junction_deviation_mm=0.0001")
    assert (
        corners("grbl-syringe", "machine.junction_deviation_mm=1.0") < tight == pytest.approx(stops, abs=1e-3)
    )


@pytest.mark.parametrize("name", SHIPPED)
def test_accelerations_and_messages_as_each_firmware_takes_them(name):
    flavor = name.partition("-")[0]
    both = ["motion.print_acceleration_mm_s2=300.0", "motion.travel_acceleration_mm_s2=300.0"]
    settings = [*both, "gcode.set_accelerations=true", 'gcode.message="sheet of {width_mm} mm"']
    if flavor == "grbl":
        for setting, says in ((settings[2], r"takes them as \$ settings"), (settings[3], "has no display")):
            with pytest.raises(ProfileError, match=says):
                profiles.load(name, [setting])
        return
    lines, moves, profile = made(name, *settings)
    width = f"{profile.material.width_mm:g}"
    retract = f"{profile.motion.retract_acceleration_mm_s2:g}"
    wanted = {
        "marlin": [f"M204 P300 R{retract} T300", f"M117 sheet of {width} mm"],
        "klipper": ["SET_VELOCITY_LIMIT ACCEL=300", f"M117 sheet of {width} mm"],
        "reprapfirmware": ["M204 P300 T300", f'M117 "sheet of {width} mm"'],
    }[flavor]
    at = lines.index("M83")
    assert lines[at + 1 : at + 3] == wanted
    assert check(moves, profile, SHEET).violations == []
    limits = Dynamics.of(profiles.load(name)).after(wanted[0])
    assert (limits.printing, limits.travelling) == (300.0, 300.0)


def test_accelerations_and_messages_that_cannot_be_said():
    one = ["gcode.set_accelerations=true", "motion.travel_acceleration_mm_s2=700.0"]
    with pytest.raises(ProfileError, match="Klipper has one .* is 1000 and travel_acceleration_mm_s2 700"):
        profiles.load("klipper-generic", one)
    assert profiles.load("marlin-generic", one)
    for text, says in (("a;b", "holds a ;"), ("{widht_mm}", "did you mean"), ("x" * 120, "takes at most")):
        with pytest.raises(ProfileError, match=f"message.*{says}"):
            profiles.load("marlin-generic", [f'gcode.message="{text}"'])


def test_the_head_is_one_that_hosts_know():
    assert made("marlin-generic")[0][:2] == ["; generated by vslice test", ";FLAVOR:Marlin"]
    pattern = r"; generated by (.+?) on \d{4}-\d{2}-\d{2} at \d{2}:\d{2}:\d{2}"  # as Moonraker looks for it
    assert re.match(pattern, made("klipper-generic")[0][0])[1] == "vslice test"
    assert [flavor_called(flavor.title) for flavor in FLAVORS.values()] == list(FLAVORS.values())
    assert flavor_called(" marlin ") is MARLIN
    assert flavor_called("Griffin") is None
