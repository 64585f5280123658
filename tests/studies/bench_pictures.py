# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of `make bench`: error against time, latency, growth with the mesh."""
import math

import numpy as np

from . import chart
from .stats import pareto_front

METHODS = ("condensed", "condensed-exact", "paper", "paper-woodbury", "cg", "pcg")
COLOURS = dict(zip(METHODS, (chart.BLUE, chart.SKY, chart.VERMILLION, chart.ORANGE, chart.GREEN, chart.PURPLE)))
MIB = 2.0 ** 20


def _legend_of(one):
    if one.method == "condensed":
        return f"{one.method}, {one.start}"
    return one.method + (", the paper's prior" if one.prior == "paper" else "")


def _errors(methods, path):
    """A point per method, number of modes and start; two panels."""
    first = methods[0]
    fig, axes = chart.figure(f"Error against run time: mesh {first.mesh}, scenario {first.scenario}",
                             f"median time; mean error over {first.compared} measurement(s) that all methods got; "
                             "numbers: modes of the prior", columns=2, size=(11.5, 5))
    for ax, (column, where) in zip(axes, (("cross_mm", "at the tumour"), ("field_mean_mm", "of the whole field"))):
        points = [(one.p50_ms, one.errors[column]) for one in methods]
        front = [points[i] for i in pareto_front(points)]
        if front:
            ax.plot(*zip(*front), color=chart.GREY, linestyle="--", linewidth=1, label="Pareto front")
        named = set()
        for one, (x, y) in zip(methods, points):
            if not (math.isfinite(x) and math.isfinite(y)):
                continue
            legend = _legend_of(one)
            own, warm = one.prior == "paper", one.start == "warm"
            ax.plot(x, y, linestyle="none", color=COLOURS.get(one.method, chart.INK),
                    marker="s" if own else "o" if warm else "^", label=None if legend in named else legend,
                    fillstyle="none" if warm else "full")
            if one.rank and not warm:
                ax.annotate(str(one.rank), (x, y), xytext=(5, 4), textcoords="offset points", fontsize=8.5)
            named.add(legend)
        chart.label(ax, "time of one estimate (ms)", f"mean error {where} (mm)", True, True)
    chart.legend(axes[-1], loc="center left", bbox_to_anchor=(1.0, 0.5))
    chart.save(fig, path)


def _latency(results, path):
    """How many updates take longer, a step per update; the first of each session is not among them."""
    fig, ax = chart.figure("Latency of updates through daemon and client, loopback",
                           "condensed method, contact; the first update of each session is not included")
    own = {name: values for name, values in results.latency_ms.items() if "@" not in name and len(values) > 1}
    for k, (name, values) in enumerate(own.items()):
        y = 1.0 - (np.arange(len(values)) + 0.5) / len(values)
        ax.plot(np.sort(values), y, label=f"{name} ({len(values)})", color=chart.COLOURS[k % len(chart.COLOURS)],
                linestyle=("-", "-.")[k // len(chart.COLOURS) % 2])
    solves = [float(run.get("full_solve_ms") or 0.0) for name, run in results.runs.items() if "@" not in name]
    ax.axvline(max(solves), color=chart.INK, linestyle="--", linewidth=1.2, label="t_solve")
    chart.label(ax, "latency (ms)", "share of updates that take longer", True, True)
    chart.legend(ax)
    if own:
        chart.save(fig, path)


def _growth(results, path):
    family = [row for row in results.meshes if "refined" not in row["mesh"]]
    family.sort(key=lambda row: row.number("nodes"))
    nodes = [row.number("nodes") for row in family]

    def column(name, unit=1.0):
        return [row.number(name) / unit for row in family]

    def updates(scenario, start):
        found = [results.find(row["mesh"], scenario, "condensed", start) for row in family]
        return [one.p50_ms if one else math.nan for one in found]

    panels = (
        ("Preparation", "time (s)", {"factor": column("factor_s"), "condense": column("condense_s")}),
        ("Memory", "memory (MiB)", {"factor, matrix, prior": column("factor_bytes", MIB),
                                    "condensed operators": column("operator_bytes", MIB),
                                    "peak of the preparation": column("peak_rss_bytes", MIB)}),
        ("Update, median, most modes", "time (ms)", {
            "t_solve": column("t_solve_ms"),
            **{f"{scenario}, {start}": updates(scenario, start)
               for scenario in ("paper", "distension") for start in ("warm", "cold")}}))
    fig, axes = chart.figure("Growth with the mesh (contact boundary)", columns=3, size=(12.5, 4.8))
    for ax, (title, y, series) in zip(axes, panels):
        for k, (name, values) in enumerate(series.items()):
            if any(map(math.isfinite, values)):
                ax.plot(nodes, values, label=name, **chart.style(k))
        ax.set_title(title, loc="left")
        chart.label(ax, "nodes", y, True, True)
        chart.legend(ax, loc="upper left", bbox_to_anchor=(0.0, -0.16))
    chart.save(fig, path)


def draw(results, folder):
    for mesh, scenario in dict.fromkeys((one.mesh, one.scenario) for one in results.methods):
        _errors([one for one in results.methods if (one.mesh, one.scenario) == (mesh, scenario)],
                folder / f"error_time-{mesh}-{scenario}.png")
    if results.latency_ms:
        _latency(results, folder / "latency.png")
    if len(results.meshes) > 1:  # one mesh shows no growth
        _growth(results, folder / "growth.png")
