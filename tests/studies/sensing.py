# SPDX-License-Identifier: GPL-3.0-or-later
"""sensing: pictures of what `make sensing` measured, beside the charts of its records (docs/sensing.md).

    joint.csv        a row per surgery and newest source of its update (tests/sensing/joint_study.cpp)
    slice_NAME.csv   a row per voxel of a slice through a compounded volume, ours and PLUS's
                     (tests/sensing/ultrasound_study.cpp)
"""
import numpy as np

from . import chart
from .common import InputError, study_parser
from .rows import Table
from .summary import finish

SOURCES = {"ius": "tumour's boundary", "stereopsis": "and stereo surface", "tracks": "and 20 tracked points"}


def draw_joint(rows, folder):
    scenarios = rows.values("scenario")
    columns = [(scenario, place, column) for scenario in scenarios
               for place, column in (("tumour", "tumour_mm"), ("craniotomy", "craniotomy_vector_mm"))]
    fig, ax = chart.figure("Tumour boundary and exposed cortex together",
                           "a dot per surgery, each another truth; a bar at the mean; craniotomy by displacement",
                           size=(10.5, 4.8))
    series = {legend: [rows.where(scenario=scenario, newest_source=source).finite(column)
                       for scenario, _, column in columns] for source, legend in SOURCES.items()}
    chart.strips(ax, [f"{scenario.removeprefix('joint-')}\n{place}" for scenario, place, _ in columns], series)
    width = 0.8 / len(series)
    for k, groups in enumerate(series.values()):
        for i, values in enumerate(groups):
            left = i - 0.4 + width * k
            ax.plot((left, left + width), (values.mean(), values.mean()), color=chart.INK, linewidth=1.5)
    ax.set_ylim(bottom=0)
    chart.label(ax, "", "mean error (mm)")
    chart.legend(ax)
    chart.save(fig, folder / "joint.png")


def grid_of(rows, column):
    """(values by row and column, millimetres along both) of a slice."""
    x, y = (np.unique(rows.numbers(one)) for one in ("x_mm", "y_mm"))
    if len(x) * len(y) != len(rows):
        raise InputError(f"{rows.origin}: {len(rows)} voxels, a slice of {len(x)} x {len(y)} has {len(x) * len(y)}")
    order = np.lexsort((rows.numbers("x_mm"), rows.numbers("y_mm")))
    return rows.numbers(column)[order].reshape(len(y), len(x)), (x[0], x[-1], y[-1], y[0])


def draw_slice(rows, path):
    """Ours, PLUS's and their difference, in grey values from 0 to 255."""
    fig, axes = chart.figure("A slice through the compounded volume", columns=3, size=(10.5, 4.2))
    (ours, extent), (theirs, _) = grid_of(rows, "brainshift"), grid_of(rows, "PLUS")
    for ax, title, values in zip(axes, ("brainshift", "PLUS", "|difference|"), (ours, theirs, abs(ours - theirs))):
        ax.imshow(values, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="nearest")
        ax.set_title(title, loc="left", fontsize=10, fontweight="normal")
        ax.grid(visible=False)
        chart.label(ax, "mm", "mm" if ax is axes[0] else "")
    chart.save(fig, path)


def main(arguments):
    options = study_parser("sensing", "Charts, pictures, tables and checks of what `make sensing` measured.",
                           "make sensing", "Sensing").parse_args(arguments)
    if (options.dir / "joint.csv").exists():
        draw_joint(Table.read(options.dir / "joint.csv"), options.dir)
    for path in sorted(options.dir.glob("slice_*.csv")):
        draw_slice(Table.read(path), path.with_name(path.stem.replace("slice", "ultrasound") + ".png"))
    return finish(options)
