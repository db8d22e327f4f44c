"""Lines of G-code with named placeholders, ``M109 S{nozzle_temperature_c}``."""

import difflib
import string
from collections.abc import Mapping, Sequence

from dialect.errors import ReadError
from dialect.flavor import MARLIN, Flavor
from dialect.numbers import plain
from dialect.reader import clean


def check_template(line: str, values: Mapping[str, object], flavor: Flavor = MARLIN) -> str | None:
    """What is wrong with a line, or None: an unknown placeholder, a stray brace, a control character."""
    try:
        parts = list(string.Formatter().parse(line))
    except ValueError as error:
        return f"'{line}': {error}; write {{{{ for a brace"
    for _, name, spec, conversion in parts:
        if name is None:
            continue
        if spec or conversion:
            return f"'{line}': write {{{name}}} without a format"
        if name not in values:
            near = difflib.get_close_matches(name, values, n=1)
            hint = f"; did you mean {{{near[0]}}}?" if near else ""
            return f"'{line}': unknown placeholder {{{name}}}{hint}"
    if not line.isprintable():
        return f"{line!r} holds a control character; give one line of G-code an entry"
    try:
        clean(render([line], values)[0], flavor)
    except ReadError as error:
        return f"'{line}': {error}"
    return None


def render(lines: Sequence[str], values: Mapping[str, object]) -> list[str]:
    """The lines with every placeholder replaced; numbers in their shortest form, 60 rather than 60.0."""
    shown = {name: plain(value) if isinstance(value, float) else str(value) for name, value in values.items()}
    return [line.format_map(shown) for line in lines]
