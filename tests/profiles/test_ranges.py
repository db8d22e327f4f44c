"""Every number of a profile has a physical range, in the schema too; what lies outside is refused in words."""

import math

import pytest
from pydantic import BaseModel

import profiles
from dialect.numbers import plain
from profiles import Profile, ProfileError

HOSTILE = [
    "1e-308",
    "1e308",
    "-1e308",
    "-1.0",
    "nan",
    "inf",
    "5e-324",
    "1" + "0" * 400,
    "0x" + "f" * 5000,
    "-0.0",
    "[1e308]",
    "true",
]


def numbers():
    """Every number of the schema: (section, key, place in a list or None, its schema)."""
    schema = Profile.model_json_schema()
    found = []

    def walk(section, key, place, part):
        for option in part.get("anyOf", [part]):
            if option.get("type") in ("number", "integer"):
                found.append((section, key, place, option))
            for k, inner in enumerate(option.get("prefixItems", [])):
                walk(section, key, k, inner)

    for section, model in Profile():
        for key, part in schema["$defs"][type(model).__name__]["properties"].items():
            walk(section, key, None, part)
    return found


NUMBERS = numbers()
IDS = [f"{section}.{key}{'' if place is None else place}" for section, key, place, _ in NUMBERS]


def test_the_walk_over_the_schema_misses_no_number():
    shown = {(section, key) for section, key, *_ in NUMBERS}
    for section, model in Profile():
        assert isinstance(model, BaseModel)
        for key, value in model:
            flat = value if isinstance(value, tuple) else (value,)
            if any(isinstance(entry, int | float) and not isinstance(entry, bool) for entry in flat):
                assert (section, key) in shown
    assert {("material", "height_mm"), ("material", "feed_step_mm"), ("gcode", "thumbnail_px")} <= shown


@pytest.mark.parametrize(("section", "key", "place", "schema"), NUMBERS, ids=IDS)
def test_every_number_has_a_range_with_two_ends(section, key, place, schema):
    assert -1e6 <= schema["minimum"] < schema["maximum"] <= 12e6
    if section != "nozzle" and key.endswith(
        ("speed_mm_s", "diameter_mm", "bore_mm", "width_mm", "height_mm", "acceleration_mm_s2", "volume_mm")
    ):
        assert schema["minimum"] > 0


def setting(section, key, place, value):
    """The --set that gives one number this value, the others of its list being as they are."""
    if place is None:
        return f"{section}.{key}={value}"
    around = getattr(getattr(profiles.load("marlin-generic"), section), key) or (64, 64)
    entries = [str(value) if k == place else str(entry) for k, entry in enumerate(around)]
    return f"{section}.{key}=[{', '.join(entries)}]"


@pytest.mark.parametrize(("section", "key", "place", "schema"), NUMBERS, ids=IDS)
def test_what_lies_outside_is_refused_with_both_numbers(section, key, place, schema):
    for beyond, word, limit in (
        (schema["minimum"] - 1, "at least", schema["minimum"]),
        (schema["maximum"] + 1, "at most", schema["maximum"]),
    ):
        value = int(beyond) if schema["type"] == "integer" else float(beyond)
        with pytest.raises(ProfileError) as caught:
            profiles.load("marlin-generic", [setting(section, key, place, value)])
        where = f"[{section}] {key}" + ("" if place is None else f"[{place}]")
        assert f"{where}: {value!r} must be {word} {plain(limit)}." in str(caught.value)
    for end in ("minimum", "maximum"):
        value = schema[end] if schema["type"] == "integer" else float(schema[end])
        profiles.load("marlin-generic", [setting(section, key, place, value)])


@pytest.mark.parametrize(("section", "key", "place", "schema"), NUMBERS, ids=IDS)
@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: text[:8])
def test_no_number_gets_anything_but_a_profile_or_an_error_in_words(section, key, place, schema, text):
    try:
        made = profiles.load("marlin-generic", [setting(section, key, place, text)])
    except ProfileError as error:
        assert len(str(error)) < 400
        assert f"[{section}] {key}" in str(error)
        return
    value = getattr(getattr(made, section), key)
    value = value if place is None else value[place]
    assert schema["minimum"] <= value <= schema["maximum"]
    assert math.isfinite(value)


def test_a_length_that_no_decimal_can_say_is_no_retraction():
    profiles.load("marlin-generic", ["motion.retract_mm=0"])
    with pytest.raises(ProfileError, match=r"retract_mm: 1e-06 must be 0, for none, or at least 0.00001"):
        profiles.load("marlin-generic", ["motion.retract_mm=0.000001"])


@pytest.mark.parametrize(
    "setting",
    [
        "printer.stop_lift_mm",
        "motion.clearance_mm",
        "motion.approach_mm",
        "motion.valve_open_s",
        "motion.prime_mm",
        "nozzle.tip_width_mm",
    ],
)
def test_what_is_too_small_to_reach_the_machine_is_refused(setting):
    section, key = setting.split(".")
    with pytest.raises(
        ProfileError, match=rf"\[{section}\] {key}: 1e-07 must be 0, for none, or at least 0.001"
    ):
        profiles.load("marlin-generic", [f"{setting}=1e-7"])
    profiles.load("marlin-generic", [f"{setting}=0"])
    profiles.load("marlin-generic", [f"{setting}=0.001"])
