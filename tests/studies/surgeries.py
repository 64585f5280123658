# SPDX-License-Identifier: GPL-3.0-or-later
"""surgeries: many different simulated surgeries on some heads, bounds and pictures (docs/surgeries.md).

Rows (rows-HEAD.csv) are those of the program `surgeries`, one per update. Means are over surgeries,
then over patients (clusters.py), which their 95 % intervals are over too; unless stated, of the last
update, which knows all sources. Ratios are of each patient's means. A refused update recovers nothing
and covers nothing. Truths from outside the prior have bounds of their own (outside.py).
"""
import math
from functools import partial
from pathlib import Path

from . import chart, clusters, outside
from .checks import Record
from .clusters import or_zero
from .common import study_parser
from .outside import last_updates
from .rows import Table, study_rows
from .stats import over, percentile, ratio_over_patients
from .summary import finish

# Decrement of contact by descent, in posterior standard deviations, and depth of an open slave.
LARGEST_DECREMENT, LARGEST_VIOLATION_MM = 1e-3, 0.01
ALL_SOURCES = "tumour+cortex+tracks"
COLUMNS = ("head", "place", "seed", "scenario", "stage", "status", "nodes", "recovered_pct", "tumour_mm",
           "craniotomy_mm", "craniotomy_closest_mm", "field_mean_mm", "worse_nodes", "worst_excess_mm", "coverage_90",
           "quality", "inverted", "min_volume_ratio", "sources", "contradictions", "contact_decrement",
           "contact_violation_mm", "update_ms", "t_solve_ms", "warm_cold_mm", "swelling_strain", "volume_strain",
           "removed_nodes")


def of_places(rows, column):
    """{place: mean over its surgeries}, of one head."""
    return {place: clusters.of_truths(own, lambda row: row.number(column)) for place, own in rows.groups("place").items()}


def count(rows, column, holds):
    return int(holds(rows.finite(column)).sum())


class HeadChecks:
    """Of the rows of one head. before: those of an earlier estimate on the same surgeries, by which sag
    is judged, and whose estimate from the tumour alone counts where it is the better one; or empty."""

    def __init__(self, rows, before, record):
        self.rows, self.before, self.record = rows, before, record
        self.last = last_updates(rows)
        self.head, source = rows[0]["head"], f"twin; {len(self.last)} surgeries"
        self.check = partial(record.check, self.head, source=source)
        self.figure = partial(record.figure, self.head, source=source)

    def run(self):
        for scenario in self.rows.values("scenario"):
            rows, last = self.rows.where(scenario=scenario), self.last.where(scenario=scenario)
            before = self.before.where(scenario=scenario)
            self.tumour(scenario, last)
            self.nowhere_worse(scenario, rows)
            self.coverage(scenario, last)
            self.joint(scenario, rows, before)
            self.sag(scenario, last, last_updates(before))
        self.single_coverage()
        self.contradictions()
        self.inverted()
        self.contact()
        worst = self.last.largest("warm_cold_mm")
        self.check("warm against cold mm: largest of any node and surgery", worst, "<= 0.01", worst <= 0.01)
        self.time()
        self.verdicts()

    def tumour(self, scenario, last):
        recovered = clusters.mean(last, or_zero("recovered_pct"))
        error = clusters.mean(last, "tumour_mm").mean
        none_refused = len(last.finite("tumour_mm")) == len(last)
        self.check(f"{scenario}: tumour recovered %", recovered.mean,
                   f">= 95 or error <= 0.15 mm ({recovered}; error {error:.3f} mm; aim 97)",
                   recovered.mean >= 95 or (none_refused and error <= 0.15))

    def nowhere_worse(self, scenario, rows):
        worse = count(rows, "worse_nodes", lambda n: n > 0)
        self.check(f"{scenario}: updates somewhere worse than no correction by more than their interval", worse,
                   f"0 of {len(rows)} (worst by {rows.largest('worst_excess_mm'):.2f} mm)", worse == 0)

    def coverage(self, scenario, last):
        covered = clusters.mean(last, or_zero("coverage_90"))
        self.check(f"{scenario}: coverage of the 90 % interval", covered.mean, f"0.80 to 0.97 ({covered}; aim 0.85 to 0.95)",
                   0.80 <= covered.mean <= 0.97)

    def joint(self, scenario, rows, before):
        """All sources against the tumour alone: ours, or that of the estimate before where it is better."""
        joint = rows.where(stage=ALL_SOURCES)
        if not len(joint):
            return
        for column, what in (("craniotomy_mm", "by displacement"), ("craniotomy_closest_mm", "by closest point")):
            joint_mm, alone_mm, earlier_mm = (
                of_places(some, column) for some in (joint, rows.where(stage="tumour"), before.where(stage="tumour")))
            alone_mm = {place: min(alone, earlier_mm.get(place, math.inf)) for place, alone in alone_mm.items()}
            ratio = ratio_over_patients([over(joint_mm[place], alone) for place, alone in alone_mm.items() if place in joint_mm])
            self.check(f"{scenario}: craniotomy error {what} over that of the tumour alone", ratio.mean,
                       f"<= 0.5 ({ratio})", ratio.mean <= 0.5)

    def sag(self, scenario, last, before):
        """Where nothing swells, shrinks or is missing: no worse than before."""
        if (last.largest("swelling_strain") > 0 or last.largest("removed_nodes") > 0
                or count(last, "volume_strain", lambda strain: strain != 0)):
            return
        of = lambda rows: sorted((row["place"], row["seed"], row["nodes"]) for row in rows)
        if of(last) != of(before):
            why = "other surgeries" if len(self.before) else "no --before given"
            self.record.left_out(self.head, f"{scenario}: sag against the estimate before: {why}")
            return
        for column, what in (("tumour_mm", "tumour"), ("field_mean_mm", "field")):
            ratio = clusters.same_over(last, before, column)
            self.check(f"{scenario}: {what} error over that of the estimate before", ratio.mean, f"<= 1.15 ({ratio}; aim 1)",
                       ratio.mean <= 1.15)

    def single_coverage(self):
        covered = count(self.last, "coverage_90", lambda share: share >= 0.6)
        share = 100 * (len(self.last) - covered) / len(self.last)
        self.check("share of single surgeries with coverage below 0.6 %", share, "<= 5 (aim 0)", share <= 5)

    def contradictions(self):
        rows = self.rows.where(lambda row: row.number("sources") > 1)
        if len(rows):
            share = clusters.share(rows, lambda row: row.number("contradictions") > 0)
            self.check("updates that call consistent sources contradictory %", 100 * share.mean,
                       f"<= 1 ({share.low:.1%} to {share.high:.1%} over {share.count} patients)", share.mean <= 0.01)

    def inverted(self):
        """Whatever the quality says: it follows from the same count, so that no good field can have one."""
        fields = self.rows.where(lambda row: row["status"] != "refused")
        bad = fields.where(lambda row: not (row.number("inverted") == 0 and row.number("min_volume_ratio") > 0))
        self.check("fields with inverted elements; whatever their quality", len(bad), f"0 of {len(fields)}",
                   not len(bad))

    def contact(self):
        if not len(self.rows.finite("contact_decrement")):
            self.record.left_out(self.head, "contact certificate: the estimate publishes none")
            return
        met = self.rows.where(lambda row: row.number("contact_decrement") <= LARGEST_DECREMENT
                              and row.number("contact_violation_mm") <= LARGEST_VIOLATION_MM)
        without = len(self.rows) - len(met)
        self.check("updates without the contact certificate", without,
                   f"0 (decrement <= {LARGEST_DECREMENT:g} and violation <= {LARGEST_VIOLATION_MM:g} mm; "
                   f"largest {self.rows.largest('contact_decrement'):.2g} and "
                   f"{self.rows.largest('contact_violation_mm'):.2g}; "
                   f"{len(self.rows.where(status='converged'))} of {len(self.rows)} updates converged)", without == 0)

    def time(self):
        rows = self.rows.where(stage=ALL_SOURCES)
        ratios = [over(row.number("update_ms"), row.number("t_solve_ms")) for row in rows]
        ratios = [ratio for ratio in ratios if math.isfinite(ratio)]
        if ratios:
            p50 = percentile(ratios, 50)
            self.check("update with three sources over one solve: p50", p50,
                       f"<= 2 (aim 1; p95 {percentile(ratios, 95):.2f}; {rows[0]['nodes']} nodes)", p50 <= 2)

    def verdicts(self):
        for quality in ("good", "caution", "unusable"):
            self.figure(f"updates of quality {quality}", len(self.rows.where(quality=quality)),
                        f"shown; of {len(self.rows)}")
        self.figure("updates that were refused", len(self.rows.where(status="refused")), "shown")


def judge(rows, before, record, fixed=Table()):
    own_truths, from_outside = outside.split(rows)
    for head, own in own_truths.groups("head").items():
        HeadChecks(own, before.where(head=head), record).run()
    outside.judge(from_outside, record)
    if len(from_outside):
        outside.sharpness(own_truths, record)
        outside.compare(rows, before, fixed, record)


def draw(rows, folder):
    last = last_updates(rows)
    scenarios = last.values("scenario")
    for name, title, y, value, bounds in (
            ("tumour", "Left of the tumour's motion after correction", "error / motion (%)",
             lambda row: 100 - row.number("recovered_pct"), (5,)),
            ("coverage", "Coverage of the 90 % interval, all nodes", "share of true components inside",
             lambda row: row.number("coverage_90"), (0.80, 0.97)),
            ("field", "Error of the whole field after correction", "mean over all nodes (mm)",
             lambda row: row.number("field_mean_mm"), ())):
        fig, ax = chart.figure(title, "a dot per simulated surgery: the default estimate with all its sources",
                               size=(9.6, 4.8))
        chart.strips(ax, scenarios, {head: [[value(row) for row in own.where(scenario=one)] for one in scenarios]
                                     for head, own in last.groups("head").items()})
        chart.bound_lines(ax, bounds, "bound of the mean")
        chart.label(ax, "scenario", y, log_y=name != "coverage")
        chart.legend(ax)
        chart.save(fig, folder / f"surgeries-{name}.png")


def main(arguments):
    parser = study_parser("surgeries", "Checks and pictures of simulated surgeries: rows-*.csv of the folder.",
                          "make surgeries", "Surgeries")
    parser.add_argument("--before", type=Path, nargs="*", default=[],
                        help="tables of an earlier estimate on the same surgeries")
    parser.add_argument("--fixed", type=Path, nargs="*", default=[], help="tables of the same with prior.scales: fixed")
    options = parser.parse_args(arguments)
    rows = study_rows(options.dir, COLUMNS)
    before = Table.read_all(options.before)
    before = before if before.columns else Table(rows.columns)
    record = Record(options.dir)
    judge(rows, before, record, Table.read_all(options.fixed))
    record.save()
    draw(rows, options.dir)
    from_outside = outside.split(rows)[1]
    if len(from_outside):
        outside.publish(from_outside, record, options.dir, options.commit)
    return finish(options)
