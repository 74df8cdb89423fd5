"""Colours of facets by the light on them, and their rules as CSS."""

from collections.abc import Iterable
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.report.still.picture import Colour

LINE: Final = -1  # tone of lines: the colour itself, without a fill
LEVELS: Final = 10  # [-] tones of one colour
AMBIENT: Final = 0.62  # [-] of the light comes from everywhere
BRIGHTEST: Final = 1.22  # [-] of the colour, in full light
LAMP: Final = (-0.42, 0.66, 0.62)  # direction to the lamp along right, up and towards the viewer


def tones(normals: Array) -> Indices:
    """Tone of facets with unit normals along right, up and towards the viewer, shape (K, 3): 0 is the darkest."""
    lamp = np.asarray(LAMP) / np.linalg.norm(LAMP)
    lit = np.clip(normals @ lamp, 0.0, 1.0) + 0.18 * np.clip(normals[:, 2], 0.0, 1.0)
    return np.minimum(LEVELS - 1, np.floor(LEVELS * lit / 1.18 + 1e-6)).astype(np.intp)


def tone_colour(colour: str, tone: int) -> str:
    """A colour in a tone; what is brighter than the colour goes towards white."""
    factor = AMBIENT + (BRIGHTEST - AMBIENT) * tone / (LEVELS - 1)
    channels = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    if factor <= 1.0:
        mixed = [factor * channel for channel in channels]
    else:
        mixed = [channel + (factor - 1.0) * 1.6 * (255 - channel) for channel in channels]
    return "#" + "".join(f"{min(255, round(channel)):02x}" for channel in mixed)


def mixed(colour: str, other: str, share: float) -> str:
    """A colour with a share of another."""
    pairs = [(int(colour[k : k + 2], 16), int(other[k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round((1 - share) * a + share * b):02x}" for a, b in pairs)


def rules(prefix: str, used: Iterable[tuple[str, Colour, int]]) -> tuple[str, str]:
    """CSS of tones: for light surroundings, and what is different in dark ones.

    Args:
        prefix: Selector of the picture.
        used: Class, colour and tone of each.
    """
    light, dark = [], []
    for name, colour, tone in used:
        light.append(f"{prefix} .{name}{{{_paint(colour.light, tone)}}}")
        if colour.dark != colour.light:
            dark.append(f"{prefix} .{name}{{{_paint(colour.dark, tone)}}}")
    return "\n".join(light), "\n".join(dark)


def _paint(colour: str, tone: int) -> str:
    if tone == LINE:
        return f"fill:none;stroke:{colour};stroke-linecap:round"
    value = tone_colour(colour, tone)
    return f"fill:{value};stroke:{value}"
