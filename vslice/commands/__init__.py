"""One module per command; each defines a click command named ``command``, and ``COMMANDS`` in ``vslice.cli``
names it.
"""
