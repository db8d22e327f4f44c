"""An emulated Marlin: the replies of a real one, a planner with a clock, and the path it would print."""
