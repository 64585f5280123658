# SPDX-License-Identifier: GPL-3.0-or-later
"""One style for all charts: Okabe and Ito's palette (distinguishable under the common colour-vision
deficiencies), a marker beside every colour, units on the axes, small PNGs with a palette."""
import io
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from PIL import Image  # matplotlib needs it too

from .common import write_file

BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"
YELLOW, INK, GREY, PALE = "#f0e442", "#282828", "#787878", "#e1e1e1"
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = ("o", "s", "^")

plt.rcParams.update({
    "figure.dpi": 120, "font.size": 10.5, "axes.titlesize": 11.5, "axes.titleweight": "bold",
    "axes.grid": True, "grid.color": PALE, "axes.axisbelow": True, "axes.edgecolor": GREY,
    "text.color": INK, "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK,
    "axes.spines.top": False, "axes.spines.right": False, "lines.linewidth": 1.8, "lines.markersize": 5.5,
    "legend.frameon": False, "legend.fontsize": 9.5, "savefig.dpi": 120,
})


def figure(title, subtitle="", rows=1, columns=1, size=(8.2, 4.8)):
    """(figure, axes); size: of the whole, inches. axes: an array where there are several."""
    fig, axes = plt.subplots(rows, columns, figsize=size, layout="constrained")
    fig.suptitle(title, x=0.01, ha="left", fontsize=13, fontweight="bold")
    if subtitle:
        first = axes if rows * columns == 1 else np.ravel(axes)[0]
        first.set_title(subtitle, loc="left", fontsize=10, fontweight="normal")
    return fig, axes


def _plain(value, _):
    return f"{value:g}" if 1e-3 <= abs(value) < 1e5 else f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")


def log_ticks(low, high):
    """Powers of ten; with 2 and 5, or more, where there are few; every second or third where many."""
    for steps in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 6, 8)):
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        ticks = [step * 10.0 ** power for power in powers for step in steps]
        ticks = [tick for tick in ticks if low <= tick <= high]
        if len(ticks) >= 3:
            return ticks[::1 + (len(ticks) - 1) // 9]
    return ticks


def label(ax, x, y, log_x=False, log_y=False):
    """Names with their units. After plotting: a logarithmic axis has its ticks where the data are."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    for axis, scale, log in ((ax.xaxis, ax.set_xscale, log_x), (ax.yaxis, ax.set_yscale, log_y)):
        if log:
            scale("log")
            axis.set_major_locator(FixedLocator(log_ticks(*axis.get_view_interval())))
            axis.set_major_formatter(FuncFormatter(_plain))
            axis.set_minor_locator(NullLocator())


def style(k):
    """Colour and marker of the k-th series, for plot() and scatter()."""
    return {"color": COLOURS[k % len(COLOURS)], "marker": MARKERS[k % len(MARKERS)]}


def colour_map(*colours):
    """From the first colour to the last; save() keeps the shades between white and a colour of the style."""
    return matplotlib.colors.LinearSegmentedColormap.from_list("style", colours)


def bound_lines(ax, bounds, text):
    """Dashed lines across the axes, explained once."""
    for i, bound in enumerate(bounds):
        ax.axhline(bound, color=INK, linestyle="--", linewidth=1.2, label=text if i == 0 else None)


def strips(ax, names, series):
    """A column per name and in it a strip of dots per series, evenly spread in their order.

    series: {legend: [values of the first name, of the second ...]}."""
    width = 0.8 / len(series)
    for k, (legend, columns) in enumerate(series.items()):
        x, y = [], []
        for column, values in enumerate(columns):
            at = np.linspace(0.1, 0.9, len(values)) if len(values) > 1 else np.full(len(values), 0.5)
            x.extend(column - 0.4 + width * (k + at))
            y.extend(values)
        ax.plot(x, y, linestyle="none", markersize=4, label=legend, **style(k))
    ax.set_xticks(range(len(names)), names, rotation=25 if max(map(len, names)) * len(names) > 90 else 0,
                  ha="right" if max(map(len, names)) * len(names) > 90 else "center")
    ax.set_xlim(-0.5, len(names) - 0.5)
    ax.grid(axis="x", visible=False)


def legend(ax, **options):
    """Beside the axes, long names below them, where it hides nothing; none for a nameless series."""
    names = ax.get_legend_handles_labels()[1]
    if not names:
        return
    beside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    below = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.13)}
    ax.legend(**{**(beside if max(map(len, names)) < 30 else below), **options})


def _house_palette():
    """Every colour of the style in steps towards white, for smooth edges of lines and letters."""
    colours = np.array([list(bytes.fromhex(one[1:])) for one in (*COLOURS, YELLOW, INK, GREY, "#000000")])
    steps = [255 - (255 - colours) * share for share in np.linspace(1, 0, 25, endpoint=False)]
    return np.vstack([[255, 255, 255], [225, 225, 225], np.round(np.vstack(steps)).astype(int)])


def _indexed(pixels):
    """Height x width x 3 -> an image of the palette's nearest colours."""
    palette = _house_palette()
    different, place = np.unique(pixels.reshape(-1, 3), axis=0, return_inverse=True)
    nearest = np.array([np.argmin(((palette - colour.astype(int)) ** 2).sum(axis=1)) for colour in different])
    image = Image.fromarray(nearest[place].reshape(pixels.shape[:2]).astype(np.uint8), "P")
    image.putpalette(palette.astype(np.uint8).ravel().tolist())
    return image


def save(fig, path, own_colours=False):
    """As PNG with a palette: the style's, or with own_colours (a colour map, a photograph) the
    picture's own 256."""
    fig.canvas.draw()
    pixels = np.asarray(fig.canvas.buffer_rgba())[..., :3].copy()
    plt.close(fig)
    image = Image.fromarray(pixels).quantize(256) if own_colours else _indexed(pixels)
    content = io.BytesIO()
    image.save(content, "PNG", optimize=True)
    write_file(path, content.getvalue())
    print(f"wrote {path}")
