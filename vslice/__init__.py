"""The command line of vslice: parses, calls, prints, and maps errors to exit codes."""

__version__ = "0.1.0"
