"""Figures of many sheets: means with intervals, differences of pairs, effects of factors, scaling laws."""

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

CONFIDENCE = 0.95
RESAMPLES = 2000
SAME = 1e-9
"""Part of a value by which roundings may differ."""
SEED = 0
"""The same rows give the same intervals."""
PERCENTILES = (1, 25, 50, 75, 99)

Values = NDArray[np.float64]


class Interval(NamedTuple):
    """An estimate with its bootstrap interval; the limits are NaN where one value is too few."""

    value: float
    low: float
    high: float
    rows: int


def mean(values: Values) -> Interval:
    """The mean, with the bias-corrected and accelerated bootstrap of Efron (1987), by scipy."""
    return bootstrapped((values,), np.mean)


def bootstrapped(
    samples: tuple[Values, ...], statistic: Callable[..., Any], *, paired: bool = False
) -> Interval:
    """A statistic of samples and its interval; percentiles of the bootstrap where BCa has no answer."""
    from scipy import stats

    value, count = float(statistic(*samples)), len(samples[0])
    if count < 2:
        return Interval(value, float("nan"), float("nan"), count)
    if all(np.ptp(sample) <= SAME * np.abs(sample).max() for sample in samples):
        return Interval(value, value, value, count)
    random = np.random.default_rng(SEED)
    # BCa needs the statistic without each value in turn; of very many values percentiles are as good.
    method = "BCa" if count <= 2000 else "percentile"
    with np.errstate(all="ignore"):
        found = stats.bootstrap(
            samples, statistic, paired=paired, vectorized=True, n_resamples=RESAMPLES, method=method,
            confidence_level=CONFIDENCE, rng=random, batch=max(1, int(4e6 / count)),
        ).confidence_interval  # fmt: skip
    return Interval(value, float(found.low), float(found.high), count)


def grouped(keys: Iterable[Hashable], values: Values) -> dict[Any, Values]:
    """The values of each key, in the order in which keys appear; NaN left out."""
    found: dict[Any, list[float]] = {}
    for key, value in zip(keys, values.tolist(), strict=True):
        if not np.isnan(value):
            found.setdefault(key, []).append(value)
    return {key: np.array(some) for key, some in found.items()}


class Difference(NamedTuple):
    """How a level differs from the first one on the same sheets, in the unit of the figure and in percent."""

    absolute: Interval
    percent: Interval
    wins: float
    """Share of the sheets on which the level's figure is the less."""
    differ: bool
    """Whether they do on any sheet."""


def paired(first: dict[Any, float], other: dict[Any, float]) -> Difference | None:
    """Compare two levels on the sheets that both have; None where they share none."""
    shared = [key for key in first if key in other]
    if not shared:
        return None
    a = np.array([first[key] for key in shared])
    b = np.array([other[key] for key in shared])
    both, nan = a != 0, float("nan")
    percent = mean(100 * (b[both] / a[both] - 1)) if both.any() else Interval(nan, nan, nan, 0)
    return Difference(mean(b - a), percent, float((b < a).mean()), bool((a != b).any()))


class Law(NamedTuple):
    """y = factor * x ** exponent, fitted by least squares in the logarithms."""

    exponent: Interval
    factor: float
    r_squared: float


def scaling(x: Values, y: Values) -> Law | None:
    """The power law of y over x, its exponent with an interval from sheets drawn anew.

    Returns:
        None where there are fewer than three sizes, or a value is not above 0.
    """
    fine = (x > 0) & (y > 0)
    x, y = np.log(x[fine]), np.log(y[fine])
    if len(np.unique(x)) < 3:
        return None
    exponent = bootstrapped((x, y), _slope, paired=True)
    offset = float(y.mean() - exponent.value * x.mean())
    rest = y - (offset + exponent.value * x)
    spread = float(((y - y.mean()) ** 2).sum())
    return Law(exponent, float(np.exp(offset)), 1 - float((rest**2).sum()) / spread if spread > 0 else 1.0)


def _slope(x: Values, y: Values, axis: int = -1) -> Any:
    dx = x - x.mean(axis=axis, keepdims=True)
    spread = (dx**2).sum(axis=axis)
    up = (dx * (y - y.mean(axis=axis, keepdims=True))).sum(axis=axis)
    return np.divide(up, spread, out=np.full_like(up, np.nan), where=spread > 0)


def percentiles(values: Values) -> Sequence[float]:
    """Those of ``PERCENTILES``."""
    return [float(value) for value in np.percentile(values, PERCENTILES)]
