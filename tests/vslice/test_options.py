"""What options repeat of the sequencer, since light commands do not load it."""

from typing import get_args

import pytest

from slicer.sequence.problem import ObjectiveName
from vslice.commands import compare, slice


@pytest.mark.parametrize("command", [compare.command, slice.command], ids=["compare", "slice"])
def test_every_objective_can_be_asked_for_and_no_other(command):
    (option,) = (one for one in command.params if one.name == "objective")
    assert tuple(option.type.choices) == get_args(ObjectiveName)
