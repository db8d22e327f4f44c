"""The order and direction of toolpaths: one ``Problem``, one ``Result``, one module for each method."""

from slicer.sequence.problem import Problem, Result
from slicer.sequence.solve import METHODS, solve

__all__ = ["METHODS", "Problem", "Result", "solve"]
