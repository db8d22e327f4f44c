"""The one way in which numbers are written into a program: decimals, never an exponent, never "-0".

Marlin ends a number at its ``E`` (``value_float`` in its gcode/parser.h), so what other programs write as
``E-8e-05`` draws back 8 mm instead of 0.00008 mm.
"""

import math

POSITION_DECIMALS = 3
FEED_DECIMALS = 5


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals.

    Raises:
        ValueError: it is infinite, or not a number: no machine can be told so.
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot be written into a program")
    text = f"{value:.{decimals}f}"
    return text[1:] if text[0] == "-" and not text.strip("-0.") else text


def plain(value: float, decimals: int = 6) -> str:
    """The same without zeros at its end: 60 rather than 60.000000."""
    text = fixed(value, decimals)
    return text.rstrip("0").rstrip(".") if "." in text else text


def position(mm: float) -> str:
    """A coordinate, with three decimals."""
    return fixed(mm, POSITION_DECIMALS)


def feed(mm: float) -> str:
    """A length of feed, with five decimals."""
    return fixed(mm, FEED_DECIMALS)


def rate(mm_s: float) -> str:
    """A speed as F in mm/min, rounded down to a tenth, so that no limit is exceeded; at least a tenth."""
    tenths = max(1, math.floor(mm_s * 600 + 1e-6))
    return plain(tenths / 10, 1)
