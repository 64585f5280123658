# SPDX-License-Identifier: GPL-3.0-or-later
"""summary: what studies recorded -> one chart per study and pair of axes, tables.md, summary.json.

For `make verify`, sensing, interchange, faults; the other studies end with it too."""
from . import chart
from .checks import POINTS, summarise
from .common import study_parser
from .rows import Table

# Errors, sizes, times and the like span powers of ten; positions and pressures do not.
LOGARITHMIC = ("error", "size", "steps", "unknowns", "elements", "roughness", "over bound")
UNITS = ("mm", "s", "%", "kPa", "Pa", "N", "MPa")
TIME_FACTOR = "T"  # time over consolidation time


def logarithmic(axis):
    return axis == TIME_FACTOR or axis.endswith(" s") or any(word in axis for word in LOGARITHMIC)


def with_unit(axis):
    """"element size mm" -> "element size (mm)"."""
    if axis == TIME_FACTOR:
        return "T: time over consolidation time"
    name, _, unit = axis.rpartition(" ")
    return f"{name} ({unit})" if name and unit in UNITS else axis


def charts_of(points):
    """{(study, x_name, y_name): {series: [(x, y)]}}; an exact value that every mesh records counts
    once."""
    charts = {}
    for key, of_chart in points.groups("study", "x_name", "y_name").items():
        charts[key] = {name: list(dict.fromkeys((row.number("x"), row.number("y")) for row in rows))
                       for name, rows in of_chart.groups("series").items()}
    return charts


def draw(points, title, folder):
    """STUDY.png, STUDY-2.png ... by the order of the records."""
    names = set()
    for (study, x_name, y_name), series in charts_of(points).items():
        fig, ax = chart.figure(f"{title}: {study}")
        exact = [name for name in series if "series" in name]  # of a series solution: dashed
        measured = [name for name in series if name not in exact]
        for k, name in enumerate(measured):
            points_of = series[name]
            ax.plot(*zip(*points_of), label=name, markevery=max(1, len(points_of) // 12), **chart.style(k))
        for name in exact:
            ax.plot(*zip(*series[name]), color=chart.INK, linestyle="--", linewidth=1.2,
                    label="series" if name == exact[0] else None)
        log_x, log_y = (logarithmic(name) and all(point[k] > 0.0 for of_series in series.values() for point in of_series)
                        for k, name in enumerate((x_name, y_name)))
        chart.label(ax, with_unit(x_name), with_unit(y_name), log_x, log_y)
        chart.legend(ax)
        count = 1
        while (name := study if count == 1 else f"{study}-{count}") in names:
            count += 1
        names.add(name)
        chart.save(fig, folder / f"{name}.png")


def finish(options):
    """Charts and summary of the records in options.dir. True when every check holds."""
    draw(Table.read(options.dir / "points.csv", POINTS), options.title, options.dir)
    return summarise(options.dir, options.commit, options.command)


def main(arguments):
    return finish(study_parser("summary", "Charts, tables and checks of what studies recorded.",
                               "make verify", "Verification").parse_args(arguments))
