"""Profiles from TOML files: shipped ones by name, a user's by path, single settings from the command line."""

import difflib
import tomllib
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dialect.numbers import plain
from profiles.profile import Profile
from profiles.sections import DIMENSIONS

MOST_BYTES = 1_000_000


class ProfileError(Exception):
    """A profile that cannot be used; the text has a line for each thing that is wrong."""


def shipped() -> list[str]:
    """Names of the profiles that come with vslice, in alphabetical order."""
    files = resources.files("profiles").iterdir()
    return sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))


def load(name_or_path: str, overrides: Sequence[str] = ()) -> Profile:
    """Load a profile. What a file leaves out has the default of ``Profile``, or of what it extends.

    Args:
        name_or_path: a shipped name such as "marlin-generic", or the path of a TOML file.
        overrides: settings that come last, each "section.key=value" with the value as in TOML.

    Raises:
        ProfileError: no such profile, no TOML, unknown keys, values out of range, bad templates.
    """
    return made(name_or_path, _settings(name_or_path), overrides)


def made(source: str, settings: dict[str, Any], overrides: Sequence[str] = ()) -> Profile:
    """The profile of the settings of each section, with ``overrides`` on top as in ``load``.

    Raises:
        ProfileError: unknown keys, values out of range, bad templates; each line begins with ``source``.
    """
    for override in overrides:
        _override(settings, override)
    try:
        return Profile.model_validate(settings)
    except ValidationError as error:
        problems = [_line(detail) for detail in error.errors(include_url=False)]
        raise ProfileError("\n".join(f"{source}: {problem}" for problem in dict.fromkeys(problems))) from None


def taken_over(name_or_path: str, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The dimensions of the nozzle that files of one's own take from a shipped profile, though they give
    others: they are of another nozzle. Nothing where they give none, or all that are not 0 there.

    Raises:
        ProfileError: as ``load``, but for values out of range.
    """
    own: set[str] = set()
    found: dict[str, Any] = {}
    for name, settings in _layers(name_or_path):
        nozzle = settings.get("nozzle", {})
        if name not in shipped():
            own |= nozzle.keys()
        else:
            found = nozzle | found
    if not own & set(DIMENSIONS):
        return {}
    own |= {override.partition("=")[0].strip().removeprefix("nozzle.") for override in overrides}
    return {key: found[key] for key in DIMENSIONS if found.get(key) and key not in own}


def _settings(name_or_path: str) -> dict[str, Any]:
    """The settings of a profile, those of all that it extends included."""
    *layers, (_, merged) = _layers(name_or_path)
    for _, settings in reversed(layers):
        for section, values in settings.items():
            if isinstance(values, dict) and isinstance(merged.get(section), dict):
                if section == "nozzle" and values.keys() & set(DIMENSIONS):
                    merged[section].pop("name", None)
                merged[section] |= values
            else:
                merged[section] = values
    return merged


def _layers(name_or_path: str) -> list[tuple[str, dict[str, Any]]]:
    """Name and settings of a profile, then those of each that is extended."""
    chain: list[str] = []
    layers: list[tuple[str, dict[str, Any]]] = []
    seen: set[str | Path] = set()
    name: str | None = name_or_path
    while name is not None:
        file = None if name in shipped() else Path(name)
        chain.append(name)
        where = " -> ".join(chain)
        place = name if file is None else file.resolve()
        if place in seen:
            raise ProfileError(f"{where}: extends goes round in a circle; one of them must extend nothing.")
        seen.add(place)
        settings = _toml(where, name, file)
        base = settings.pop("extends", None)
        if base is not None and not isinstance(base, str):
            raise ProfileError(
                f"{where}: extends is {_shown(base)}; it must name one profile, as a text in quotes."
            )
        layers.append((name, settings))
        # A file is looked for beside the one that names it, wherever vslice was started.
        name = base if base is None or base in shipped() or file is None else str(file.parent / base)
    return layers


def _toml(where: str, name: str, file: Path | None) -> dict[str, Any]:
    """What one file says, that of a shipped profile or ``file``; ``where`` is how it was come to."""
    if file is None:
        text = resources.files("profiles").joinpath(f"{name}.toml").read_text("utf-8")
    else:
        text = _read(where, name, file)
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError) as error:
        raise ProfileError(f"{where}: this is no TOML: {error}.") from None
    except RecursionError:
        raise ProfileError(f"{where}: is nested too deeply; a profile has sections and settings.") from None


def _read(where: str, name: str, path: Path) -> str:
    if not path.exists() or path.is_dir():
        near = difflib.get_close_matches(path.name, shipped(), n=1)
        hint = f"Did you mean '{near[0]}'?" if near else f"Shipped are {', '.join(shipped())}."
        if path.with_name(path.name + ".toml").is_file():
            hint = f"Did you mean '{name}.toml'?"
        raise ProfileError(f"{where}: there is no such profile or file. {hint}")
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ProfileError(f"{where}: cannot be read: {error.strerror}.") from None
    if len(data) > MOST_BYTES:
        raise ProfileError(f"{where}: has more than {MOST_BYTES} bytes; a profile has a few thousand.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ProfileError(f"{where}: cannot be read as text: {error}.") from None


def _override(settings: dict[str, Any], override: str) -> None:
    path, equals, text = override.partition("=")
    section, dot, key = path.strip().partition(".")
    if not (equals and dot and key):
        raise ProfileError(
            f"--set {override}: give section.key=value, for example motion.travel_speed_mm_s=80."
        )
    if not override.isprintable():
        raise ProfileError(f"--set {override!a}: holds a control character; give one setting in one line.")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, ValueError, RecursionError):
        value = text.strip()  # a bare word is a text
    values = settings.setdefault(section, {})
    if isinstance(values, dict):
        if section == "nozzle" and key in DIMENSIONS and values.get(key) != value:
            values.pop("name", None)  # it is another nozzle now
        values[key] = value


def _line(detail: ErrorDetails) -> str:
    loc, kind, found, limits = detail["loc"], detail["type"], detail["input"], detail.get("ctx", {})
    if not loc:  # a validator of the whole profile says where by itself
        return detail["msg"]
    sections: dict[str, type[BaseModel]] = {name: type(value) for name, value in Profile()}
    section = str(loc[0])
    if kind == "extra_forbidden":
        known = sections if len(loc) == 1 else sections[section].model_fields
        what = "unknown section" if len(loc) == 1 else f"[{section}] unknown key"
        near = difflib.get_close_matches(str(loc[-1]), known, n=1)
        owner = [name for name, model in sections.items() if loc[-1] in model.model_fields]
        if owner:
            return f"{what} '{loc[-1]}'. It belongs in [{owner[0]}]."
        hint = f"Did you mean '{near[0]}'?" if near else f"There are {', '.join(known)}."
        return f"{what} '{loc[-1]}'. {hint}"
    keys = [step for step in loc[1:] if isinstance(step, int) or step in sections[section].model_fields]
    place = f"[{section}] " + "".join(f"[{k}]" if isinstance(k, int) else str(k) for k in keys)
    if kind in ("greater_than_equal", "less_than_equal"):
        word, limit = ("at least", limits["ge"]) if "ge" in limits else ("at most", limits["le"])
        return f"{place}: {_shown(found)} must be {word} {plain(limit)}."
    if kind == "literal_error":
        return f"{place}: {_shown(found)} must be {limits['expected']}."
    if kind in ("missing", "too_long", "tuple_type"):
        field = sections[section].model_fields[str(keys[0])]
        return f"[{section}] {keys[0]}: {_shown(found)} must be {_wanted(field.annotation)}."
    return f"{place}: {_shown(found)}: {detail['msg']}."


def _shown(value: object) -> str:
    """A value as it was given, cut where it is long; a whole number may be too long to be written at all."""
    try:
        text = repr(value)
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."


def _wanted(annotation: Any) -> str:
    """What a list in a profile must hold, in words."""
    parts = [part for part in get_args(annotation) if part is not type(None)]
    if get_origin(annotation) is not tuple:  # one that may be left out
        parts = list(get_args(parts[0]))
    return "a list of texts" if Ellipsis in parts else f"a list of {len(parts)} numbers"
