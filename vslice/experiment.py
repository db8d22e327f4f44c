"""One task of a study: a sheet is made, ordered and measured; and what a study may vary."""

import hashlib
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import profiles
from studies import Vocabulary
from studies.design import Check
from vslice.options import METHOD_NAMES, with_nozzle

CALL = "vslice.experiment:experiment"
"""By what name workers find it."""

FIGURES: dict[str, type] = {
    "grid_sha256": str, "toolpaths": int, "pieces": int, "cuts": int, "printed_mm": float, "travel_mm": float,
    "travel_bound_mm": float, "unit": str, "cost": float, "bound": float, "gap": float, "proved": bool,
    "stopped": bool, "nodes_visited": int, "states_created": int, "search_s": float, "routed_mm": float,
    "beads": int, "pressed_mm": float, "printing_s": float, "travel_s": float, "total_s": float,
    "version": str,
}  # fmt: skip
"""What a task gives: the figures of ``Result``, and with ``program = true`` those of the whole program."""

WALK = ("tile_mm", "spacing_mm", "start_deg", "deviation_deg", "low_deg", "high_deg")
SEARCH = ("method", "effort", "objective", "start", "conflicts", "seed")
USUAL: dict[str, Any] = {
    "machine": "marlin-generic", "method": "auto", "effort": "default", "objective": "time",
    "start": "corner", "conflicts": "cut", "seed": 0,
}  # fmt: skip
"""Levels of factors that a study does not name, as for ``vslice slice``; its rows have them."""
DEFAULTS: dict[str, Any] = {"tiles": "4x4", "sheet": 0} | USUAL
"""With those of ``vslice generate``."""


def experiment(task: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of one sheet, ordered in one way.

    Args:
        task: factors by name, see ``VOCABULARY``, and ``program``.
    """
    import numpy as np

    from vslice import __version__
    from vslice.pipeline import Search, hatched, ordered, slice_grid

    asked = DEFAULTS | dict(task)
    sheet = _sheet(asked)
    overrides = _overrides(task)
    search = Search(**{name: asked[name] for name in SEARCH})
    found: dict[str, Any] = {"grid_sha256": _hash(sheet), "version": __version__}
    if not task.get("program"):
        profile = _profile(asked["machine"], overrides)
        shaped, _, result, _ = ordered(sheet, hatched(sheet), profile, search)
    else:
        machine = _same_profile(asked["machine"])
        sliced = slice_grid(sheet, machine, overrides, search=search, step=lambda name: None)
        shaped, result, times = sliced.printable, sliced.result, sliced.program.times
        deepest = None if sliced.pressing is None else sliced.pressing.deepest
        found |= {
            "routed_mm": sliced.plan.routed_mm,
            "beads": sliced.plan.beads,
            "pressed_mm": None if deepest is None else deepest.depth_mm,
            "printing_s": times.printing_s,
            "travel_s": times.travel_s,
            "total_s": float(sum(times)),
        }
    segments = shaped.lines.segments
    found["toolpaths"], found["pieces"] = shaped.hatch_lines, len(segments)
    found["cuts"] = found["pieces"] - found["toolpaths"]
    found["printed_mm"] = float(np.hypot(*(segments[:, 1] - segments[:, 0]).T).sum())
    return found | _of_result(result)


def _of_result(result: Any) -> dict[str, Any]:
    return {
        "travel_mm": result.travel_mm,
        "travel_bound_mm": result.lower_bound_mm,
        "unit": result.unit,
        "cost": result.cost,
        "bound": result.lower_bound,
        "gap": result.gap,
        "proved": result.proved,
        "stopped": result.stopped,
        "nodes_visited": result.nodes_visited,
        "states_created": result.states_created,
        "search_s": result.runtime_s,
    }


def warm_up() -> None:
    """Load, or compile, what tasks run, before the first is timed."""
    for method, objective in (("greedy", "straight"), ("auto", "straight"), ("auto", "time")):
        experiment({"tiles": "2x2", "machine": "paper", "method": method, "objective": objective})


def _sheet(asked: Mapping[str, Any]) -> Any:
    if "grid" in asked:
        from slicer import grid

        return grid.read(_same(asked["grid"]))
    if "image" in asked:
        return _measured(asked)
    from slicer.generate import random_walk

    cols, rows = map(int, asked["tiles"].split("x"))
    walk = {name: float(asked[name]) for name in WALK if name in asked}
    if "tilts" in asked:
        walk["low_deg"], walk["high_deg"] = map(float, asked["tilts"].split(".."))
    low, high = walk.get("low_deg", -45.0), walk.get("high_deg", 0.0)
    walk.setdefault("start_deg", min(max(-45.0, low), high))
    return random_walk(cols, rows, seed=int(asked["sheet"]), **walk)


def _measured(asked: Mapping[str, Any]) -> Any:
    from tissue.image import measure_image
    from tissue.orient import orient
    from tissue.settings import ImageSettings, Layout

    cols, rows = map(int, asked["tiles"].split("x"))
    layout = Layout(
        tiles=(cols, rows), size_mm=float(asked["size_mm"]), spacing_mm=float(asked.get("spacing_mm", 0.4))
    )
    return orient(measure_image(_same(asked["image"]), ImageSettings(), layout), layout).sheet


def _same(text: str) -> Path:
    """The file of a level, which is its path and the begin of its hash; it must not have changed since.

    Raises:
        ValueError: it has.
    """
    name, _, digest = text.rpartition("#")
    if _digest(Path(name)) != digest:
        raise ValueError(f"{name} has changed since the study was begun")
    return Path(name)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


def _hash(sheet: Any) -> str:
    from slicer import grid

    return hashlib.sha256(grid.dumps(sheet).encode("utf-8")).hexdigest()


def _profile(machine: str, overrides: tuple[str, ...]) -> profiles.Profile:
    name = _same_profile(machine)
    return _shipped(name, overrides) if name == machine else profiles.load(name, overrides)


@lru_cache(maxsize=64)
def _shipped(machine: str, overrides: tuple[str, ...]) -> profiles.Profile:
    """To read and check a profile takes longer than to order a tiny sheet."""
    return profiles.load(machine, overrides)


def _same_profile(level: str) -> str:
    """The shipped name or the file of a level; a file must say the same as when the study was begun.

    Raises:
        ValueError: it does not.
    """
    name, _, digest = level.rpartition("#")
    if name and _said(name) != digest:
        raise ValueError(f"{name} has changed since the study was begun")
    return name or level


def _said(profile: str) -> str:
    """Begin of the hash of what a profile says, with all that it extends."""
    return hashlib.sha256(profiles.load(profile).model_dump_json().encode()).hexdigest()[:12]


def _overrides(task: Mapping[str, Any]) -> tuple[str, ...]:
    settings = tuple(f"{name}={value}" for name, value in task.items() if "." in name)
    return with_nozzle(task.get("nozzle"), settings)


def _words(*known: str) -> Check:
    def check(value: Any, folder: Path) -> list[Any]:
        if value not in known:
            raise ValueError(f"{value!r} must be one of {', '.join(known)}")
        return [value]

    return check


def _matching(pattern: str, what: str) -> Check:
    def check(value: Any, folder: Path) -> list[Any]:
        if not isinstance(value, str) or re.fullmatch(pattern, value) is None:
            raise ValueError(f"{value!r} is no {what}")
        return [value]

    return check


def _number(low: float, high: float, *, whole: bool = False) -> Check:
    def check(value: Any, folder: Path) -> list[Any]:
        fits = isinstance(value, int) or (isinstance(value, float) and not whole)
        if not fits or isinstance(value, bool) or not low <= value <= high:
            kind = "whole number" if whole else "number"
            raise ValueError(f"{value!r} must be a {kind} from {low:g} to {high:g}")
        return [value if whole else float(value)]

    return check


def _files(*endings: str) -> Check:
    """A file, or all of a folder; each level is the path and the begin of the hash of what is in it."""

    def check(value: Any, folder: Path) -> list[Any]:
        place = folder / str(value)
        found = sorted(place.iterdir()) if place.is_dir() else [place]
        found = [file for file in found if file.name.lower().endswith(endings)]
        if not found:
            raise ValueError(f"{place} is no file or folder of {', '.join(endings)}")
        return [f"{file.resolve()}#{_digest(file)}" for file in found]

    return check


def _machine(value: Any, folder: Path) -> list[Any]:
    known = profiles.shipped()
    if value in known:
        return [value]
    file = folder / str(value)
    if not file.is_file():
        raise ValueError(f"{value!r} is no shipped profile ({', '.join(known)}) and no file")
    try:
        return [f"{file.resolve()}#{_said(str(file))}"]
    except profiles.ProfileError as error:
        raise ValueError(str(error)) from None


def _nozzle(value: Any, folder: Path) -> list[Any]:
    from profiles.nozzles import known_nozzles

    if value not in (known := known_nozzles()):
        raise ValueError(f"there is no nozzle {value!r}; known: {', '.join(known)}")
    return [value]


def _setting(value: Any, folder: Path) -> list[Any]:
    return [float(value) if isinstance(value, int) and not isinstance(value, bool) else value]


VOCABULARY: Vocabulary = {
    "tiles": _matching(r"[1-9]\d{0,3}x[1-9]\d{0,3}", "number of tiles such as 4x4"),
    "sheet": _number(0, 2**62, whole=True),
    "tilts": _matching(r"-?\d+(\.\d+)?\.\.-?\d+(\.\d+)?", "range of tilts such as -45..0"),
    "tile_mm": _number(0.01, 10_000),
    "spacing_mm": _number(0.01, 10_000),
    "start_deg": _number(-90, 90),
    "deviation_deg": _number(0, 180),
    "low_deg": _number(-90, 90),
    "high_deg": _number(-90, 90),
    "grid": _files(".json", ".geojson"),
    "image": _files(".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"),
    "size_mm": _number(0.01, 10_000),
    "machine": _machine,
    "nozzle": _nozzle,
    "method": _words(*METHOD_NAMES),
    "effort": _words("quick", "default", "high"),
    "objective": _words("straight", "routed", "time"),
    "start": _words("corner", "free"),
    "conflicts": _words("cut", "press", "refuse"),
    "seed": _number(0, 2**62, whole=True),
    **{f"{section}.": _setting for section in ("machine", "motion", "material", "nozzle")},
}
"""What a study may vary: the sheet, the machine with any setting of its profile, and the search."""
