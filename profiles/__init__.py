"""What a machine is: the schema of a profile and one TOML file for each shipped machine, which says
what differs from the schema's defaults.
"""

from profiles.load import ProfileError, load, made, shipped, taken_over
from profiles.profile import Profile
from profiles.template import render

__all__ = ["Profile", "ProfileError", "load", "made", "render", "shipped", "taken_over"]
