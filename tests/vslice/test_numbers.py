"""Numbers without sense, in every option of every command: refused in words with exit 2, never a defect."""

import json
import random
import re
from pathlib import Path

import click
import pytest

import profiles
import vslice.cli
from profiles import Profile

TILE = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'
HOSTILE = [
    "-1",
    "1e-308",
    "-1e-308",
    "1e308",
    "-1e308",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e999",
    "9" * 400,
    "9" * 5000,
    "x",
    "",
]
INPUT = {
    "slice": "sheet.json",
    "preview": "sheet.json",
    "check": "part.gcode",
    "compare": "sheet.json",
    "send": "part.gcode",
}
DEFECT = re.compile("defect|Traceback")
WAITS = {"send", "console", "emulate"}  # commands that talk to a printer


def numeric():
    """Every option that takes a number: (command, option)."""
    found = []
    context = click.Context(vslice.cli.cli)
    for name in vslice.cli.COMMANDS:
        command = vslice.cli.cli.get_command(context, name)
        for option in command.params:
            kind = getattr(option, "type", None)
            counted = isinstance(option, click.Option) and (option.is_flag or option.count)
            if kind.name in ("integer", "float", "integer range", "float range") and not counted:
                found.append((name, option.opts[-1], kind))
    return found


NUMERIC = numeric()


def test_there_are_options_with_numbers():
    assert {name for name, *_ in NUMERIC} >= {"slice", "generate", "preview", "compare", "paper", "console"}


@pytest.mark.parametrize(("name", "option", "kind"), NUMERIC, ids=[f"{n} {o}" for n, o, _ in NUMERIC])
def test_every_number_has_a_range(name, option, kind):
    if name == "send":
        pytest.skip("the waits of send have ranges in the profile's own words")
    assert kind.min is not None
    assert kind.max is not None


@pytest.mark.parametrize(("name", "option", "kind"), NUMERIC, ids=[f"{n} {o}" for n, o, _ in NUMERIC])
def test_no_number_is_a_defect(run, name, option, kind):
    if name in WAITS:
        extra = ["--port", "marlin://"] if name == "console" else ["--dry-run"]
    else:
        extra = ["--method", "greedy"] if name == "slice" else []
    Path("sheet.json").write_text(TILE)
    run("-q", "sheet.json", "-o", "part.gcode", "--method", "greedy")
    file = [INPUT[name]] if name in INPUT else []
    for text in HOSTILE:
        code, _, err = run(name, *file, *extra, option, text)
        within = name == "send" or "-308" in text or (option.endswith("-deg") and text == "-1")
        assert code == 2 or (within and code in (0, 1)), f"{option} {text[:20]}: {code}, {err[-300:]}"
        assert "defect" not in err
        assert "Traceback" not in err


@pytest.mark.parametrize(
    "key", ["corrupt", "reply_drop", "ok_drop", "slots", "rx", "blocks", "command_s", "delay_s", "seed"]
)
def test_the_emulated_printer_takes_no_number_without_sense(run, key):
    Path("part.gcode").write_text("G28\n")
    for text in HOSTILE:
        if "-308" in text:
            continue
        words = [
            "send",
            "part.gcode",
            "--port",
            f"marlin://?clock=fast&{key}={text}",
            "--no-check",
            "-p",
            "marlin-generic",
        ]
        if text == "":
            continue  # a query leaves out what is empty
        code, _, err = run(*words)
        assert code in (1, 2), (text, err)
        assert key in err
        assert "defect" not in err


@pytest.mark.parametrize("option", ["--tile-mm", "--spacing-mm"])
def test_what_lies_outside_is_told_with_its_range(run, option):
    code, _, err = run("generate", option, "1e308")
    assert code == 2
    assert f"'{option}': 1e+308 is not in the range 0.01<=x<=10000" in err


def test_a_grid_of_too_many_tiles_is_refused_before_it_is_made(run):
    code, _, err = run("generate", "--cols", 10000, "--rows", 10000)
    assert code == 2
    assert "10000 x 10000 tiles are 100000000, but a grid may have 1000000; ask for fewer." in err


def test_extremes_together_slice_or_are_refused_in_words(run):
    """Every number of a profile at one of its ends, at random: sliced and checked, or refused with where."""
    schema = Profile.model_json_schema()
    Path("sheet.json").write_text(TILE)
    draw = random.Random(5)
    ended = set()
    for _ in range(60):
        words = []
        for section, model in profiles.load(draw.choice(profiles.shipped())):
            for key, part in schema["$defs"][type(model).__name__]["properties"].items():
                for option in part.get("anyOf", [part]):
                    if option.get("type") in ("number", "integer") and draw.random() < 0.15:
                        value = option[draw.choice(["minimum", "maximum"])]
                        words += ["--set", f"{section}.{key}={value}"]
                    elif "prefixItems" in option and draw.random() < 0.15:
                        ends = [inner[draw.choice(["minimum", "maximum"])] for inner in option["prefixItems"]]
                        words += ["--set", f"{section}.{key}={json.dumps(ends)}"]
        code, _, err = run("sheet.json", "-o", "part.gcode", "--method", "greedy", *words)
        assert not DEFECT.search(err), (words, err)
        assert code in (0, 1, 2), err
        ended.add(code)
        if code == 0:
            code, _, err = run("check", "part.gcode")
            assert not DEFECT.search(err), (words, err)
            assert code in (0, 1), (words, err)
        else:
            assert "mm" in err, err
    assert 0 in ended


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "1e999"])
def test_what_is_no_number_of_seconds_or_mm_is_refused_by_the_option_itself(run, text):
    Path("sheet.json").write_text(TILE)
    for name, option, kind in NUMERIC:
        if name != "send" and kind.name.startswith("float"):
            file = [INPUT[name]] if name in INPUT else []
            code, _, err = run(name, *file, option, text)
            assert code == 2
            assert f"'{option}': {float(text)} is not in the range" in err
