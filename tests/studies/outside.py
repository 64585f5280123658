# SPDX-License-Identifier: GPL-3.0-or-later
"""Truths from outside the prior, in the rows of `surgeries`: bounds, and a table per head, kind and data.

Means are over surgeries. A refused update recovers nothing and covers nothing; its field is that of no
correction. Near: nodes within 30 mm of what was measured; far: the others; cortex: the opened region.
"""
import math
from functools import partial

from .rows import cell_or_dash
from .stats import over

# Where the motion lies out of sight of all data: the field may stay as wrong as it is.
OUT_OF_SIGHT = {"haematoma-other": "the blood lies on the other side",
                "air-back": "the air may lie behind all that is seen",
                "air-front": "the air may lie before all that is seen"}
FAR_MM = 3.0  # rms of the far error's length, above which good is the wrong word
COLUMNS = ("outside", "quality_reason", "none_field_mean_mm", "none_tumour_mm", "beyond_band", "misfit_ratio", "true_max_mm",
           "all_interval_mm") + tuple(f"{part}_{what}" for part in ("near", "far", "cortex") for what in (
               "error_mm", "none_mm", "coverage_90", "interval_mm", "crps_mm", "rms_sd_mm", "rms_error_mm"))


def split(rows):
    """Rows of the prior's own truths, and those from outside; older tables have the former only."""
    if not rows.has("outside"):
        return rows, rows.where(lambda row: False)
    rows.need(*COLUMNS)
    outside = lambda row: row["outside"] == "1"
    kinds = {row["scenario"] for row in rows if outside(row)}  # a refused update does not say
    return (rows.where(lambda row: row["scenario"] not in kinds), rows.where(lambda row: row["scenario"] in kinds))


def per_update(rows, column):
    """Mean over all rows; a refused update counts 0."""
    return rows.finite(column).sum() / len(rows) if len(rows) else math.nan


def share(rows, holds):
    return len(rows.where(holds)) / len(rows) if len(rows) else math.nan


def careful(row):
    return row["quality"] in ("caution", "unusable") or row["status"] == "refused"


class KindChecks:
    """Of the rows of one head. last: chooses the last update of every surgery."""

    def __init__(self, rows, last, record):
        self.rows, self.last = rows, last(rows)
        self.head, source = rows[0]["head"], f"outside; {len(self.last)} surgeries"
        self.check = partial(record.check, self.head, source=source)
        self.figure = partial(record.figure, self.head, source=source)

    def run(self):
        for kind in self.rows.values("scenario"):
            self.kind(kind, self.rows.where(scenario=kind), self.last.where(scenario=kind))
        low = share(self.last, lambda row: not row.number("coverage_90") >= 0.6)
        self.check("outside: share of single surgeries with coverage below 0.6 %", 100 * low, "<= 3 (aim 0)", low <= 0.03)
        beyond = len(self.rows.where(lambda row: row.number("beyond_band") > 0))
        self.check("outside: updates with nodes worse than no correction beyond a simultaneous 90 % band", beyond,
                   f"0 of {len(self.rows)}", beyond == 0)
        sure = share(self.rows, lambda row: row["quality"] == "good"
                     and math.sqrt(3) * row.number("far_rms_error_mm") > FAR_MM)
        self.check(f"outside: updates that say good while the far field is wrong by {FAR_MM:g} mm rms %", 100 * sure,
                   "<= 1 (aim 0)", sure <= 0.01)
        self.figure("outside: interval score of all truths mm", self.rows.mean("all_interval_mm"), "shown")

    def kind(self, kind, rows, last):
        recovered, error = per_update(last, "recovered_pct"), last.mean("tumour_mm")
        self.check(f"{kind}: tumour recovered %", recovered, f">= 93 or error <= 0.15 mm (error {error:.3f} mm; aim 96)",
                   recovered >= 93 or error <= 0.15)
        ratio, bound = over(rows.mean("field_mean_mm"), rows.mean("none_field_mean_mm")), 1.0 if kind in OUT_OF_SIGHT else 0.7
        why = f"; {OUT_OF_SIGHT[kind]}" if kind in OUT_OF_SIGHT else ""
        self.check(f"{kind}: field error over no correction", ratio,
                   f"<= {bound:g} (aim 0.5; {rows.mean('none_field_mean_mm'):.3f} to {rows.mean('field_mean_mm'):.3f} mm{why})",
                   ratio <= bound)
        doubted = share(rows, careful)
        for part in ("near", "far"):
            covered = per_update(rows, f"{part}_coverage_90")
            self.check(f"{kind}: coverage of the 90 % interval {part}", covered,
                       f">= 0.80; or >= 0.65 with caution in 90 % of its updates ({100 * doubted:.0f} %; aim 0.85 to 0.95)",
                       covered >= 0.80 or (covered >= 0.65 and doubted >= 0.9))
            self.figure(f"{kind}: interval score {part} mm", rows.mean(f"{part}_interval_mm"), "shown")


def judge(rows, last, record):
    for _, own in rows.groups("head").items():
        KindChecks(own, last, record).run()


def sharpness(rows, last, record):
    """Of the prior's own truths near the data, with all sources of each surgery."""
    if not rows.has("near_coverage_90"):
        return
    for head, own in last(rows).groups("head").items():
        covered = per_update(own, "near_coverage_90")
        record.check(head, "own truths: coverage of the 90 % interval near the data", covered, ">= 0.85", covered >= 0.85)
        width = over(own.mean("near_rms_sd_mm"), own.mean("near_rms_error_mm"))
        record.check(head, "own truths: rms sd over rms error near the data", width, "<= 3 (aim 2)", width <= 3)


TABLE = (("recovered %", lambda rows: per_update(rows, "recovered_pct"), 3),
         ("tumour mm", lambda rows: rows.mean("tumour_mm"), 2),
         ("field", lambda rows: over(rows.mean("field_mean_mm"), rows.mean("none_field_mean_mm")), 2),
         ("near", lambda rows: over(rows.mean("near_error_mm"), rows.mean("near_none_mm")), 2),
         ("cortex", lambda rows: over(rows.mean("cortex_error_mm"), rows.mean("cortex_none_mm")), 2),
         ("far", lambda rows: over(rows.mean("far_error_mm"), rows.mean("far_none_mm")), 2),
         ("coverage near", lambda rows: per_update(rows, "near_coverage_90"), 2),
         ("coverage far", lambda rows: per_update(rows, "far_coverage_90"), 2),
         ("interval score near mm", lambda rows: rows.mean("near_interval_mm"), 2),
         ("interval score far mm", lambda rows: rows.mean("far_interval_mm"), 2),
         ("CRPS near mm", lambda rows: rows.mean("near_crps_mm"), 2),
         ("CRPS far mm", lambda rows: rows.mean("far_crps_mm"), 2),
         ("sd over error near", lambda rows: over(rows.mean("near_rms_sd_mm"), rows.mean("near_rms_error_mm")), 2),
         ("good %", lambda rows: 100 * share(rows, lambda row: row["quality"] == "good"), 3),
         ("beyond band", lambda rows: len(rows.where(lambda row: row.number("beyond_band") > 0)), 3),
         ("largest mm", lambda rows: rows.mean("true_max_mm"), 2))


def table_text(rows):
    """Markdown: a line per head, kind and data. field, near, cortex, far: error over no correction."""
    heading = ("head", "kind", "data", "n") + tuple(name for name, _, _ in TABLE)
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    for (head, kind, stage), own in rows.groups("head", "scenario", "stage").items():
        cells = [head, kind, stage, str(len(own))] + [cell_or_dash(float(of(own)), digits) for _, of, digits in TABLE]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
