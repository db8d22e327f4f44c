"""A command as a code and words: one form for what can be written in many, and a refusal for the rest.

The measure is Marlin's parser (gcode/parser.cpp). It skips silently what it does not understand, and takes
one of two equal letters by how it was built; what it would skip or guess is refused here.
"""

import re

from dialect.commands import CODE
from dialect.errors import ReadError

NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
WORD = re.compile(rf"([A-Z])[ \t]*({NUMBER})?(?![0-9.])[ \t]*")
WORDS = re.compile(rf"(?:[A-Z][ \t]*(?:{NUMBER})?(?![0-9.])[ \t]*)*")
MACRO = re.compile(r"(?:[A-Z]{2}[A-Z_]|[A-Z]_[A-Z])\w*(?=\s|$)")  # of a host or another firmware
EXPONENT = re.compile(r"[0-9.]e[-+]?[0-9]")
COMMANDS = "GMTDO"
NEED_NUMBERS = frozenset({"G0", "G1", "G2", "G3", "G4", "G5", "G92"})
TEXTS = frozenset(f"M{code}" for code in (
    0, 1, 16, 23, 28, 29, 30, 32, 33, 36, 37, 38, 39, 98, 117, 118, 471, 486, 505, 540, 544, *range(550, 555),
    587, 588, 589, 591, *range(750, 757), *range(810, 820), 862, 928,
))  # fmt: skip
"""Commands behind which a text, or the name of something, may stand."""
NUMBERS_ALONE = frozenset(f"M{code}" for code in (
    3, 4, 5, 42, 73, 82, 83, 84, 92, 104, 106, 107, 109, 140, 141, 190, 191, 201, 203, 204, 205, 206, 211,
    220, 221, 280, 302, 400, 566, 572,
))  # fmt: skip
"""Commands that mean numbers: anything else behind them would be skipped or guessed."""
MAX_DIGITS = 9
SHOWN = 40


def canonical(text: str) -> str:
    """A command in capitals with one blank between its words: ``g01 x 1y+.5`` becomes ``G1 X1 Y+.5``.

    Raises:
        ReadError: it is no command, or one that Marlin would read otherwise than it looks.
    """
    upper = text.upper()
    code = CODE.match(upper)
    if code is None or code[1] not in COMMANDS:
        if MACRO.match(upper):
            name, _, rest = text.partition(" ")
            return f"{name.upper()} {rest.strip()}".rstrip()
        raise ReadError(_no_command(upper))
    name = code[1] + str(int(code[2])) + (f".{int(code[3])}" if code[3] and int(code[3]) else "")
    if text[0].isupper() and (exponent := EXPONENT.search(text)):
        raise ReadError(f"'{_word_around(text, exponent.start())}' has an exponent, which Marlin cannot read")
    rest = upper[code.end() :].strip(" \t")
    if not rest:
        return name
    base = name.partition(".")[0]
    if WORDS.fullmatch(rest) and (base not in TEXTS or _each_once(rest)):
        return " ".join((name, *_words(name, rest)))
    if name[0] == "G" or base in NUMBERS_ALONE:
        good = WORDS.match(rest)
        bad = rest[good.end() if good else 0 :]
        raise ReadError(f"{name}: {bad[:20]!a} is no word of a letter and a number")
    return name + " " + (text[code.end() :].strip(" \t") if '"' in rest else " ".join(rest.split()))


def _each_once(rest: str) -> bool:
    """Whether it is words at all; ``M486 AName`` is a text."""
    letters = [letter for letter, _ in WORD.findall(rest)]
    return len(set(letters)) == len(letters)


def _words(name: str, rest: str) -> list[str]:
    words = {}
    for letter, number in WORD.findall(rest):
        if letter in words:
            raise ReadError(f"{name}: {letter} stands twice in the line; Marlin would obey one of them")
        if letter in "GM" and number:
            raise ReadError(
                f"{name}: {letter}{number} in the same line would be skipped by Marlin; "
                "give each command a line of its own"
            )
        if not number and name in NEED_NUMBERS:
            raise ReadError(f"{name}: {letter} has no number behind it")
        if len(number.partition(".")[0].lstrip("+-0")) > MAX_DIGITS:
            raise ReadError(f"{name}: {letter}{number:.12}.. has more than {MAX_DIGITS} digits")
        words[letter] = letter + number
    return list(words.values())


def _no_command(upper: str) -> str:
    if re.match(rf"[A-Z][ \t]*{NUMBER}", upper):
        return f"{upper[:SHOWN]!a} has words but no G0 or G1 before them, which is not read here"
    return f"{upper[:SHOWN]!a} is no G-code command"


def _word_around(text: str, place: int) -> str:
    start = max(text.rfind(" ", 0, place) + 1, place - SHOWN)
    return text[start : start + SHOWN].split()[0]


def values_of(command: str) -> dict[str, float | None]:
    """The words behind the code of a clean command, and their numbers; None where there is none.

    What is no word, as in a text, is left out.
    """
    _, _, rest = command.partition(" ")
    return {letter: float(number) if number else None for letter, number in WORD.findall(rest)}
