"""Toolpaths that stand in one another's way: cut into pieces that do not, or printed all the same."""

from slicer.cutting.cut import Cut, cut
from slicer.cutting.overlap import less_pressed, overlapping
from slicer.cutting.pressing import RelaxedPrecedence, press

__all__ = ["Cut", "RelaxedPrecedence", "cut", "less_pressed", "overlapping", "press"]
