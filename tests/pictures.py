"""Pictures of fibres whose directions are known, row 0 at the top; directions are degrees with y up."""

import numpy as np


def axes_of(width, height):
    """x and y of the pixels' centres, y up."""
    return np.meshgrid(np.arange(width) + 0.5, height - np.arange(height) - 0.5)


def grating(tilt_deg, width=240, height=180, period=9.0):
    """Parallel fibres, 0 to 1."""
    x, y = axes_of(width, height)
    t = np.radians(tilt_deg)
    return 0.5 + 0.5 * np.sin(2 * np.pi * (y * np.cos(t) - x * np.sin(t)) / period)


def rings(width=256, height=256, period=11.0):
    """Circles around the middle, and the direction of each pixel."""
    x, y = axes_of(width, height)
    dx, dy = x - width / 2, y - height / 2
    return 0.5 + 0.5 * np.sin(2 * np.pi * np.hypot(dx, dy) / period), np.degrees(np.arctan2(dx, -dy))


def spiral(pitch_deg, width=256, height=256, period=11.0):
    """Logarithmic spirals, which cross every circle at the same angle, and the direction of each pixel."""
    x, y = axes_of(width, height)
    dx, dy = x - width / 2, y - height / 2
    pitch, radius = np.radians(pitch_deg), np.maximum(np.hypot(dx, dy), 1.0)
    # Level sets of log(r) cos(pitch) - phi sin(pitch); the number of arms must be whole.
    arms = 30
    phase = arms * (np.arctan2(dy, dx) - np.log(radius) / np.tan(pitch))
    return 0.5 + 0.5 * np.sin(phase), np.degrees(np.arctan2(dx, -dy)) - np.degrees(pitch - np.pi / 2) + 90


def noisy(picture, snr, seed=0):
    """A picture with normal noise; ``snr`` is the ratio of both standard deviations."""
    noise = np.random.default_rng(seed).normal(scale=picture.std() / snr, size=picture.shape)
    return picture + noise


def axial(a, b):
    """Angle between axes, 0 to 90 degrees."""
    return np.abs((np.asarray(a) - b + 90) % 180 - 90)


def save_tiff(path, pixels, **rest):
    """Write a TIFF by tifffile."""
    import tifffile

    tifffile.imwrite(path, pixels, **rest)
    return path
