# SPDX-License-Identifier: GPL-3.0-or-later
"""One style for all charts: Okabe and Ito's palette (distinguishable under the common colour-vision
deficiencies), a marker beside every colour, units on the axes, small PNGs with a palette."""
import io

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FuncFormatter
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


def label(ax, x, y, log_x=False, log_y=False):
    """Names with their units; a logarithmic axis over less than two decades also labels 2 and 5."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    for axis, log in ((ax.xaxis, log_x), (ax.yaxis, log_y)):
        if not log:
            continue
        (ax.set_xscale if axis is ax.xaxis else ax.set_yscale)("log")
        axis.set_major_formatter(FuncFormatter(_plain))
        low, high = axis.get_view_interval()
        if low > 0 and high / low < 100:
            axis.set_minor_locator(matplotlib.ticker.LogLocator(subs=(2, 5)))
            axis.set_minor_formatter(FuncFormatter(_plain))
            ax.grid(which="minor", axis="x" if axis is ax.xaxis else "y")
        else:
            axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


def style(k):
    """Colour and marker of the k-th series, for plot() and scatter()."""
    return {"color": COLOURS[k % len(COLOURS)], "marker": MARKERS[k % len(MARKERS)]}


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
    """Beside the axes, where it hides nothing; none for a single nameless series."""
    if ax.get_legend_handles_labels()[1]:
        ax.legend(**{"loc": "center left", "bbox_to_anchor": (1.0, 0.5), **options})


def save(fig, path):
    """As PNG with a palette of 64 colours."""
    fig.canvas.draw()
    image = Image.fromarray(np.asarray(fig.canvas.buffer_rgba())).convert("RGB")
    plt.close(fig)
    content = io.BytesIO()
    image.quantize(64).save(content, "PNG", optimize=True)
    write_file(path, content.getvalue())
    print(f"wrote {path}")
