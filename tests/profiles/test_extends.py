"""``extends``: relative to the file, as deep as one likes, and never round in a circle."""

import pytest

import profiles
from profiles import ProfileError


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


@pytest.mark.skipif(not __import__("pathlib").Path("/dev/zero").exists(), reason="no endless device here")
def test_a_file_without_end_is_no_profile():
    assert refused("/dev/zero").startswith("/dev/zero: has more than 1000000 bytes")
