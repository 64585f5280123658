# SPDX-License-Identifier: Apache-2.0
"""Colours of the uncertainty: dark blue is sure, yellow is not. Lightness grows with the value, so the order
shows in grey as well, and no pair is one of red and green."""
from __future__ import annotations

import numpy as np
import numpy.typing as npt

FULL_SCALE_MM = 4.0  # at and above it, the last colour
_VALUES = (0.0, 0.35, 0.7, 1.0)
_COLOURS = ((0.05, 0.10, 0.35), (0.15, 0.45, 0.55), (0.75, 0.70, 0.30), (1.0, 0.95, 0.45))


def sd_colours(count: int = 256) -> npt.NDArray[np.float64]:
    """(count, 3): red, green, blue from 0 to 1, for standard deviations from 0 to FULL_SCALE_MM."""
    if count < 2:
        raise ValueError(f"count: {count} is less than 2")
    at = np.linspace(0.0, 1.0, count)
    return np.stack([np.interp(at, _VALUES, [colour[part] for colour in _COLOURS]) for part in range(3)], axis=1)


def known_colours(count: int = 256) -> npt.NDArray[np.float64]:
    """The same for what is known, from 0 (a guess: yellow) to 1."""
    return sd_colours(count)[::-1]
