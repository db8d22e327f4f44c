"""What a program says of itself: the ``; vslice key = value`` comments in its head."""

from collections.abc import Iterable
from itertools import islice

from gcode.moves import Kind, Move

HEAD_MOVES = 2000
"""A head is searched for this far; a thumbnail may stand in between."""


def read_head(moves: Iterable[Move]) -> dict[str, str]:
    """The facts in the head of a program that vslice wrote; of another's, nothing."""
    return facts_of(move.text for move in islice(moves, HEAD_MOVES) if move.kind == Kind.COMMENT)


def facts_of(comments: Iterable[str]) -> dict[str, str]:
    """The facts among the first comments of a program, each the text behind a semicolon."""
    facts = {}
    for comment in islice(comments, HEAD_MOVES):
        key, equals, value = comment.strip().partition(" = ")
        if equals and key.startswith("vslice "):
            facts[key.removeprefix("vslice ")] = value.strip()
    return facts
