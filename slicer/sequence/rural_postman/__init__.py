"""The same toolpaths without precedence: the rural postman problem, a reference that nobody can print."""

from slicer.sequence.rural_postman.reference import Unordered, without_precedence

__all__ = ["Unordered", "without_precedence"]
