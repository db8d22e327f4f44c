"""What the check says of every command of three firmwares, before, within and behind a print.

The lists are those of Marlin's G-code index, of Klipper's G-codes and extended commands, and of RepRapFirmware's
dictionary. ``SAFE`` are those that may stand before and behind the print; every other one must be named, so
that a command that is added to the lists and forgotten below is a failure.
"""

import pytest
from making import make_grid, make_lines, read_lines

import profiles
from gcode.check import check

SHEET = make_grid([[-45, 30]])
LINES = make_lines(SHEET)
PROFILE = profiles.load("paper")

MARLIN = [
    "G2",
    "G3",
    "G5",
    "G6",
    "G12",
    "G17",
    "G18",
    "G19",
    "G26",
    "G27",
    "G28",
    "G29",
    "G30",
    "G31",
    "G32",
    "G33",
    "G34",
    "G35",
    "G38.2",
    "G42",
    "G53",
    "G54",
    "G59.3",
    "G60",
    "G61",
    "G76",
    "G425",
    "M0",
    "M1",
    "M3",
    "M4",
    "M5",
    "M7",
    "M8",
    "M9",
    "M10",
    "M11",
    "M16",
    "M17",
    "M18",
    "M20",
    "M21",
    "M22",
    "M23",
    "M24",
    "M25",
    "M26",
    "M27",
    "M28",
    "M29",
    "M30",
    "M31",
    "M32",
    "M33",
    "M34",
    "M42",
    "M43",
    "M48",
    "M72",
    "M73",
    "M75",
    "M76",
    "M77",
    "M78",
    "M80",
    "M81",
    "M84",
    "M85",
    "M86",
    "M87",
    "M92",
    "M100",
    "M102",
    "M105",
    "M106",
    "M107",
    "M108",
    "M112",
    "M113",
    "M114",
    "M115",
    "M117",
    "M118",
    "M119",
    "M120",
    "M121",
    "M122",
    "M123",
    "M125",
    "M126",
    "M127",
    "M128",
    "M129",
    "M143",
    "M145",
    "M149",
    "M150",
    "M154",
    "M155",
    "M163",
    "M164",
    "M165",
    "M166",
    "M192",
    "M193",
    "M206",
    "M207",
    "M208",
    "M210",
    "M217",
    "M218",
    "M226",
    "M240",
    "M250",
    "M255",
    "M256",
    "M260",
    "M261",
    "M280",
    "M281",
    "M282",
    "M290",
    "M300",
    "M301",
    "M303",
    "M304",
    "M305",
    "M306",
    "M309",
    "M350",
    "M351",
    "M355",
    "M360",
    "M361",
    "M362",
    "M363",
    "M364",
    "M380",
    "M381",
    "M400",
    "M401",
    "M402",
    "M403",
    "M404",
    "M405",
    "M406",
    "M407",
    "M410",
    "M412",
    "M413",
    "M420",
    "M421",
    "M422",
    "M423",
    "M425",
    "M428",
    "M430",
    "M486",
    "M493",
    "M494",
    "M500",
    "M501",
    "M502",
    "M503",
    "M504",
    "M510",
    "M511",
    "M512",
    "M524",
    "M540",
    "M552",
    "M553",
    "M554",
    "M569",
    "M575",
    "M591",
    "M592",
    "M593",
    "M600",
    "M603",
    "M605",
    "M665",
    "M666",
    "M672",
    "M701",
    "M702",
    "M704",
    "M705",
    "M706",
    "M707",
    "M708",
    "M709",
    "M710",
    "M808",
    "M810",
    "M819",
    "M820",
    "M851",
    "M852",
    "M860",
    "M861",
    "M862.3",
    "M869",
    "M871",
    "M876",
    "M906",
    "M907",
    "M908",
    "M909",
    "M910",
    "M911",
    "M912",
    "M913",
    "M914",
    "M915",
    "M916",
    "M917",
    "M918",
    "M919",
    "M928",
    "M951",
    "M993",
    "M994",
    "M995",
    "M997",
    "M999",
    "T0",
    "T1",
    "D0",
]

KLIPPER = [
    "SET_GCODE_OFFSET",
    "SET_VELOCITY_LIMIT",
    "SET_PRESSURE_ADVANCE",
    "SET_EXTRUDER_ROTATION_DISTANCE",
    "SYNC_EXTRUDER_MOTION",
    "SET_KINEMATIC_POSITION",
    "SAVE_GCODE_STATE",
    "RESTORE_GCODE_STATE",
    "SET_HEATER_TEMPERATURE",
    "TEMPERATURE_WAIT",
    "SET_PIN",
    "SET_SERVO",
    "SET_STEPPER_ENABLE",
    "FORCE_MOVE",
    "STEPPER_BUZZ",
    "MANUAL_STEPPER",
    "SET_TMC_CURRENT",
    "SET_TMC_FIELD",
    "INIT_TMC",
    "SET_INPUT_SHAPER",
    "SET_SKEW",
    "SET_IDLE_TIMEOUT",
    "SET_FILAMENT_SENSOR",
    "SET_RETRACTION",
    "SET_FAN_SPEED",
    "SET_LED",
    "FIRMWARE_RESTART",
    "RESTART",
    "SAVE_CONFIG",
    "PAUSE",
    "RESUME",
    "CANCEL_PRINT",
    "SDCARD_PRINT_FILE",
    "SDCARD_RESET_FILE",
    "UPDATE_DELAYED_GCODE",
    "SET_GCODE_VARIABLE",
    "ACTIVATE_EXTRUDER",
    "SET_DUAL_CARRIAGE",
    "PID_CALIBRATE",
    "PROBE",
    "PROBE_CALIBRATE",
    "Z_OFFSET_APPLY_PROBE",
    "BED_MESH_OFFSET",
    "BED_MESH_CALIBRATE",
    "BED_MESH_PROFILE",
    "QUAD_GANTRY_LEVEL",
    "Z_TILT_ADJUST",
    "DELTA_CALIBRATE",
    "TUNING_TOWER",
    "EXCLUDE_OBJECT",
    "EXCLUDE_OBJECT_DEFINE",
    "EXCLUDE_OBJECT_START",
    "EXCLUDE_OBJECT_END",
    "STATUS",
    "GET_POSITION",
    "RESPOND",
    "START_PRINT",
    "PRINT_END",
    "MY_MACRO",
    "SHAPER_CALIBRATE",
    "QUERY_ENDSTOPS",
    "M900X_THING",
    "CLEAR_PAUSE",
    "SET_PRINT_STATS_INFO",
    "SET_DISPLAY_TEXT",
]

REPRAP = [
    "G10",
    "G68",
    "G69",
    "M36",
    "M37",
    "M38",
    "M39",
    "M82",
    "M98",
    "M99",
    "M101",
    "M103",
    "M116",
    "M135",
    "M144",
    "M220",
    "M221",
    "M291",
    "M292",
    "M308",
    "M374",
    "M375",
    "M376",
    "M408",
    "M409",
    "M450",
    "M451",
    "M452",
    "M453",
    "M470",
    "M471",
    "M472",
    "M505",
    "M550",
    "M551",
    "M555",
    "M556",
    "M557",
    "M558",
    "M559",
    "M560",
    "M561",
    "M562",
    "M563",
    "M564",
    "M567",
    "M568",
    "M569.1",
    "M570",
    "M571",
    "M572",
    "M573",
    "M574",
    "M577",
    "M578",
    "M579",
    "M580",
    "M581",
    "M582",
    "M584",
    "M585",
    "M586",
    "M587",
    "M588",
    "M589",
    "M594",
    "M595",
    "M596",
    "M597",
    "M598",
    "M599",
    "M669",
    "M671",
    "M673",
    "M674",
    "M675",
    "M703",
    "M750",
    "M905",
    "M911",
    "M929",
    "M952",
    "M970",
    "M998",
]

SAFE = frozenset(
    [
        "G10",
        "G12",
        "G27",
        "G28",
        "G29",
        "G30",
        "G32",
        "G33",
        "G34",
        "G35",
        "G60",
        "M0",
        "M1",
        "M5",
        "M9",
        "M17",
        "M18",
        "M20",
        "M21",
        "M22",
        "M27",
        "M31",
        "M36",
        "M73",
        "M75",
        "M76",
        "M77",
        "M78",
        "M80",
        "M81",
        "M82",
        "M84",
        "M105",
        "M106",
        "M107",
        "M113",
        "M114",
        "M115",
        "M117",
        "M118",
        "M119",
        "M122",
        "M123",
        "M150",
        "M154",
        "M155",
        "",
        "M250",
        "M255",
        "M256",
        "M300",
        "M355",
        "M400",
        "M401",
        "M402",
        "M412",
        "M413",
        "M420",
        "M486",
        "M501",
        "M503",
        "M504",
        "",
        "M710",
        "M860",
        "M861",
        "M862.3",
        "M869",
        "M876",
        "T0",
        "BED_MESH_CALIBRATE",
        "BED_MESH_PROFILE",
        "QUAD_GANTRY_LEVEL",
        "Z_TILT_ADJUST",
        "EXCLUDE_OBJECT_DEFINE",
        "EXCLUDE_OBJECT_START",
        "EXCLUDE_OBJECT_END",
        "STATUS",
        "GET_POSITION",
        "RESPOND",
        "START_PRINT",
        "PRINT_END",
        "CLEAR_PAUSE",
        "SET_PRINT_STATS_INFO",
        "SET_DISPLAY_TEXT",
    ]
)
WITHIN = frozenset(["G10", "M73", "M82", "M105", "M106", "M107", "M114", "M117", "M118", "M400"])
BEHIND = frozenset(["M18", "M81", "M84"])
INTO_THE_SHEET = frozenset(
    ["G12", "G28", "G29", "G30", "G32", "G33", "G34", "G35", "M401"]
    + ["BED_MESH_CALIBRATE", "QUAD_GANTRY_LEVEL", "Z_TILT_ADJUST", "START_PRINT"]
)
WORDS = {"G2": " X20 I2", "G3": " X20 I2", "G5": " X20 I2", "G6": " I1", "M117": " hello", "M118": " hello"}

FIRST = LINES.index("G21")
MIDDLE = [k for k, line in enumerate(LINES) if line.startswith(";TOOLPATH")][2]


def found(command, place, profile=PROFILE):
    lines = [*LINES[:place], command, *LINES[place:]]
    return [v for v in check(read_lines(lines), profile).violations if v.line == place + 1]


@pytest.mark.parametrize("code", sorted({*MARLIN, *KLIPPER, *REPRAP}))
def test_what_is_not_known_to_be_harmless_is_named_wherever_it_stands(code):
    command = code + WORDS.get(code, "")
    safe = code in SAFE
    for place, expected in (
        (FIRST, not safe or code in BEHIND),
        (MIDDLE, code not in WITHIN),
        (len(LINES), not safe or code in INTO_THE_SHEET),
    ):
        kinds = {violation.kind for violation in found(command, place)}
        assert ("command" in kinds) == expected, (command, place)


@pytest.mark.parametrize("place", [FIRST, MIDDLE, len(LINES)])
@pytest.mark.parametrize(
    "command",
    """M209 S1|M900 K1000|M900 K-1|M201 X0|M201 X-5|M201 Y9999999|M203 X0|M203 Z-1|M203 E1000000|M204 P0|M204 S-1
    M204 S0.001|M205 X-1|M205 J1000|M205 S50|M104 S999|M104 S-5|M109 R2000|M140 S999|M190 S-1|M106 S300|M106 S-1
    G4|G4 P-5|G4 S-1|G4 S100000000|G4 P100000000|G4 X5|G1 F0|G1 F-600|G1 X12 F0|G1 F0.001|G0 F-1|M211 S0|M111 S8|M141 S900
    M220 S0|M221 S-50|M118 A1 action:cancel|M486 P1|M300 P99999999|M104 R200""".replace("\n", "|").split("|"),
)  # fmt: skip
def test_numbers_with_no_sense_are_named_wherever_they_stand(command, place):
    command = command.strip()
    lines = [*LINES[:place], command, "G1 F1200", *LINES[place:]]
    # A speed is wrong where something moves with it.
    if command == "G1 F0.001":
        lines[place + 1] = "G1 X11.234 E0.001" if place else "G1 X1"
    violations = check(read_lines(lines), PROFILE).violations
    assert any(v.line in (place + 1, place + 2) and v.kind in ("command", "speed") for v in violations)


@pytest.mark.parametrize(
    "command",
    """M209 S0|M900 K0.05|M900 K0|M201 X500 Y500 Z100 E5000|M203 X200 Y200 Z12 E120|M204 P1500 R1250 T1500|M205 X8 Y8 Z0.4 E5
    M205 J0.013|M205 S0 T0|M104 S240|M140 S110|M106 S255|G4 P500|G4 S10|M211 S1|M201|M204|M566 X600 Y600""".replace(
        "\n", "|"
    ).split("|"),
)
def test_what_slicers_write_before_a_print_passes(command):
    assert found(command.strip(), FIRST) == []


def test_the_blocks_of_the_profile_and_what_it_allows_pass():
    for command in ("SET_GCODE_OFFSET Z=0.1", "M92 E500", "M209 S1", "M900 K50"):
        own = profiles.load("paper", [f'gcode.start=["{command}", "M109 S200"]'])
        assert found(command, FIRST)
        assert found(command, FIRST, own) == []
        assert found(command, MIDDLE, own)
        code = command.split()[0]
        allowing = profiles.load("paper", [f'gcode.allowed_commands=["{code}"]'])
        assert found(command, FIRST, allowing) == []
    ending = profiles.load("paper", ['gcode.end=["M500"]'])
    assert found("M500", len(LINES), ending) == []
    assert found("M500", len(LINES))


def test_a_part_that_the_profile_leaves_cold_is_not_heated():
    lines = make_lines(SHEET, "marlin-syringe")
    cold = profiles.load("marlin-syringe", ["nozzle.tip_width_mm=0"])
    k = lines.index("G21")
    for command in ("M104 S200", "M140 S37"):
        (violation,) = check(read_lines([*lines[:k], command, *lines[k:]]), cold).violations
        assert "which the profile leaves cold" in violation.message


# --- cold extrusion ------------------------------------------------------------------------------------


@pytest.mark.parametrize("before", [[], ["M302 P0"], ["M302 P1", "M302 P0"], ["M302 S170"], ["M302"]])
def test_a_cold_program_that_marlin_would_print_nothing_of_is_named(before):
    lines = [line for line in make_lines(SHEET, "marlin-syringe") if line != "M302 P1"]
    k = lines.index("G28")
    (violation,) = check(
        read_lines([*lines[:k], *before, *lines[k:]]),
        profiles.load("marlin-syringe", ["nozzle.tip_width_mm=0"]),
    ).violations
    assert violation.kind == "command"
    assert "put M302 P1 before it" in violation.message


def test_a_firmware_that_extrudes_cold_is_told_by_its_profile():
    lines = [line for line in make_lines(SHEET, "marlin-syringe") if not line.startswith("M302")]
    profile = profiles.load("marlin-syringe", ["nozzle.tip_width_mm=0", 'gcode.allowed_commands=["M302"]'])
    assert check(read_lines(lines), profile).violations == []
    warm = profiles.load("marlin-syringe", ["nozzle.tip_width_mm=0", "material.nozzle_temperature_c=37"])
    k = lines.index("G28")
    assert check(read_lines([*lines[:k], "M302 S0", "M109 S37", *lines[k:]]), warm).violations == []
    (violation,) = check(read_lines([*lines[:k], "M109 S37", *lines[k:]]), warm).violations
    assert "below 170 C" in violation.message


def test_a_start_macro_heats_in_a_way_that_only_the_printer_knows():
    lines = [line for line in LINES if not line.startswith(("M104 S2", "M109"))]
    k = lines.index("G21")
    assert check(read_lines([*lines[:k], "START_PRINT EXTRUDER=200", *lines[k:]]), PROFILE).violations == []


def test_heaters_may_be_turned_off_behind_the_print_alone():
    assert found("TURN_OFF_HEATERS", len(LINES)) == []
    lines = [*LINES[:FIRST], "TURN_OFF_HEATERS", *LINES[FIRST:]]
    assert {v.kind for v in check(read_lines(lines), PROFILE).violations} == {"command"}


@pytest.mark.parametrize("command", ["G92 X5", "G92 Z0", "G92", "G92 X0 Y0 Z0"])
def test_a_place_to_which_the_axes_homed_is_not_renamed(command):
    (violation,) = found(command, FIRST)
    assert "what comes is shifted" in violation.message
    unhomed = [line for line in LINES if line != "G28"]
    place = unhomed.index("G21")
    lines = [*unhomed[:place], "G92 X0 Y0 Z0", *unhomed[place:]]
    assert check(read_lines(lines), PROFILE).violations == []  # an axis that was set by hand
    assert found("G92 E0", FIRST) == []
