"""Nozzles by name: what is known of them, and what a name does to a profile."""

import math

import pytest

import profiles
from profiles import ProfileError
from profiles.nozzles import known_nozzles, nozzle_called


def test_needles_get_narrower_with_their_gauge_and_have_a_bore():
    needles = [nozzle for name, nozzle in known_nozzles().items() if name.endswith("G") and name[0].isdigit()]
    assert [needles[0].name, needles[-1].name] == ["18G", "32G"]
    widths = [needle.tip_width_mm for needle in needles]
    assert widths == sorted(widths, reverse=True)
    for nozzle in known_nozzles().values():
        assert 0 < nozzle.bore_mm < nozzle.tip_width_mm < nozzle.shoulder_width_mm
        assert nozzle.source
        assert nozzle.what
        brass = nozzle.name.startswith("brass")
        half = nozzle.tip_width_mm / 2 + nozzle.cone_mm * math.tan(math.radians(nozzle.cone_deg))
        assert half == pytest.approx(2.5, abs=0.01) or not brass, "2 mm above the tip it is 5 mm wide"
        assert (nozzle.cone_mm, nozzle.barrel_width_mm) == ((2.0, 8.08) if brass else (0.0, 0.0))


@pytest.mark.parametrize("name", known_nozzles())
def test_a_profile_takes_every_nozzle(name):
    known = nozzle_called(name)
    nozzle = profiles.load("marlin-syringe", [*known.settings(), "nozzle.press_mm=0.07"]).nozzle
    assert (nozzle.name, nozzle.press_mm) == (name, 0.07)
    for key in ("tip_width_mm", "cone_deg", "cone_mm", "length_mm", "barrel_width_mm", "shoulder_width_mm"):
        assert getattr(nozzle, key) == getattr(known, key)


def test_a_needle_comes_in_lengths_and_a_name_in_either_case():
    usual, long = nozzle_called("25g"), nozzle_called("25G-25.4")
    assert (usual.length_mm, long.length_mm) == (12.7, 25.4)
    assert usual.tip_width_mm == long.tip_width_mm == 0.5144


def test_a_name_that_is_none_is_answered_with_one_that_is():
    with pytest.raises(ProfileError, match=r"there is no nozzle 'tapred-25G'. Did you mean 'tapered-25G'\?"):
        nozzle_called("tapred-25G")
