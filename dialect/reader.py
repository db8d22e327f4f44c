"""The reader of programs: whatever writes them, and whoever asks, a line has one command.

What check, preview, send, resume and the dry run know of a program comes from here. It strips what a
printer is not sent (comments, line numbers, checksums, blanks), writes a command in one form, and refuses
what Marlin could not take, or would read otherwise than it looks.
"""

import re
from collections.abc import Iterable, Iterator
from functools import reduce
from operator import xor
from typing import NamedTuple

from dialect.block import commands_of
from dialect.commands import TEXT_COMMANDS
from dialect.errors import ReadError
from dialect.flavor import MARLIN, Flavor
from dialect.line_limits import fault_of
from dialect.words import canonical

MAX_RAW = 100_000
"""Longest line of a file in characters; what is longer is no text."""

_NUM = r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?"
# Nearly every line of a program is a move in the form that is wanted; it need not be taken apart.
_MOVE = re.compile(rf"G[01](?: X{_NUM})?(?: Y{_NUM})?(?: Z{_NUM})?(?: E{_NUM})?(?: F{_NUM})?")
_SURELY_SHORT = 60
_NUMBERED = re.compile(r"[Nn][ \t]*[0-9]+(?![0-9])[ \t]*")
_TEXT = re.compile(r"(?:[Nn][ \t]*[0-9]+[ \t]*)?[Mm][ \t]*0*([0-9]{1,3})(?![0-9.])")
_CHECKSUM = re.compile(r"\*[ \t]*([0-9]{1,3})[ \t]*\Z")
_SPECIAL = re.compile(r"[;()\\]")
_BLANKS = " \t"


class Line(NamedTuple):
    """One line: its number in the file from 1, its command ("" for none), its comment without ``;``."""

    number: int
    command: str
    comment: str | None


def read(lines: Iterable[str], name: str = "", flavor: Flavor = MARLIN) -> Iterator[Line]:
    """Read a program, line by line; see ``dialect.source`` for files.

    A line of grbl may hold several commands: then it gives several, of one number.

    Args:
        lines: with or without their line ends.
        name: of the program, for messages.
        flavor: the firmware that it is for.

    Raises:
        ReadError: a line that is no command, a checksum that does not fit, or what the firmware cannot take.
    """
    motion = "G0"
    for number, raw in enumerate(lines, 1):
        if len(raw) < _SURELY_SHORT and _MOVE.fullmatch(raw) and not flavor.words_per_line:
            yield Line(number, raw, None)
            continue
        try:
            if flavor.words_per_line:
                commands, comment, motion = _block(raw, motion, flavor)
                for k, command in enumerate(commands or [""]):
                    yield Line(number, command, None if k else comment)
            else:
                yield Line(number, *_split(raw, number, flavor))
        except ReadError as error:
            place = f"{name}: line {number}" if name else f"line {number}"
            raise ReadError(f"{place}: {error}") from None


def clean(line: str, flavor: Flavor = MARLIN) -> str:
    """The command of a single line, such as one of a profile or one that was typed; "" for none.

    Raises:
        ReadError: as ``read``, without a place; or it holds several commands.
    """
    if not flavor.words_per_line:
        return _split(line, 1, flavor)[0]
    commands, _, _ = _block(line, "G0", flavor)
    if len(commands) > 1:
        raise ReadError(f"{', '.join(commands)}: give each command a line of its own")
    return commands[0] if commands else ""


def _block(raw: str, motion: str, flavor: Flavor) -> tuple[list[str], str | None, str]:
    """The commands of a line of grbl, its comment, and the move that goes on behind it."""
    text = _plain(raw)
    _, shown, comment = _without_comments(text)
    numbered = _NUMBERED.match(shown.lstrip(_BLANKS))
    shown = shown.lstrip(_BLANKS)[numbered.end() if numbered else 0 :].strip(_BLANKS)
    if not shown.isascii():
        odd = next(letter for letter in shown if not letter.isascii())
        raise ReadError(f"{_legible(odd)!a} is no letter of G-code; only comments may have it")
    size = len(shown.replace(" ", "").replace("\t", ""))  # grbl keeps no blanks
    if flavor.max_line is not None and size > flavor.max_line:
        raise ReadError(f"the line has {size} bytes, and {flavor.title} takes at most {flavor.max_line}")
    commands: list[str] = []
    if shown not in ("", "%"):
        commands, motion = commands_of(shown, motion)
    return commands, None if comment is None else _legible(comment), motion


def _plain(raw: str) -> str:
    """A line without its end and what stands before it.

    Raises:
        ReadError: it is no text.
    """
    if len(raw) > MAX_RAW or "\0" in raw:
        raise ReadError(f"this is no line of G-code, it is binary or has {len(raw)} characters")
    return raw.rstrip("\r\n").lstrip("\ufeff" + _BLANKS)


def _split(raw: str, number: int, flavor: Flavor) -> tuple[str, str | None]:
    text = _plain(raw)
    kept, shown, comment = (_without_text_comment if _is_text(text) else _without_comments)(text)
    if not flavor.parentheses and "(" in kept and not _is_text(text):
        raise ReadError(f"{flavor.title} takes no comment in parentheses: put it behind a semicolon")
    numbered = _NUMBERED.match(shown.lstrip(_BLANKS))
    is_text = _is_text(shown)
    command = _verified(kept, shown, numbered is not None, is_text).lstrip(_BLANKS)
    command = command[numbered.end() if numbered else 0 :].strip(_BLANKS)
    if command == "%":  # where a tape began and ended
        command = ""
    if command:
        command = _text_command(_legible(command)) if is_text else _other_command(command)
        if fault := fault_of(command, 10 * number + 1000, flavor.max_line, flavor.title):
            # Lines of the sender's own share the numbers; ten times the line leaves room for them.
            raise ReadError(f"{command[:40]!a}: {fault}")
    return command, None if comment is None else _legible(comment)


def _is_text(line: str) -> bool:
    match = _TEXT.match(line.lstrip(_BLANKS)[:_SURELY_SHORT])
    return match is not None and f"M{match[1]}" in TEXT_COMMANDS


def _text_command(command: str) -> str:
    letters = _TEXT.match(command)
    if letters is None:
        raise ReadError(f"{command[:40]!a} is no G-code command")
    return f"M{letters[1]} {command[letters.end() :].replace(chr(9), ' ').strip(_BLANKS)}".rstrip()


def _other_command(command: str) -> str:
    if not command.isascii():
        odd = next(letter for letter in command if not letter.isascii())
        raise ReadError(f"{_legible(odd)!a} is no letter of G-code; only comments and messages may have it")
    if controls := [letter for letter in command if (letter < " " and letter != "\t") or letter == "\x7f"]:
        raise ReadError(f"the control character {controls[0]!a} ends or garbles the line: remove it")
    return canonical(command)


def _without_text_comment(text: str) -> tuple[str, str, str | None]:
    """Where the argument is text, only ``;`` begins a comment, unless ``\\`` stands before it."""
    escaped = False
    for place, letter in enumerate(text):
        if letter == ";" and not escaped:
            return text[:place], text[:place], text[place + 1 :]
        escaped = letter == "\\" and not escaped
    return text, text, None


def _without_comments(text: str) -> tuple[str, str, str | None]:
    """The line up to ``;``, the same with blanks for what is in parentheses, and what is behind ``;``."""
    special = _SPECIAL.search(text)
    if special is None:
        return text, text, None
    if special[0] == ";":
        command = text[: special.start()]
        return command, command, text[special.end() :]
    parts: list[str] = []
    place = 0
    while special is not None and special[0] != ";":
        if special[0] == "\\":
            raise ReadError("a backslash is Marlin's escape, and has no meaning in this command: remove it")
        close = text.find(")", special.start())
        if special[0] == ")" or close < 0:
            raise ReadError(f"a parenthesis has no other half: '{text[special.start() :][:20]}'")
        parts.append(text[place : special.start()])
        place = close + 1
        special = _SPECIAL.search(text, place)
    end = len(text) if special is None else special.start()
    parts.append(text[place:end])
    return text[:end], " ".join(parts), None if special is None else text[end + 1 :]


def _verified(kept: str, shown: str, numbered: bool, is_text: bool) -> str:
    """The command without its checksum, which must fit; in an unnumbered text ``*`` is a letter."""
    if "*" not in shown or (is_text and not numbered):
        return shown
    found = _CHECKSUM.search(shown)
    if found is None:
        if is_text:
            return shown
        raise ReadError(f"{shown[shown.index('*') :][:20]!a} is no checksum: '*' has a number behind it")
    # A firmware that knows no parentheses sums over them, one that knows them does not.
    sums = [checksum(text[: text.rindex("*")].encode(errors="surrogateescape")) for text in (kept, shown)]
    if int(found[1]) not in sums:
        raise ReadError(f"the line has checksum {found[1]}, but its text gives {sums[0]}: it was damaged")
    content = shown[: found.start()]
    if "*" in content and not is_text:
        raise ReadError("'*' stands twice in the line")
    return content


def checksum(data: bytes) -> int:
    """The exclusive or of all bytes, 0 to 255."""
    return reduce(xor, data, 0)


def _legible(text: str) -> str:
    """Bytes that were no UTF-8, as the letters of the older encoding that has one for each byte."""
    if text.isascii() or not any("\udc80" <= letter <= "\udcff" for letter in text):
        return text
    return text.encode(errors="surrogateescape").decode("latin-1")
