"""The design of a study: factors with their levels, and the tasks that are their product or a sample."""

import hashlib
import itertools
import json
import math
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from studies.errors import StudyError

MOST_TASKS = 10_000_000
DESIGNS = ("product", "latin-hypercube")
Check = Callable[[Any, Path], list[Any]]
Vocabulary = Mapping[str, Check]
"""What a study may vary: name of a factor, and what turns a level of the file into levels; a name that ends
in "." stands for all that begin so. A check raises ValueError with what is wrong.
"""


@dataclass(frozen=True)
class Factor:
    """What a study varies.

    Attributes:
        name: as the vocabulary has it.
        levels: its values; of a range those of a product.
        limits: (low, high) where it is a range, from which a Latin hypercube draws.
        log: whether the range is even in the logarithm.
        whole: whether its values are whole numbers.
    """

    name: str
    levels: tuple[Any, ...]
    limits: tuple[float, float] | None = None
    log: bool = False
    whole: bool = False

    def at(self, share: float) -> Any:
        """The value at a share of the range, 0 to 1; of levels the one that lies there."""
        if self.limits is None:
            return self.levels[min(int(share * len(self.levels)), len(self.levels) - 1)]
        low, high = self.limits
        if self.whole:
            value = low + math.floor(share * (high - low + 1))
            return int(min(value, high))
        if self.log:
            return float(math.exp(math.log(low) + share * (math.log(high) - math.log(low))))
        return float(low + share * (high - low))


@dataclass(frozen=True)
class Study:
    """A study as it was asked for.

    Attributes:
        title: for people.
        factors: in the order of the file; in a product the last one changes fastest.
        samples: how many points of a Latin hypercube; None for the product.
        seed: of the hypercube.
        options: what holds for all tasks.
        figures: what its report shows; none for what says most.
    """

    title: str
    factors: tuple[Factor, ...]
    samples: int | None = None
    seed: int = 0
    options: tuple[tuple[str, Any], ...] = ()
    figures: tuple[str, ...] = ()

    def __len__(self) -> int:
        return math.prod(len(f.levels) for f in self.factors) if self.samples is None else self.samples

    def tasks(self) -> Iterator[dict[str, Any]]:
        """Factor values of each task, in the canonical order, and the options."""
        names = [factor.name for factor in self.factors]
        for values in self._points():
            yield dict(zip(names, values, strict=True)) | dict(self.options)

    def _points(self) -> Iterator[Sequence[Any]]:
        if self.samples is None:
            yield from itertools.product(*(factor.levels for factor in self.factors))
            return
        # McKay, Beckman and Conover (1979): each factor has one point in each of equally likely strata.
        random = np.random.default_rng(self.seed)
        strata = np.stack([random.permutation(self.samples) for _ in self.factors], axis=1)
        shares = (strata + random.random(strata.shape)) / self.samples
        for row in shares.tolist():
            yield [factor.at(share) for factor, share in zip(self.factors, row, strict=True)]

    def said(self) -> dict[str, Any]:
        """What tells this study from another one, as JSON holds it."""
        return {
            "title": self.title,
            "samples": self.samples,
            "seed": self.seed if self.samples is not None else None,
            "options": dict(self.options),
            "factors": {
                factor.name: list(factor.levels) if factor.limits is None or self.samples is None else {
                    "limits": list(factor.limits), "log": factor.log, "whole": factor.whole,
                }
                for factor in self.factors
            },
        }  # fmt: skip


def key_of(task: Mapping[str, Any]) -> str:
    """What a task is known by: the hash of its values, whatever their order."""
    text = json.dumps(task, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def shipped() -> dict[str, str]:
    """Names of the studies that come with the software, and their titles."""
    found = {}
    for entry in sorted(files("studies").joinpath("shipped").iterdir(), key=lambda entry: entry.name):
        if entry.name.endswith(".toml"):
            found[entry.name.removesuffix(".toml")] = str(tomllib.loads(entry.read_text("utf-8"))["title"])
    return found


def read_study(
    name: str,
    vocabulary: Vocabulary,
    usual: Mapping[str, Any] | None = None,
    figures: Collection[str] | None = None,
) -> Study:
    """Read a study file, or a shipped study by its name.

    Args:
        usual: levels of factors that the file does not name; every row has them, whatever they are one day.
        figures: what a report can show; None where that is not known.

    Raises:
        StudyError: there is none, or what is wrong in it, by its key.
    """
    path = Path(name)
    if not path.is_file() and name in (known := shipped()):  # a folder of that name holds its results
        text, source = files("studies").joinpath("shipped", f"{name}.toml").read_text("utf-8"), name
    else:
        known = shipped()
        source = str(path)
        try:
            text = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else "is no text"
            hint = f" Shipped studies: {', '.join(known)}." if len(path.parts) == 1 else ""
            raise StudyError(f"{source}: cannot be read: {why}.{hint}") from None
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{source}: is no TOML: {error}") from None
    study = _study(table, source, path.parent, vocabulary)
    named = {factor.name for factor in study.factors}
    options = tuple((key, value) for key, value in (usual or {}).items() if key not in named)
    return replace(study, options=study.options + options, figures=_shown(table, source, figures))


def _shown(table: dict[str, Any], source: str, known: Collection[str] | None) -> tuple[str, ...]:
    shown = table.get("figures", [])
    if not isinstance(shown, list):
        raise StudyError(f"{source}: figures {shown!r} must be a list of names.")
    for name in shown:
        if known is not None and name not in known:
            raise StudyError(f"{source}: there is no figure {name!r}; known: {', '.join(known)}.")
    return tuple(shown)


def _study(table: dict[str, Any], source: str, folder: Path, vocabulary: Vocabulary) -> Study:
    known = {"title", "design", "samples", "seed", "program", "figures", "factors"}
    for key in table.keys() - known:
        raise StudyError(f"{source}: there is no key '{key}'; known: {', '.join(sorted(known))}.")
    design = table.get("design", "product")
    if design not in DESIGNS:
        raise StudyError(f"{source}: design '{design}' must be one of {', '.join(DESIGNS)}.")
    samples = table.get("samples")
    if (design == "product") != (samples is None):
        raise StudyError(f"{source}: samples belong to a latin-hypercube, and it needs them.")
    if samples is not None and not (_whole(samples) and 1 <= samples <= MOST_TASKS):
        raise StudyError(f"{source}: samples {samples!r} must be a whole number from 1 to {MOST_TASKS}.")
    seed = table.get("seed", 0)
    if not (_whole(seed) and 0 <= seed < 2**63):
        raise StudyError(f"{source}: seed {seed!r} must be a whole number from 0 to 2^63 - 1.")
    if not isinstance(table.get("program", False), bool):
        raise StudyError(f"{source}: program {table['program']!r} must be true or false.")
    factors = table.get("factors")
    if not isinstance(factors, dict) or not factors:
        raise StudyError(f"{source}: [factors] is missing: say there what varies.")
    found = tuple(
        _factor(name, value, source, folder, vocabulary, sampled=samples is not None)
        for name, value in _flat(factors)
    )
    study = Study(
        str(table.get("title", source)), found, samples, seed, (("program", table.get("program", False)),)
    )
    if len(study) > MOST_TASKS:
        raise StudyError(f"{source}: the product has {len(study)} tasks; {MOST_TASKS} is the most.")
    return study


def _flat(factors: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Factors, of which settings of a profile may stand in tables of their section."""
    for name, value in factors.items():
        inner = isinstance(value, dict) and not value.keys() & {"count", "low", "high"}
        if inner and value:
            yield from ((f"{name}.{key}", level) for key, level in value.items())
        else:
            yield name, value


def _factor(
    name: str, value: Any, source: str, folder: Path, vocabulary: Vocabulary, *, sampled: bool
) -> Factor:
    where = f"{source}: factors.{name}"
    check = vocabulary.get(name) or vocabulary.get(name.partition(".")[0] + ".")
    if check is None:
        raise StudyError(f"{where}: there is no such factor; known: {', '.join(sorted(vocabulary))}.")
    factor = _range(name, value, where, sampled=sampled) if isinstance(value, dict) else None
    if factor is None:
        factor = Factor(name, tuple(value) if isinstance(value, list) else (value,))
    levels: list[Any] = []
    try:
        for level in factor.levels:
            levels += check(level, folder)
    except (ValueError, OSError) as error:
        raise StudyError(f"{where}: {error}") from None
    if not levels:
        raise StudyError(f"{where}: has no levels.")
    if len({json.dumps(level) for level in levels}) < len(levels):
        raise StudyError(f"{where}: a level stands there twice.")
    if len({type(level) if isinstance(level, str | bool) else float for level in levels}) > 1:
        raise StudyError(f"{where}: numbers and words cannot be levels of one factor.")
    return Factor(name, tuple(levels), factor.limits, factor.log, factor.whole)


def _range(name: str, value: dict[str, Any], where: str, *, sampled: bool) -> Factor:
    if "count" in value:
        _only(value, {"count", "first"}, where)
        count, first = value["count"], value.get("first", 0)
        if not (_whole(count) and _whole(first) and 1 <= count <= MOST_TASKS and first >= 0):
            raise StudyError(f"{where}: count and first must be whole numbers, count from 1 to {MOST_TASKS}.")
        return Factor(name, tuple(range(first, first + count)))
    _only(value, {"low", "high", "steps", "log", "whole"}, where)
    low, high = value.get("low", math.nan), value.get("high", math.nan)
    if not (
        isinstance(low, int | float) and isinstance(high, int | float) and -math.inf < low < high < math.inf
    ):
        raise StudyError(f"{where}: a range needs low and high, numbers of which low is the lesser.")
    log, whole = bool(value.get("log", False)), bool(value.get("whole", False))
    if log and low <= 0:
        raise StudyError(f"{where}: a range with log must begin above 0, not at {low}.")
    if whole and not (_whole(low) and _whole(high)):
        raise StudyError(f"{where}: the limits of whole numbers must be whole, not {low} and {high}.")
    steps = value.get("steps", 0 if not sampled else 2)
    if not _whole(steps) or not 2 <= steps <= MOST_TASKS:
        raise StudyError(f"{where}: in a product a range needs steps, a whole number of 2 or more.")
    inner = np.geomspace(low, high, steps) if log else np.linspace(low, high, steps)
    values = [float(f"{v:.12g}") for v in inner]
    levels = dict.fromkeys(round(v) for v in values) if whole else dict.fromkeys(values)
    return Factor(name, tuple(levels), (float(low), float(high)), log, whole)


def _only(value: Mapping[str, Any], known: set[str], where: str) -> None:
    for key in value.keys() - known:
        raise StudyError(f"{where}: there is no key '{key}'; known: {', '.join(sorted(known))}.")


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
