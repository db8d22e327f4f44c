"""Settings that make no sense together are warned of, with both numbers; sensible ones are not."""

import numpy as np
import pytest
from making import _arguments, make_grid

import profiles
from gcode import program
from gcode.advice import advice

SHEET = make_grid([[-45]], spacing=0.5, tile=(10.0, 10.0), min_length_mm=2.0)


def advised(*settings, sheet=SHEET, name="marlin-generic"):
    profile = profiles.load(name, settings)
    plan, _, spacing, tile = _arguments(sheet, profile)
    made = program.build(plan, profile, spacing, tile)
    length = np.hypot(*(plan.toolpaths[:, 1] - plan.toolpaths[:, 0]).T)
    return advice(made, profile, spacing, length), len(length)


def test_what_makes_sense_is_not_warned_of():
    for name in profiles.shipped():
        assert advised(name=name)[0] == []


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (["material.flow=3"], "the beads fill 2"),
        (["material.flow=0.2"], "the beads fill 1"),
        (
            ["material.width_mm=6.0"],
            "{n} of {n} toolpaths are 6 mm wide ([material] width_mm) at a spacing of 0.5 mm, 12 times it",
        ),
        (
            ["material.width_mm=0.1"],
            "{n} of {n} toolpaths are 0.1 mm wide ([material] width_mm) at a spacing of 0.5 mm, 0.2 times it",
        ),
        (["material.width_mm=2.5"], "toolpaths are shorter, the shortest 2."),
        (["material.feed_step_mm=1"], "than the smallest step of the feed, 1 mm ([material] feed_step_mm)"),
        (
            ["motion.retract_mm=0.001"],
            "[motion] retract_mm, 0.001 mm, is less than the smallest step of the feed, 0.0025 mm",
        ),
    ],
)
def test_what_makes_none_is_told_with_both_numbers(settings, says):
    found, n = advised(*settings)
    assert any(says.format(n=n) in sentence for sentence in found), found


def test_steps_of_a_wide_syringe_are_counted():
    sheet = make_grid([[-45]], spacing=0.1)
    found, n = advised("material.width_mm=0.1", sheet=sheet, name="marlin-syringe")
    (sentence,) = [sentence for sentence in found if "feed_step_mm" in sentence]
    profile = profiles.load("marlin-syringe", ["material.width_mm=0.1"])
    made = program.build(*_arguments(sheet, profile))
    feed = [
        move.e_mm
        for move in made.moves
        if move.e_mm > 0 and move.toolpath >= 0 and move.kind.name == "EXTRUDE"
    ]
    below = sum(e < 0.000125 for e in feed)
    assert 0 < below <= n
    assert sentence.startswith(
        f"{below} of {n} toolpaths take less, the least {min(feed):.3g} mm, than the smallest step of the feed, 0.000125 mm"
    )
    assert not [
        s
        for s in advised(
            "material.width_mm=0.1", "material.feed_step_mm=0.000001", sheet=sheet, name="marlin-syringe"
        )[0]
        if "feed_step" in s
    ]


def test_a_speed_that_f_cannot_say_is_told():
    # A plunger of 0.05 mm bore, at its slowest, takes a line of a thick bead far slower than 0.1 mm/min.
    found, _ = advised(
        "material.syringe_bore_mm=0.05", "machine.max_speed_mm_s=[100.0, 100.0, 10.0, 0.002]",
        "motion.retract_mm=0", name="marlin-syringe",
    )  # fmt: skip
    assert any(
        "are slower, the slowest" in sentence and "than F can say, 0.0017 mm/s" in sentence
        for sentence in found
    )
