"""An emulated Marlin: the replies of a real one, a planner with a clock, and the path it would print.

What goes wrong on purpose is in ``faults``, what it words otherwise than Marlin in ``odd``.
"""
