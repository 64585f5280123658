#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""palette-pictures.py [FOLDER or FILE ...]: stores PNG pictures with a palette of 256 colours, in place.

Default: docs. A picture is replaced when it gets smaller; its most frequent colour, the background, stays as it
is. Prints sizes before and after. Needs Pillow (it comes with python3-matplotlib).
"""
import io
import pathlib
import sys

import numpy as np
from PIL import Image

LARGEST_DIFFERENCE = 16  # of a channel, in grey levels, that an octree may cause at any pixel
SHARE_OFF = 0.005  # of the pixels that it may change by more than 6 grey levels: photographs lose their shades otherwise


def palettes(image):
    """The picture with a palette: charts by an octree, photographs and colour scales by median cut."""
    yield image.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    yield image.quantize(256, method=Image.Quantize.MEDIANCUT, kmeans=2, dither=Image.Dither.NONE)


def with_palette(image):
    pixels = np.asarray(image).astype(int)
    background = max(image.getcolors(image.width * image.height))[1]
    for candidate in palettes(image):
        palette = candidate.getpalette()
        index = max(candidate.getcolors())[1]
        palette[3 * index : 3 * index + 3] = background
        candidate.putpalette(palette)
        difference = np.abs(np.asarray(candidate.convert("RGB")).astype(int) - pixels)
        if difference.max() <= LARGEST_DIFFERENCE and (difference.max(axis=2) > 6).mean() <= SHARE_OFF:
            return candidate
    return candidate


def convert(path):
    image = Image.open(path)
    if image.mode == "P":
        return 0
    image = image.convert("RGB")
    candidate = with_palette(image)
    data = io.BytesIO()
    candidate.save(data, "PNG", optimize=True)
    before = path.stat().st_size
    if data.tell() >= before:
        return 0
    path.write_bytes(data.getvalue())
    print(f"{path}: {before} -> {data.tell()}")
    return before - data.tell()


def main():
    places = [pathlib.Path(p) for p in sys.argv[1:]] or [pathlib.Path(__file__).parents[2] / "docs"]
    files = [f for p in places for f in (sorted(p.rglob("*.png")) if p.is_dir() else [p])]
    print(f"saved {sum(map(convert, files)) / 2**20:.1f} MiB in {len(files)} pictures")


if __name__ == "__main__":
    main()
