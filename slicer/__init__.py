"""Geometry and order: grid, hatch lines, precedence, sequence, travel. Knows no machine, no G-code."""
