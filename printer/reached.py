"""How far a printer came with a program, told by where it stands."""

from printer.commands import Program
from printer.replay import replay

SAME_PLACE_MM = 0.0151
"""Printers tell their position to a hundredth of a millimetre, rounded or cut off."""


def commands_carried_out(
    program: Program, acknowledged: int, furthest: int, reported: dict[str, float] | None
) -> int | None:
    """How many commands a printer has carried out that still knows its position; None if that cannot be told.

    What was acknowledged it has taken, and all that it took it carries out, unless it is reset or told to
    drop its moves. Then it stands elsewhere, as it does when somebody has moved it: so an answer is given
    only where ``reported`` (M114, in mm) is the place behind the first ``acknowledged`` commands, or, as
    lines may have reached it whose acknowledgement was lost, behind a number of them up to ``furthest``; the
    least that fits.
    """
    state = replay(program, acknowledged)
    axes = {axis for axis in state.position if axis in "XYZ"}
    if reported is None or not axes or not axes <= set(reported):
        return None
    for count in range(acknowledged, furthest + 1):
        if all(abs(state.position[axis] - reported[axis]) <= SAME_PLACE_MM for axis in axes):
            return count
        if count < furthest:
            state.apply(program.commands[count])
    return None
