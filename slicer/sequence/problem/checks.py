"""What a caller may give: numbers of the right kind, in words where they are not."""

from collections.abc import Sequence
from numbers import Integral, Real

import numpy as np

from slicer.errors import SequenceError


def whole_number(what: str, value: object, advice: str, least: int | None = None) -> int:
    """``value`` as an int, if it is a whole number (a truth value is none) and at least ``least``.

    Raises:
        SequenceError: it is not. ``advice`` says what to give instead.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise SequenceError(f"{what} {value!r} must be a whole number. {advice}")
    if least is not None and value < least:
        raise SequenceError(f"{what} {value} must be at least {least}. {advice}")
    return int(value)


def real_number(what: str, value: object, advice: str, least: float, most: float) -> float:
    """``value`` as a float, if it is a number between ``least`` and ``most``, both included.

    Raises:
        SequenceError: it is not, NaN included. ``advice`` says what to give instead.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise SequenceError(f"{what} {value!r} must be a number. {advice}")
    number = float(value)
    if not least <= number <= most:
        allowed = f"at least {least:g}" if np.isinf(most) else f"between {least:g} and {most:g}"
        raise SequenceError(f"{what} {number:g} must be {allowed}. {advice}")
    return number


def three_numbers(
    what: str, values: object, advice: str, least: float, most: float
) -> tuple[float, float, float]:
    """``values`` as (along the travel, along x, along y), each checked as ``real_number`` does."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray) or len(values) != 3:
        raise SequenceError(
            f"{what} {values!r} must be three numbers: of the travel, of x and of y. {advice}"
        )
    along, x, y = (
        real_number(f"{what}, {which}:", value, advice, least, most)
        for which, value in zip(("travel", "x axis", "y axis"), values, strict=True)
    )
    return along, x, y


def truth(what: str, value: object, advice: str) -> bool:
    """``value`` as a bool, if it is one of Python's or numpy's.

    Raises:
        SequenceError: it is not. ``advice`` says what to give instead.
    """
    if not isinstance(value, bool | np.bool_):
        raise SequenceError(f"{what} {value!r} must be True or False. {advice}")
    return bool(value)
