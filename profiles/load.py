"""Profiles from TOML files: shipped ones by name, a user's by path, single settings from the command line."""

import difflib
import tomllib
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from profiles.profile import Profile


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
    source, settings = _settings(name_or_path)
    for override in overrides:
        _override(settings, override)
    try:
        return Profile.model_validate(settings)
    except ValidationError as error:
        problems = [_line(detail) for detail in error.errors(include_url=False)]
        raise ProfileError("\n".join(f"{source}: {problem}" for problem in dict.fromkeys(problems))) from None


def _settings(name_or_path: str, depth: int = 0) -> tuple[str, dict[str, Any]]:
    """Where a profile comes from, and its settings, those of what it extends included."""
    if name_or_path in shipped():
        source = name_or_path
        text = resources.files("profiles").joinpath(f"{name_or_path}.toml").read_text("utf-8")
    else:
        source, text = name_or_path, _read(Path(name_or_path))
    try:
        settings = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProfileError(f"{source}: this is no TOML: {error}.") from None
    base = settings.pop("extends", None)
    if base is None:
        return source, settings
    if not isinstance(base, str) or depth > 8:
        raise ProfileError(f"{source}: extends must name a profile that does not extend this one in turn.")
    near = Path(source).parent / base
    try:
        _, inherited = _settings(str(near) if base not in shipped() and near.is_file() else base, depth + 1)
    except ProfileError as error:
        raise ProfileError(f"{source}: extends = '{base}': {error}") from None
    for section, values in settings.items():
        if isinstance(values, dict) and isinstance(inherited.get(section), dict):
            inherited[section] |= values
        else:
            inherited[section] = values
    return source, inherited


def _read(path: Path) -> str:
    if not path.is_file():
        near = difflib.get_close_matches(str(path), shipped(), n=1)
        hint = f"Did you mean '{near[0]}'?" if near else f"Shipped are {', '.join(shipped())}."
        if path.with_suffix(".toml").is_file():
            hint = f"Did you mean '{path.with_suffix('.toml')}'?"
        raise ProfileError(f"{path}: there is no such profile or file. {hint}")
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ProfileError(f"{path}: cannot be read as text: {error}.") from None


def _override(settings: dict[str, Any], override: str) -> None:
    path, equals, text = override.partition("=")
    section, dot, key = path.strip().partition(".")
    if not (equals and dot and key):
        raise ProfileError(
            f"--set {override}: give section.key=value, for example motion.travel_speed_mm_s=80."
        )
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()  # a bare word is a text
    values = settings.setdefault(section, {})
    if isinstance(values, dict):
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
    if kind in ("greater_than", "greater_than_equal", "less_than_equal"):
        words = {"greater_than": "above", "greater_than_equal": "at least", "less_than_equal": "at most"}
        limit = limits.get("gt", limits.get("ge", limits.get("le")))
        return f"{place}: {found} must be {words[kind]} {limit:g}."
    if kind == "literal_error":
        return f"{place}: {found!r} must be {limits['expected']}."
    if kind in ("missing", "too_long", "tuple_type"):
        field = sections[section].model_fields[str(keys[0])]
        return f"[{section}] {keys[0]}: {found!r:.60} must be {_wanted(field.annotation)}."
    return f"{place}: {found!r:.60}: {detail['msg']}."


def _wanted(annotation: Any) -> str:
    """What a list in a profile must hold, in words."""
    parts = [part for part in get_args(annotation) if part is not type(None)]
    if get_origin(annotation) is not tuple:  # one that may be left out
        parts = list(get_args(parts[0]))
    return "a list of texts" if Ellipsis in parts else f"a list of {len(parts)} numbers"
