"""In a print only what the replay follows may stand; every other command is named."""

from pathlib import Path

import pytest
from making import make_grid, make_lines, read_lines

import profiles
from gcode.check import check
from gcode.followed import check_commands
from gcode.parse import read_moves
from printer.commands import read_program

CASES = Path(__file__).parents[1] / "data" / "cases"
SHEET = make_grid([[-45, -20], [30, 80]], spacing=0.2)


def found(lines, profile="paper", *settings):
    loaded = profiles.load(str(profile), ["nozzle.tip_width_mm=0", *settings])
    return check(read_lines(lines, loaded.machine.plane), loaded).violations


def inserted(line, profile="paper", *settings, where=0.5):
    lines = make_lines(SHEET, str(profile), *settings)
    at = [k for k, text in enumerate(lines) if text.startswith(";TOOLPATH")]
    k = at[int(len(at) * where)] if where < 1 else len(lines)
    return [*lines[:k], *line.split("\n"), *lines[k:]]


@pytest.mark.parametrize(
    "command",
    """G28 Z|G28|G29|G29 A|G30|G38.2 Z-5|G26|G27|G34|G61|G12|M600|M125|M92 E500|M851 Z1|M218 T1 X5|G10 L2 P1 X5
    M502|M84|M18|M112|M104 S0|M104 S20|M104|M109 R0|M140 S0|M104 T1 S200|M98 P1|M32 a.g|M23 a.g|M24|O100|G1 A5|G1 X11 A5
    G0 B1|G1 U2|G1 X11 I5|G1 S1|PRINT_END|PAUSE|G20|G91 X5|G92|G92 X0|G92 X5 E0|G2 X1 I1|G5 X1|G53|G54|G59.3|G68|G92.1
    G1.1 X5|G91.1|G28.1|M206 X1|M290 Z1|M428|M220 S50|M221 S95|M200 S1|T0|T1|M203 X5|M205 S50|M204 P0|M201 X0|M204
    M302 P1|M42 P4 S1|M280 P0 S90|M3 S100|M126|M0|M1 wait|M25|M226|M118 A1 action:cancel|M118 //action:pause|M810 G28|M811
    M900 K1|M17|M81|M999|M410|M500|M501|M420 S1|M665 R1|G17|G18|G93|G51 X2|G43|M48|G33|G35|M106 T2|M486 S1|M571 F1|D1
    G10 P1|G10 S1|M400 P1|M82 X1""".replace("\n", "|").split("|"),
)  # fmt: skip
def test_what_is_not_followed_is_named_in_the_middle(command):
    command = command.strip()
    violations = found(inserted(command))
    kinds = [v.kind for v in violations if command in v.message]
    assert kinds in (["command"], ["flow", "command"], ["command", "collision"])


@pytest.mark.parametrize(
    "command",
    """G4 P10|G4 S0|G21|M83|M400|G92 E0|M104 S205|M109 S200|M109 R200|M140 S50|M190 S60|M106 S128|M106 S1 P1|M107
    M117 Layer 3|M118 hello|M73 P50 R3|M201 X500 Y500|M204 S500|M204 P500 T800|M205 X8 Y8|M205 J0.02|M220 S100|M221 S100.0
    M105|M114|G1 F600""".replace("\n", "|").split("|"),
)  # fmt: skip
def test_what_is_followed_may_stand_in_the_middle(command):
    assert found(inserted(command.strip())) == []


def test_a_profile_may_allow_more_by_name():
    lines = inserted("M900 K0.05\nPAUSE_HERE NOW=1")
    assert {v.kind for v in found(lines)} == {"command"}
    assert found(lines, "paper", 'gcode.allowed_commands=["m900", "PAUSE_HERE"]') == []


@pytest.mark.parametrize("command", ["G28 Z", "G28"])
def test_homing_down_into_the_sheet_that_stands_is_named(command):
    (violation,) = found(inserted(command, where=1))
    assert "into the sheet that stands" in violation.message
    assert found(inserted(command, where=1), "paper", "printer.build_axis_homes_up=true") == []
    assert found(inserted("G28 X Y", where=1)) == []


@pytest.mark.parametrize("up", ["true", "false"])
@pytest.mark.parametrize(
    "command",
    [
        "G29",
        "G30",
        "G32",
        "G34",
        "G80",
        "BED_MESH_CALIBRATE",
        "Z_TILT_ADJUST",
        "QUAD_GANTRY_LEVEL",
        "START_PRINT A=1",
    ],
)
def test_probing_down_into_the_sheet_that_stands_is_named_wherever_the_axis_homes(command, up):
    (violation,) = found(inserted(command, where=1), "paper", f"printer.build_axis_homes_up={up}")
    assert "into the sheet that stands" in violation.message


@pytest.mark.parametrize(
    "command",
    [
        "M118 A1 action:cancel",
        "M118 A1 act\\ion:cancel",
        'RESPOND TYPE=command MSG="action:cancel"',
        'RESPOND PREFIX="//" MSG=action:pause',
    ],
)
@pytest.mark.parametrize("where", [1, None])
def test_what_asks_the_host_for_an_action_is_named(command, where):
    lines = [command, *make_lines(SHEET)] if where is None else inserted(command, where=where)
    assert any("asks the host for an action" in violation.message for violation in found(lines))


def test_a_message_to_the_host_passes():
    assert found(inserted('RESPOND MSG="sheet done"', where=1)) == []


@pytest.mark.parametrize(
    "command", ["M206 Z1", "G54", "M92 E1", "M98 P1", "M112", "G1 A5", "G91.1", "M851 Z1", "M502"]
)
def test_what_shifts_or_scales_is_named_before_the_print_too(command):
    (violation,) = found([command, *make_lines(SHEET)])
    assert (violation.kind, violation.line) == ("command", 1)


@pytest.mark.parametrize(
    "command", ["G29 A", "START_PRINT BED=60", 'M862.3 P "MK3S"', "M501", "M302 P1", "T0", "M0 go"]
)
def test_start_blocks_may_prepare_a_machine(command):
    assert found([command, *make_lines(SHEET)]) == []


def test_another_value_on_the_output_of_the_valve_is_named():
    assert found(make_lines(SHEET, "marlin-pneumatic"), "marlin-pneumatic") == []
    for command in ("M106 S100", "M106 P0 S9", "M107 P0"):
        violations = found(inserted(command, "marlin-pneumatic"), "marlin-pneumatic")
        assert any("turns the output of the valve" in v.message for v in violations)
    assert found(inserted("M106 P1 S100", "marlin-pneumatic"), "marlin-pneumatic") == []


# --- valves that turn when their command is read -------------------------------------------------------


def test_a_valve_that_would_turn_too_early_waits_for_the_moves():
    case = CASES / "valve_on_m42.toml"
    lines = make_lines(SHEET, str(case))
    turns = [k for k, line in enumerate(lines) if line.startswith("M42")]
    assert turns
    assert all(lines[k - 1] == "M400" for k in turns)
    assert found(lines, case) == []
    foreign = [line for line in lines if line != "M400"]
    early = found(foreign, case)
    assert {v.kind for v in early} == {"flow"}
    assert "acts when it is read" in early[0].message
    assert "M400" not in make_lines(SHEET, "marlin-pneumatic")


def test_a_valve_template_may_hold_its_own_waits():
    settings = ('gcode.valve_open=["m42 p44 s255", "G4 P20"]', 'gcode.valve_close=["M400", "M42 P44 S0"]')
    lines = make_lines(SHEET, "marlin-pneumatic", *settings)
    assert found(lines, "marlin-pneumatic", *settings) == []


# --- cases ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["numbered_with_checksums", "parenthesis_comment", "latin1_comment", "byte_order_mark"]
)
def test_the_check_and_the_sender_read_the_same(name):
    path = CASES / f"{name}.gcode"
    profile = profiles.load(
        "marlin-syringe" if name == "byte_order_mark" else "paper", ["nozzle.tip_width_mm=0"]
    )
    assert check(read_moves(path), profile).violations == []
    program = read_program(path)
    assert program.commands[0] in ("M140 S60", "G28")
    assert all(
        command.isascii() and "(" not in command and "*" not in command for command in program.commands
    )
    by_line = dict(zip(program.lines, program.commands, strict=True))
    assert all(by_line[m.line] == m.text for m in read_moves(path) if m.kind.name == "COMMAND")


def test_no_command_is_named_without_a_print():
    moves = read_lines(["M600", "G28 Z"])
    assert check_commands(moves, [False] * len(moves), profiles.load("paper")) == []


@pytest.mark.parametrize(
    ("heating", "words"),
    [
        ([], "before the nozzle is heated"),
        (["M104 S200"], "does not wait for the nozzle to reach 200 C"),
        (["M109 S200", "M104 S0"], "is set to 0 C at the first extrusion"),
        (["M109 S150"], "is set to 150 C at the first extrusion"),
        (["M109 S200", "M104 S0", "M104 S200"], "does not wait"),
        (["M109 S200"], None),
        (["M109 R210", "M104 S205"], None),
        (["M302 P1"], None),
        (["M302 S0"], None),
    ],
)
def test_the_nozzle_is_hot_at_the_first_extrusion(heating, words):
    lines = [line for line in make_lines(make_grid([[-45]])) if not line.startswith(("M104 S2", "M109"))]
    k = lines.index("G21")
    found = check(read_lines([*lines[:k], *heating, *lines[k:]]), profiles.load("paper")).violations
    assert [violation.kind for violation in found] == ([] if words is None else ["command"])
    assert words is None or words in found[0].message


def test_a_cold_feed_needs_no_heat():
    for profile in ("marlin-syringe", "marlin-pneumatic"):
        lines = make_lines(make_grid([[-45]]), profile)
        assert not any(line.startswith("M109") for line in lines)
        assert check(read_lines(lines), profiles.load(profile, ["nozzle.tip_width_mm=0"])).violations == []


@pytest.mark.parametrize(
    "command", ["M350 X32", "M605 S2", "M852 I1", "G52 X5", "M165 A1", "M404 W3", "M405"]
)
def test_what_changes_scale_flow_or_place_is_named_before_the_print_too(command):
    lines = make_lines(make_grid([[-45]]))
    k = lines.index("G21")
    found = check(read_lines([*lines[:k], command, *lines[k:]]), profiles.load("paper")).violations
    assert [violation.kind for violation in found] == ["command"]


@pytest.mark.parametrize(
    ("lines", "kind", "says"),
    [
        (
            "G28 X Y\nG0 Z0.05",
            "collision",
            "moves at a height of 0.050 mm, from or to a place that is not known",
        ),
        ("G27\nG0 X12 Z0.05", "collision", "moves at a height of 0.050 mm"),
        ("G28 X Y\nG0 X11.3\nG0 Z0.05", "collision", "below what line"),
        ("G28 X Y\nG91\nG0 Z-6", "collision", "moves at a height of"),
        ("G28 X\nG91\nG0 X-30", "command", "goes on from a place that is not known here"),
    ],
)
def test_moves_from_a_place_that_is_not_known_stay_above_the_print(lines, kind, says):
    found_kinds = {v.kind: v.message for v in found(inserted(lines, where=1))}
    assert says in found_kinds[kind]


def test_homing_sideways_through_the_print_is_named():
    lines = make_lines(SHEET)
    last = max(k for k, line in enumerate(lines) if line.startswith("G1") and " E" in line)
    low = [*lines[: last + 1], "G0 Z0.1 F600", "G28 X", "M84"]
    violations = found(low)
    assert any(
        v.kind == "collision" and "G28 X moves at a height of 0.100 mm" in v.message for v in violations
    )
    high = [*lines[: last + 1], "G0 Z50 F600", "G28 X Y", "G0 X50", "M84"]
    assert found(high) == []


@pytest.mark.parametrize("step", ["Z-50", "X-500", "Y3"])
def test_relative_moves_from_an_unknown_place_are_named_before_the_print_too(step):
    lines = make_lines(SHEET)
    home = lines.index("G28")
    begun = [*lines[: home + 1], "G91", f"G1 {step} F600", "G90", "M83", *lines[home + 1 :]]
    assert any("goes on from a place that is not known here" in v.message for v in found(begun))
    raised = [*lines[: home + 1], "G91", "G1 Z5 F600", "G90", "M83", *lines[home + 1 :]]
    assert found(raised) == []


@pytest.mark.parametrize("command", ["G10 S1", "G10 S0", "G10 X5", "G10 Z-5", "G10 R0", "G11 S1"])
@pytest.mark.parametrize("where", [1, None])
def test_retraction_by_the_firmware_with_words_is_named(command, where):
    lines = [command, *make_lines(SHEET)] if where is None else inserted(command, where=where)
    assert any(v.kind == "command" and command in v.message for v in found(lines))


@pytest.mark.parametrize("command", ["M106 S254", "M106 P0 S255", "M106"])
@pytest.mark.parametrize("where", [1, None])
def test_a_valve_that_is_opened_in_another_form_is_named_outside_the_print_too(command, where):
    name = "marlin-pneumatic"
    lines = [command, *make_lines(SHEET, name)] if where is None else inserted(command, name, where=where)
    assert any("turns the output of the valve" in v.message for v in found(lines, name))


def test_a_bed_that_is_switched_off_before_the_print_is_named():
    lines = make_lines(SHEET)
    first = next(k for k, line in enumerate(lines) if line.startswith("G1") and " E" in line)
    cold = [*lines[:first], "M140 S0", *lines[first:]]
    assert any("the bed is switched off at the first extrusion" in v.message for v in found(cold))
