"""Search through the states layer by layer: beam, proof of the optimum, windows, and the merging of tours."""

from slicer.sequence.layered.beam_search import beam, beam_sees_all
from slicer.sequence.layered.exact_search import exact, exact_sees_all
from slicer.sequence.layered.layered_search import RELATIVE_EPS
from slicer.sequence.layered.streamed_beams import streamed_beam
from slicer.sequence.layered.tour_merging import merge_tours
from slicer.sequence.layered.windows import window_search

__all__ = [
    "RELATIVE_EPS",
    "beam",
    "beam_sees_all",
    "exact",
    "exact_sees_all",
    "merge_tours",
    "streamed_beam",
    "window_search",
]
