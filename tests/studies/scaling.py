# SPDX-License-Identifier: GPL-3.0-or-later
"""scaling: what preparing a model takes by one process and by several, and what a million nodes would.

    rows.csv      a row per run of cmake/scripts/scaling.sh
    updates.csv   models by several processes against that by one

A figure of P processes is taken for shared(N) + split(N) / P, both found from one and two processes and fitted by powers of
the number of nodes N. The band of an extrapolation is that of the fits (95 %, Student's t). Time by P processes loses beside
it as much with each doubling as it did with the first. Writes fit.csv, million.csv, a picture and checks.
"""
from dataclasses import dataclass

import numpy as np

from . import chart
from .checks import Record
from .common import InputError, study_parser, write_file
from .rows import Table, csv_text
from .summary import finish

ROWS = ("edge_mm,nodes,slaves,processes,threads,total_s,mesh_s,factor_s,condense_s,work_s,peak_bytes,least_peak_bytes,"
        "sent_bytes,file_bytes,load").split(",")
UPDATES = "edge_mm,nodes,processes,update_mm,greatest_mm,compliance,modes_mm,same_contact,update_ms".split(",")
T_95 = {1: 12.706, 2: 4.303, 3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447, 7: 2.365, 8: 2.306}
MILLION, PROCESSES = 1e6, (8, 16, 32, 64)
GIB = 2.0 ** 30
# The bound of updates is missed: they are sums, in single precision, of what the file keeps in steps of 2^-25 (modes) and
# 2^-23 (contact) of the greatest number, some 1e-7 of the largest terms, which are tens of mm.
TIME_BOUND, MEMORY_BOUND, MODES_BOUND_MM, UPDATE_BOUND_MM, LARGE = 0.65, 0.6, 1e-9, 1e-9, 85000


@dataclass
class Power:
    """value = factor N^power; `spread`: standard deviation of ln(value) about it."""
    factor: float
    power: float
    spread: float
    freedom: int
    mean: float
    squares: float
    count: int

    @staticmethod
    def fit(nodes, values):
        """Least squares of the logarithms. From 3 sizes on it has a spread."""
        x, y = np.log(nodes), np.log(values)
        if len(x) < 2:
            raise InputError("rows.csv: a fit needs two sizes at least")
        squares = float(((x - x.mean()) ** 2).sum())
        power = float(((x - x.mean()) * (y - y.mean())).sum()) / squares
        left = y - y.mean() - power * (x - x.mean())
        freedom = len(x) - 2
        spread = float(np.sqrt((left ** 2).sum() / freedom)) if freedom > 0 else float("nan")
        return Power(float(np.exp(y.mean() - power * x.mean())), power, spread, freedom, float(x.mean()), squares, len(x))

    def at(self, nodes):
        return self.factor * nodes ** self.power

    def band(self, nodes):
        """Factor of the 95 % band of a new value; nan without a spread."""
        if self.freedom < 1:
            return float("nan")
        t = T_95.get(self.freedom, 2.0)
        away = np.log(nodes) - self.mean
        return float(np.exp(t * self.spread * np.sqrt(1.0 + 1.0 / self.count + away ** 2 / self.squares)))


@dataclass
class Split:
    """shared(N) + split(N) / P"""
    shared: Power
    split: Power

    @staticmethod
    def fit(nodes, one, two):
        one, two = np.asarray(one), np.asarray(two)
        least = 1e-3 * one  # what is wholly split has a little that is not
        return Split(Power.fit(nodes, np.maximum(least, 2.0 * two - one)), Power.fit(nodes, np.maximum(least, 2.0 * (one - two))))

    def at(self, nodes, processes):
        return self.shared.at(nodes) + self.split.at(nodes) / processes

    def bounds(self, nodes, processes):
        """Bands of the parts, as if both were off alike."""
        a, b = self.shared.at(nodes), self.split.at(nodes) / processes
        up, along = self.shared.band(nodes), self.split.band(nodes)
        return a / up + b / along, a * up + b * along


def pairs_of(rows):
    """(nodes, row of one process and one thread, row of two) of every size that has both; the means of repeated runs."""
    found = []
    for _, group in sorted(rows.groups("edge_mm").items(), key=lambda item: -float(item[0])):
        one, two = (group.where(processes=p, threads="1") for p in ("1", "2"))
        if len(one) and len(two):
            found.append((one[0].number("nodes"), one, two))
    if not found:
        raise InputError("rows.csv: no size was prepared by one process and by two")
    return found


def main(arguments):
    options = study_parser("scaling", __doc__, "make scaling", "Preparing a model by several processes").parse_args(arguments)
    rows = Table.read(options.dir / "rows.csv", ROWS)
    updates = Table.read(options.dir / "updates.csv", UPDATES)
    record = Record(options.dir)
    pairs = pairs_of(rows)
    for nodes, one, two in pairs:
        name = f"{nodes:.0f} nodes"
        ratios = {"time": two.mean("total_s") / one.mean("total_s"), "work": two.mean("work_s") / one.mean("work_s"),
                  "memory": two.mean("peak_bytes") / one.mean("peak_bytes")}
        for what, ratio in ratios.items():
            bound = MEMORY_BOUND if what == "memory" else TIME_BOUND
            # The clock says little where other work had the cores; processor time outside of messages does.
            busy = what == "time" and max(one.largest("load"), two.largest("load")) > 3.0
            if nodes >= LARGE and not busy:
                record.check(name, f"two processes against one: {what}", ratio, f"<= {bound:g}", ratio <= bound)
            else:
                record.figure(name, f"two processes against one: {what}", ratio, "ratio")
        record.figure(name, "sent by two processes", two.mean("sent_bytes") / GIB, "GiB")
    for row in updates:
        for column, what, bound in (("modes_mm", "motion of the skull's nodes in double precision", MODES_BOUND_MM),
                                    ("update_mm", "updates from what the file keeps", UPDATE_BOUND_MM)):
            value = row.number(column)
            record.check(f"{row['nodes']} nodes", f"{row['processes']} processes against one: {what}", value, f"<= {bound:g} mm",
                         value <= bound)
    if len(pairs) >= 2:
        extrapolate(pairs, updates, record, options)
    else:
        record.left_out("fit", "one size is no fit")
    record.save()
    return finish(options)


def extrapolate(pairs, updates, record, options):
    nodes = np.array([pair[0] for pair in pairs])
    of = lambda column, which: [pair[which].mean(column) for pair in pairs]
    work = Split.fit(nodes, of("work_s", 1), of("work_s", 2))
    memory = Split.fit(nodes, of("peak_bytes", 1), of("peak_bytes", 2))
    sent = Power.fit(nodes, of("sent_bytes", 2))
    file = Power.fit(nodes, of("file_bytes", 1))
    update = Power.fit(updates.numbers("nodes"), updates.numbers("update_ms")) if len(updates) > 1 else None
    fits = {"work_s shared": work.shared, "work_s split": work.split, "peak_bytes shared": memory.shared,
            "peak_bytes split": memory.split, "sent_bytes of two": sent, "file_bytes": file}
    if update:
        fits["update_ms"] = update
    write_file(options.dir / "fit.csv", csv_text(
        ["figure", "factor", "power", "spread", "at_a_million", "band"],
        [[name, f"{p.factor:.4g}", f"{p.power:.3f}", f"{p.spread:.3f}", f"{p.at(MILLION):.4g}", f"{p.band(MILLION):.3g}"]
         for name, p in fits.items()]))
    # What the first doubling lost beside shared(N) + split(N) / P is nothing by construction; the loss is that against half.
    loss = np.mean([two.mean("work_s") / (0.5 * one.mean("work_s")) for _, one, two in pairs[-2:]])
    table = []
    for processes in PROCESSES:
        low, high = work.bounds(MILLION, processes)
        least, most = memory.bounds(MILLION, processes)
        doublings = np.log2(processes)
        one = work.at(MILLION, 1)
        table.append([processes, f"{work.at(MILLION, processes) / 3600:.3g}", f"{low / 3600:.3g}", f"{high / 3600:.3g}",
                      f"{one / processes * loss ** doublings / 3600:.3g}", f"{memory.at(MILLION, processes) / GIB:.3g}",
                      f"{least / GIB:.3g}", f"{most / GIB:.3g}", f"{sent.at(MILLION) * 2 * (processes - 1) / processes / GIB:.3g}"])
    write_file(options.dir / "million.csv", csv_text(
        ["processes", "work_h", "work_low_h", "work_high_h", "work_by_doublings_h", "memory_gib", "memory_low_gib", "memory_high_gib",
         "sent_gib"], table))
    record.figure("a million nodes", "model file", file.at(MILLION) / GIB, "GiB")
    if update:
        record.figure("a million nodes", "update", update.at(MILLION) / 1000, "s")
    picture(pairs, work, memory, options)


def picture(pairs, work, memory, options):
    fig, axes = chart.figure(options.title, rows=1, columns=2, size=(9.6, 4.4))
    along = np.geomspace(pairs[0][0], MILLION, 60)
    for axis, column, scale, split, unit in ((axes[0], "work_s", 60.0, work, "work of the busiest process, minutes"),
                                             (axes[1], "peak_bytes", GIB, memory, "memory of a process, GiB")):
        for k, (processes, which) in enumerate(((1, 1), (2, 2), (8, None), (64, None))):
            colour = chart.COLOURS[k]
            axis.plot(along, split.at(along, processes) / scale, color=colour, linestyle="-" if which else "--",
                      label=f"{processes} process{'es' if processes > 1 else ''}")
            if which:
                axis.plot([p[0] for p in pairs], [p[which].mean(column) / scale for p in pairs], chart.MARKERS[k], color=colour)
            if processes in (2, 64) and split.shared.freedom > 0:
                low, high = np.transpose([split.bounds(n, processes) for n in along])
                axis.fill_between(along, low / scale, high / scale, color=colour, alpha=0.12, linewidth=0)
        chart.label(axis, "nodes", unit, log_x=True, log_y=True)
    chart.legend(axes[0])
    chart.save(fig, options.dir / "scaling.png")
