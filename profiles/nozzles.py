"""Nozzles by name: needles, tapered tips and brass nozzles, each with where its dimensions come from."""

import difflib
import json
from functools import cache
from importlib import resources
from typing import NamedTuple

from profiles.load import ProfileError
from profiles.sections import DIMENSIONS


class KnownNozzle(NamedTuple):
    """A nozzle that can be bought.

    Attributes:
        name: what it is asked for by, such as 25G.
        what: in words.
        bore_mm: inner diameter at the tip.
        tip_width_mm, cone_deg, cone_mm, length_mm, barrel_width_mm, shoulder_width_mm: see
            ``profiles.sections.Nozzle``.
        source: where the dimensions stand.
        unverified: what of them no maker's sheet was found for; empty where all is known.
    """

    name: str
    what: str
    bore_mm: float
    tip_width_mm: float
    cone_deg: float
    cone_mm: float
    length_mm: float
    barrel_width_mm: float
    shoulder_width_mm: float
    source: str
    unverified: str

    def settings(self) -> list[str]:
        """This nozzle as settings of a profile, each "section.key=value"."""
        return [
            *(f"nozzle.{key}={float(getattr(self, key))}" for key in DIMENSIONS),
            f'nozzle.name="{self.name}"',
        ]


@cache
def known_nozzles() -> dict[str, KnownNozzle]:
    """All nozzles that come with vslice, by name, from wide to narrow within each kind.

    A needle comes in several lengths: 25G is the usual one, 25G-25.4 one with another length in mm.
    """
    data = json.loads(resources.files("profiles").joinpath("nozzles.json").read_text("utf-8"))
    found = []
    for kind in data["kinds"]:
        for size in kind["sizes"]:
            said = {"barrel_width_mm": 0.0, "cone_mm": 0.0} | kind | size
            both = {key: value for key, value in said.items() if key in KnownNozzle._fields}
            usual, *others = kind["lengths_mm"]
            what = kind["what"].format(**size)
            found.append(KnownNozzle(**both | {"what": what, "length_mm": usual}))
            for length in others:
                name = f"{size['name']}-{length:g}"
                found.append(KnownNozzle(**both | {"what": what, "name": name, "length_mm": length}))
    return {nozzle.name: nozzle for nozzle in found}


def nozzle_called(name: str) -> KnownNozzle:
    """The nozzle of a name, in capitals or not.

    Raises:
        ProfileError: there is none.
    """
    by_name = {known.upper(): nozzle for known, nozzle in known_nozzles().items()}
    if name.upper() in by_name:
        return by_name[name.upper()]
    near = difflib.get_close_matches(name.upper(), by_name, n=1)
    hint = f"Did you mean '{by_name[near[0]].name}'? " if near else ""
    raise ProfileError(f"there is no nozzle '{name}'. {hint}'vslice profiles nozzles' lists them.")
