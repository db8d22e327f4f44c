"""What a printer that was reset has forgotten is given back as the program had set it, however it is spelled."""

from dataclasses import replace

import pytest
from pump import Bench
from sheet import SAFETY, entry, sheet_lines

from printer import ResumeError, Settings, State, make_program
from printer.emulator.build import Options
from printer.emulator.firmware import Firmware
from printer.outputs import Valve
from printer.replay import highest, lays_nothing, replay
from printer.resume import plan_resume

HOMES_UP = replace(SAFETY, home_lines=("G28",), build_axis_homes_up=True)


def moved_sheet(*ahead):
    """The sheet behind some lines that move its origin."""
    program = make_program([*ahead, *sheet_lines(60)], name="sheet.gcode")
    return program, program.lines[program.toolpaths[30] + 3]


def place_after(plan):
    """Where a printer that was just switched on stands when it has done what leads back to the print."""
    firmware = Firmware(Options())
    bench = Bench([], Settings(safety=SAFETY), firmware=firmware, before=plan.before)
    assert bench.run() is State.FINISHED, bench.sender.message
    bench.settle()
    return firmware.path.moves[-1], firmware.machine.position


@pytest.mark.parametrize(
    ("ahead", "offset"),
    [
        (["G28", "G0 X50 F6000", "G92 X0"], 50),
        (["G28", "G0 X50 F6000", "G92 X20"], 30),
        (["G28", "G0 X50 F6000", "G92 X0", "G0 X5", "G92 X1"], 54),
        (["G28", "G91", "G90", "G0 X50", "G91", "G0 X10", "G92 X0", "G90"], 60),
        (["G28", "G0 X50", "G92 X0", "G28 X"], 0),  # homing takes it back
        (["G20", "G28", "G0 X2 F600", "G92 X1", "G21"], 25.4),
        (["G28", "G0 X50", "G92 X50"], 0),
    ],
)
def test_an_origin_that_was_moved_is_moved_again_after_a_reset(ahead, offset):
    program, line = moved_sheet(*ahead)
    plan = plan_resume(program, entry(program, line), SAFETY, rebooted=True, height_mm=2)
    named = replay(program, plan.start_at).position["X"]
    last, believed = place_after(plan)
    assert believed["X"] == pytest.approx(named)
    across = next(text for text in plan.before if text.startswith("G0 X"))
    assert across.startswith(f"G0 X{named + offset:g} ")
    assert last.x == pytest.approx(named if not offset else named + offset) or offset
    assert any(text.startswith("G92 X") for text in plan.before) == bool(offset)


def test_the_origin_of_a_build_axis_that_homes_up_is_moved_again():
    program, line = moved_sheet("G28", "G0 Z50", "G92 Z0")
    plan = plan_resume(program, entry(program, line), HOMES_UP, rebooted=True)
    rise = plan.before.index("G28") + 2
    top = highest(program, len(program) - 1, "Z")
    assert plan.before[rise : rise + 2] == (f"G0 Z{top + 55:g} F600", f"G92 Z{top + 5:g}")


@pytest.mark.parametrize(
    "ahead", [["G28", "G92 X5"], ["G92 X0 Y0"], ["G28", "G0 X50", "G92"], ["G0 X5", "G54"], ["M206 X3"]]
)
def test_an_origin_that_only_the_printer_knew_is_refused_after_a_reset_alone(ahead):
    program, line = moved_sheet(*ahead)
    with pytest.raises(ResumeError, match=r"went the origin of .*X"):
        plan_resume(program, entry(program, line), SAFETY, rebooted=True, height_mm=2)
    plan = plan_resume(program, entry(program, line), SAFETY, rebooted=False)
    assert not any(text.startswith("G92 X") for text in plan.before)


def test_the_height_is_given_as_the_program_counts_it():
    program, line = moved_sheet("G28", "G92 Z0.3")
    plan = plan_resume(program, entry(program, line), SAFETY, rebooted=True, height_mm=2)
    assert "G92 Z7" in plan.before


# --- valves --------------------------------------------------------------------------------------------

SPELLINGS = [
    (["M106 P0 S255"], ["M107"]),
    (["M106 S255"], ["M106 P0 S0"]),
    (["M42 P4 S255"], ["M42 P4 S0"]),
    (["M42 P4 S255"], ["G4 P50", "M42 P4 S0", "G4 P50"]),
    (["M8"], ["M9"]),
    (["M7"], ["M9"]),
    (["M3 S255"], ["M5"]),
    (["M10"], ["M11"]),
    (["M126"], ["M127"]),
    (["OPEN_VALVE"], ["CLOSE_VALVE"]),
    (["M42 P4 S255", "G4 P50"], ["CLOSE_VALVE"]),
]


def behind_a_valve(opening, closing):
    """Two lines at 0.2 and at 3 mm, and a travel far above them."""
    lines = ["G90", "G28", "G0 Z50", "M83", *closing]
    for k, z in enumerate((0.2, 3, 3.5)):
        lines += [f";TOOLPATH {k}", f"G0 X{k} Z{z}", *opening, "G1 X9 F600", *closing]
    return make_program([*lines[: -len(opening) - len(closing) - 1], "G0 Z30"])


@pytest.mark.parametrize(("opening", "closing"), SPELLINGS)
def test_the_valve_is_seen_however_it_is_spelled(opening, closing):
    program = behind_a_valve(opening, closing)
    assert highest(program, len(program), "Z", closing, opening) == 3
    first = program.toolpaths[0]
    assert highest(program, first + 3 + len(opening), "Z", closing, opening) == 0.2
    assert not lays_nothing(make_program([*opening, "G1 X5"]), len(opening) + 1, closing, opening)


@pytest.mark.parametrize(("opening", "closing"), [*SPELLINGS, (["OPEN_IT"], ["SHUT_IT"])])
def test_the_nozzle_rises_above_everything_where_nothing_tells_of_a_valve(opening, closing):
    program = behind_a_valve(opening, closing)
    assert highest(program, len(program), "Z", ["M42 P9 S0"], ["M42 P9 S1"]) == 30
    plan = plan_resume(
        program,
        entry(program, program.lines[program.toolpaths[1] + 2], "stopped"),
        replace(SAFETY, close_lines=tuple(closing), open_lines=tuple(opening)),
        rebooted=False,
    )
    assert "G0 Z8 F600" in plan.before


def test_a_valve_is_as_the_last_command_of_its_kind_left_it():
    valve = Valve(["M107"], ["M106 P0 S255"])
    states = []
    for command in ("M106 S128", "M106 S0", "M106 P1 S9", "M106 P0 S1", "M107 P1", "M107 P0"):
        valve.apply(command)
        states.append(valve.is_open)
    assert states == [True, False, False, True, True, False]


# --- settings and outputs ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "restored"),
    [
        (["M203 X5", "M203 Y7"], ["M203 X5", "M203 Y7"]),
        (["M203 X5 Y6", "M203 X8"], ["M203 Y6", "M203 X8"]),
        (["M204 P300", "M204 T400"], ["M204 P300", "M204 T400"]),
        (["M204 T400", "M204 S300", "M204 P200"], ["M204 T400", "M204 S300", "M204 P200"]),
        (["M203 T0 E5", "M203 T1 E6"], ["M203 E5 T0", "M203 E6 T1"]),
        (["G20", "M203 X5", "G21", "M203 Y7"], ["G20", "M203 X5", "G21", "M203 Y7"]),
        (["M900 K0.5"], ["M900 K0.5"]),
        (["M572 D0 S0.1", "M572 D1 S0.2"], ["M572 S0.1 D0", "M572 S0.2 D1"]),
        (["M207 S3 F1800", "M207 S2"], ["M207 F1800", "M207 S2"]),
        (["SET_PRESSURE_ADVANCE ADVANCE=0.1", "SET_PRESSURE_ADVANCE ADVANCE=0.2"],
         ["SET_PRESSURE_ADVANCE ADVANCE=0.2"]),
    ],
)  # fmt: skip
def test_settings_are_restored_word_by_word_in_the_order_of_their_last_change(given, restored):
    before = restoring(given)
    first = before.index("G21") + 1
    assert before[first : first + len(restored)] == restored
    assert before[first + len(restored)] == "G91"


@pytest.mark.parametrize(
    ("given", "restored"),
    [
        (["M106 P0 S255", "M106 S0", "M106 P0 S200"], ["M106 P0 S200"]),
        (["M106 P0 S255", "M107"], ["M107"]),
        (["M106 P1 S9", "M106 S5", "M106 P1 S8"], ["M106 S5", "M106 P1 S8"]),
        (["M7", "M8", "M9", "M7"], ["M9", "M7"]),
        (["M7", "M9"], ["M9"]),
        (["M42 P4 S255", "M42 P4 S0", "M42 P5 S1"], ["M42 P4 S0", "M42 P5 S1"]),
        (["M280 P0 S9", "M280 P0 S90"], ["M280 P0 S90"]),
    ],
)
def test_each_output_is_restored_once_as_it_was_left(given, restored):
    before = restoring(given)
    kinds = ("M106", "M107", "M7", "M8", "M9", "M42", "M280")
    assert [text for text in before[3:] if text.split()[0] in kinds] == restored


def test_each_tool_is_heated():
    before = restoring(["M104 T0 S200", "M104 T1 S210", "M104 T0 S205"])
    assert [text for text in before if text.startswith("M104")] == ["M104 T1 S210", "M104 T0 S205"]


def restoring(given):
    program = make_program(["G90", "M83", "G0 Z1 F600", *given, ";TOOLPATH 0", "G0 X1", "G1 X2 E1"])
    plan = plan_resume(
        program, entry(program, len(given) + 6), replace(SAFETY, close_lines=()), rebooted=True, height_mm=2
    )
    return list(plan.before)
