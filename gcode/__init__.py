"""Moves: a plan and a profile become moves and text, and text becomes moves again, to be checked,
timed and drawn.
"""
