"""``extends``: relative to the file, as deep as one likes, and never round in a circle."""

import pytest

import profiles
from profiles import ProfileError
from profiles.nozzles import nozzle_called


def refused(file):
    with pytest.raises(ProfileError) as caught:
        profiles.load(str(file))
    return str(caught.value)


@pytest.mark.parametrize("ring", [["a"], ["a", "b"], ["a", "b", "c"]])
def test_a_circle_is_told_in_one_line(tmp_path, monkeypatch, ring):
    monkeypatch.chdir(tmp_path)
    for name, base in zip(ring, [*ring[1:], ring[0]], strict=True):
        (tmp_path / f"{name}.toml").write_text(f'extends = "{base}.toml"\n')
    way = " -> ".join(f"{name}.toml" for name in [*ring, ring[0]])
    assert refused("a.toml") == f"{way}: extends goes round in a circle; one of them must extend nothing."


def test_a_circle_through_another_folder_or_a_link_is_seen(tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "a.toml").write_text('extends = "deep/b.toml"\n')
    (tmp_path / "deep" / "b.toml").write_text('extends = "../link.toml"\n')
    (tmp_path / "link.toml").symlink_to(tmp_path / "a.toml")
    said = refused(tmp_path / "a.toml")
    assert "circle" in said
    assert said.count("\n") == 0


def test_what_is_extended_twice_is_no_circle_and_a_chain_may_be_long(tmp_path):
    for k in range(300):
        (tmp_path / f"p{k}.toml").write_text(
            f'extends = "p{k + 1}.toml"\n[machine]\nfixed_mm = {k}\noffset_mm = {k}\n'
        )
    (tmp_path / "p300.toml").write_text('extends = "marlin-syringe"\n[machine]\nbed_z_mm = 3\n')
    made = profiles.load(str(tmp_path / "p0.toml"))
    assert (made.machine.fixed_mm, made.machine.bed_z_mm, made.material.feed) == (0, 3, "syringe")


def test_a_file_is_looked_for_beside_the_one_that_names_it(tmp_path, monkeypatch):
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "a.toml").write_text('extends = "base.toml"\n')
    (tmp_path / "lab" / "base.toml").write_text("[machine]\nfixed_mm = 1\n")
    (tmp_path / "base.toml").write_text("[machine]\nfixed_mm = 2\n")
    monkeypatch.chdir(tmp_path)
    assert profiles.load("lab/a.toml").machine.fixed_mm == 1
    (tmp_path / "lab" / "base.toml").unlink()
    said = refused("lab/a.toml")
    assert said.startswith("lab/a.toml -> lab/base.toml: there is no such profile or file.")


def test_what_is_wrong_further_up_says_how_it_was_come_to(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text('extends = "b.toml"\n')
    (tmp_path / "b.toml").write_text("[machine")
    assert refused("a.toml").startswith("a.toml -> b.toml: this is no TOML: ")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    assert refused("a.toml").startswith("a.toml -> b.toml: cannot be read as text: ")
    (tmp_path / "b.toml").write_text("extends = 3\n")
    assert refused("a.toml").startswith("a.toml -> b.toml: extends is 3; it must name one profile")
    (tmp_path / "b.toml").unlink()
    (tmp_path / "b.toml").mkdir()
    assert refused("a.toml").startswith("a.toml -> b.toml: there is no such profile or file.")


MINE = """extends = "marlin-generic"
[nozzle]
tip_width_mm = 0.5
cone_deg = 0
length_mm = 12.7
shoulder_width_mm = 8
"""


def test_a_nozzle_of_ones_own_does_not_keep_the_name_of_the_one_that_it_changes(tmp_path):
    (tmp_path / "mine.toml").write_text(MINE)
    assert profiles.load(str(tmp_path / "mine.toml")).nozzle.name == ""
    (tmp_path / "named.toml").write_text('extends = "mine.toml"\n[nozzle]\ncone_deg = 5\nname = "glass"\n')
    assert profiles.load(str(tmp_path / "named.toml")).nozzle.name == "glass"
    (tmp_path / "same.toml").write_text('extends = "marlin-generic"\n[nozzle]\ndownhill_deg = 40\n')
    assert profiles.load(str(tmp_path / "same.toml")).nozzle.name == "brass-0.4"
    for settings, name in (
        (["nozzle.tip_width_mm=0.9"], ""),
        (["nozzle.tip_width_mm=1.0", "nozzle.press_mm=0.1"], "brass-0.4"),
        (["nozzle.tip_width_mm=0.9", 'nozzle.name="worn"'], "worn"),
        ([*nozzle_called("25G").settings()], "25G"),
        ([*nozzle_called("25G").settings(), "nozzle.length_mm=10"], ""),
    ):
        assert profiles.load("marlin-generic", settings).nozzle.name == name


def test_what_is_left_of_another_nozzle_is_told(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    assert profiles.taken_over(str(file)) == {"cone_mm": 2.0, "barrel_width_mm": 8.08}
    assert profiles.taken_over(str(file), ["nozzle.cone_mm=0"]) == {"barrel_width_mm": 8.08}
    assert profiles.taken_over(str(file), nozzle_called("25G").settings()) == {}
    file.write_text(MINE + "cone_mm = 0\nbarrel_width_mm = 0\n")
    assert profiles.taken_over(str(file)) == {}
    (tmp_path / "above.toml").write_text('extends = "mine.toml"\n[nozzle]\ncone_deg = 5\n')
    assert profiles.taken_over(str(tmp_path / "above.toml")) == {}
    file.write_text('extends = "marlin-generic"\n[nozzle]\npress_mm = 0.1\n')
    assert profiles.taken_over(str(file)) == {}
    assert profiles.taken_over("paper", ["nozzle.tip_width_mm=1.0"]) == {}


@pytest.mark.skipif(not __import__("pathlib").Path("/dev/zero").exists(), reason="no endless device here")
def test_a_file_without_end_is_no_profile():
    assert refused("/dev/zero").startswith("/dev/zero: has more than 1000000 bytes")
