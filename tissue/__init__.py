"""From measured tissue to fibre angles: images, volumes and tables become a grid. Knows no hatch, no machine.

Its libraries stand in the extra ``vslice[tissue]`` and are imported where they are used.
"""
