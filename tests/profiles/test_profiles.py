"""Profiles: what is shipped, what a file may say, and what every mistake is answered with."""

import re
import tomllib

import pytest

import profiles
from profiles import ProfileError
from profiles.profile import Profile

SHIPPED = [
    "grbl-pneumatic", "grbl-syringe", "klipper-generic", "klipper-pneumatic", "klipper-syringe",
    "marlin-generic", "marlin-pneumatic", "marlin-syringe", "paper",
    "reprapfirmware-generic", "reprapfirmware-pneumatic", "reprapfirmware-syringe",
]  # fmt: skip

BAD = {
    "unknown key": ("[motion]\ntravel_sped = 3", "[motion] unknown key 'travel_sped'. Did you mean 'travel_speed_mm_s'?"),
    "unknown section": ("[mtion]\nx = 3", "unknown section 'mtion'. Did you mean 'motion'?"),
    "below": ("[motion]\ntravel_speed_mm_s = -3", "[motion] travel_speed_mm_s: -3 must be at least 0.002."),
    "text": ('[motion]\ntravel_speed_mm_s = "fast"', "[motion] travel_speed_mm_s: 'fast': Input should be a valid number"),
    "nan": ("[motion]\ntravel_speed_mm_s = nan", "[motion] travel_speed_mm_s: nan: Input should be a finite number"),
    "number for bool": ("[motion]\nfirmware_retraction = 1", "[motion] firmware_retraction: 1: Input should be a valid boolean"),
    "plane": ('[machine]\nplane = "XY"', "[machine] plane: 'XY' must be 'XZ' or 'YZ'."),
    "placeholder": (
        '[gcode]\nstart = ["G28", "M104 S{nozle_temperature_c}"]',
        "[gcode] start, line 2: 'M104 S{nozle_temperature_c}': unknown placeholder {nozle_temperature_c}; "
        "did you mean {nozzle_temperature_c}?",
    ),
    "brace": ('[gcode]\nend = ["M117 {"]', "[gcode] end, line 1: 'M117 {': "),
    "format": ('[gcode]\nend = ["M104 S{nozzle_temperature_c:.1f}"]', "[gcode] end, line 1: "),
    "two lines in one": ('[gcode]\nend = ["M104 S0\\nM140 S0"]', "[gcode] end, line 1: "),
    "no valve": ('[material]\nfeed = "pneumatic"', "[gcode] valve_open is empty, but [material] feed is 'pneumatic'"),
    "short volume": ("[machine]\nbuild_volume_mm = [1.0, 2.0]", "[machine] build_volume_mm: [1.0, 2.0] must be a list of 3 numbers."),
    "one number for four": ("[machine]\nmax_speed_mm_s = 1.0", "[machine] max_speed_mm_s: 1.0 must be a list of 4 numbers."),
    "text for a list": ('[gcode]\nstart = "G28"', "[gcode] start: 'G28' must be a list of texts."),
    "one side": ("[gcode]\nthumbnail_px = [32]", "[gcode] thumbnail_px: [32] must be a list of 2 numbers."),
    "key outside its section": ("clearance_mm = 0.2", "unknown section 'clearance_mm'. It belongs in [motion]."),
    "thumbnail": ("[gcode]\nthumbnail_px = [8, 8]", "[gcode] thumbnail_px[0]: 8 must be at least 16."),
    "window": ("[printer]\nwindow_lines = 0", "[printer] window_lines: 0 must be at least 1."),
    "no TOML": ("[motion", "this is no TOML: "),
    "extends nothing": ('extends = "marlin-genric"', None),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_every_mistake_is_named(tmp_path, case):
    text, says = BAD[case]
    file = tmp_path / "lab.toml"
    file.write_text(text)
    with pytest.raises(ProfileError) as caught:
        profiles.load(str(file))
    if says is None:
        assert "Did you mean 'marlin-generic'?" in str(caught.value)
    else:
        assert str(caught.value).startswith(f"{file}: {says}")


def test_shipped_profiles_load_and_describe_themselves():
    assert profiles.shipped() == SHIPPED
    for name in SHIPPED:
        profile = profiles.load(name)
        assert len(profile.machine.description) > 10
        assert profiles.render(profile.gcode.start, profile.values)


def test_bio_profiles_allow_cold_extrusion():
    for name in ("marlin-syringe", "marlin-pneumatic"):
        assert any(line.startswith("M302") for line in profiles.load(name).gcode.start)


def test_a_file_needs_only_what_differs(tmp_path):
    file = tmp_path / "lab.toml"
    file.write_text("[motion]\nclearance_mm = 0.5\n")
    assert profiles.load(str(file)) == Profile().model_copy(
        update={"motion": Profile().motion.model_copy(update={"clearance_mm": 0.5})}
    )


def test_a_file_may_extend_a_shipped_profile_or_another_file(tmp_path):
    (tmp_path / "a.toml").write_text('extends = "marlin-syringe"\n[motion]\nclearance_mm = 0.5\n')
    (tmp_path / "b.toml").write_text('extends = "a.toml"\n[material]\nwidth_mm = 0.7\n')
    profile = profiles.load(str(tmp_path / "b.toml"))
    assert (profile.material.feed, profile.motion.clearance_mm, profile.material.width_mm) == (
        "syringe",
        0.5,
        0.7,
    )
    (tmp_path / "c.toml").write_text('extends = "c.toml"\n')
    with pytest.raises(ProfileError, match="extends"):
        profiles.load(str(tmp_path / "c.toml"))


def test_settings_from_the_command_line():
    profile = profiles.load(
        "marlin-generic", ["motion.travel_speed_mm_s=80", "machine.plane=YZ", 'gcode.end=["M84"]']
    )
    assert (profile.motion.travel_speed_mm_s, profile.machine.plane, profile.gcode.end) == (
        80,
        "YZ",
        ("M84",),
    )
    for wrong in ("travel_speed_mm_s=80", "motion.travel_speed_mm_s", "motion.=3"):
        with pytest.raises(ProfileError, match=r"give section.key=value"):
            profiles.load("marlin-generic", [wrong])


def test_a_name_that_is_none_suggests_one():
    with pytest.raises(
        ProfileError, match="marlin-genric: there is no such profile or file. Did you mean 'marlin-generic'"
    ):
        profiles.load("marlin-genric")
    with pytest.raises(
        ProfileError, match="Shipped are grbl-pneumatic, .*, marlin-generic, .*, reprapfirmware-syringe"
    ):
        profiles.load("xyz")


def test_templates_write_numbers_in_their_shortest_form():
    values = profiles.load("marlin-generic", ["material.nozzle_temperature_c=205.5"]).values
    assert profiles.render(["M104 S{nozzle_temperature_c} P{bed_temperature_c} {{x}}"], values) == [
        "M104 S205.5 P60 {x}"
    ]


def test_every_setting_has_a_description_a_unit_and_one_name():
    names = []
    for section, value in Profile():
        for key, field in type(value).model_fields.items():
            assert field.description, f"[{section}] {key}"
            names.append(key)
            if re.search(r"float", str(field.annotation)) and key not in ("flow", "minimum_cruise_ratio"):
                assert re.search(r"_(mm|s|mm_s|mm_s2|c|kpa|deg|spacings)$", key), (
                    f"[{section}] {key} has no unit in its name"
                )
    assert len(names) == len(set(names)), "a placeholder would be ambiguous"


def test_shipped_files_say_nothing_that_the_schema_does_not_know():
    from importlib import resources

    for name in SHIPPED:
        settings = tomllib.loads(resources.files("profiles").joinpath(f"{name}.toml").read_text())
        assert set(settings) <= {"extends", *Profile.model_fields}
