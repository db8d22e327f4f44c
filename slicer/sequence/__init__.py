"""The order and direction of toolpaths: one ``Problem``, one ``Result``, and the methods that
``METHODS`` in ``solve`` names, each in the folder whose means it uses. What must be printed before what is
not decided here: rules of precedence stand in ``slicer.precedence`` and ``slicer.sweep``.
"""

from slicer.sequence.construct import followed
from slicer.sequence.problem import Problem, Result
from slicer.sequence.solve import METHODS, solve

__all__ = ["METHODS", "Problem", "Result", "followed", "solve"]
