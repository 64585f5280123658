# SPDX-License-Identifier: GPL-3.0-or-later
"""prior: what the prior says before any measurement, held against published ranges of brain shift.

    draws.csv        prior_predictive: a row per part of the prior and brain drawn from it;
                     part,settled,cortex_mm,tumour_mm,far_side_mm,outward_mm,min_volume_ratio.
                     Of brains without a contact set (settled 0) nothing else is known; det F is that
                     of "total" alone
    truncation.csv   place,left_out_sd_mm: what the modes leave out, not drawn
    TARGETS          place,quantile_pct,target_mm,low_mm,high_mm,source: every place and 5, 50, 95 %
                     once, derived from the series that `source` names (docs/decisions/0018); motion by
                     deformation alone; low to high counts as agreement

Writes quantiles.csv, pictures and checks, and ends with the summary of all records.
"""
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import chart
from .checks import Record
from .common import InputError, study_parser, write_file
from .rows import Table, csv_text, significant
from .stats import correlation, mean_std, percentile
from .summary import finish

STUDY = "prior-predictive"
PLACES = {"cortex": "Cortex, centre of the craniotomy", "tumour": "Tumour, centroid", "far side": "Far side, opposite cortex"}
QUANTILES, TARGET_QUANTILES = (5, 25, 50, 75, 95), (5, 50, 95)
LEAST_MM = 0.02  # logarithmic axes begin here; what moves less is drawn at the edge


def column_of(place):
    return place.replace(" ", "_") + "_mm"


@dataclass
class Target:
    target_mm: float
    low_mm: float
    high_mm: float
    source: str

    def holds(self, motion_mm):
        return self.low_mm <= motion_mm <= self.high_mm

    def bracket(self):
        return f"{significant(self.low_mm, 3)} to {significant(self.high_mm, 3)}"


def read_targets(table):
    """{(place, quantile): Target}"""
    table.need("place", "quantile_pct", "target_mm", "low_mm", "high_mm", "source")
    targets = {}
    for row in table:
        key = row["place"], row.number("quantile_pct")
        target = Target(*(row.number(column) for column in ("target_mm", "low_mm", "high_mm")), row["source"])
        if key[0] not in PLACES:
            raise row.error("place", f'"{key[0]}" is unknown')
        if key[1] not in TARGET_QUANTILES:
            raise row.error("quantile_pct", "is not 5, 50 or 95")
        if not 0.0 <= target.low_mm <= target.target_mm <= target.high_mm:
            raise row.error("target_mm", "must be 0 <= low_mm <= target_mm <= high_mm")
        if not target.source:
            raise row.error("source", "is missing")
        if key in targets:
            raise row.error("place", "stands with this quantile_pct in an earlier line too")
        targets[key] = target
    for key in ((place, quantile) for place in PLACES for quantile in TARGET_QUANTILES):
        if key not in targets:
            raise InputError(f"{table.origin}: no target for {key[0]}, quantile_pct {key[1]}")
    return targets


def quantile_table(parts, targets):
    """A row per part and place; the targets stand beside the total alone."""
    columns = ["part", "place", "draws", "unsettled", *(f"q{q}_mm" for q in QUANTILES),
               *(f"target_q{q}_mm" for q in TARGET_QUANTILES), *(f"bracket_q{q}_mm" for q in TARGET_QUANTILES), "source"]
    rows = []
    for part, draws in parts.items():
        settled = draws.where(settled="1")
        for place in PLACES:
            motion = settled.numbers(column_of(place))
            of_place = [targets[place, q] for q in TARGET_QUANTILES] if part == "total" else []
            rows.append([part, place, str(len(motion)), str(len(draws) - len(motion)),
                         *(significant(percentile(motion, q), 4) for q in QUANTILES),
                         *([significant(one.target_mm, 3) for one in of_place] or [""] * 3),
                         *([one.bracket() for one in of_place] or [""] * 3), of_place[0].source if of_place else ""])
    return csv_text(columns, rows)


def check_quantiles(total, targets, record):
    """Is each quantile inside its bracket? Without draws there is none, and the check fails."""
    for (place, quantile), target in targets.items():
        value = percentile(total.numbers(column_of(place)), quantile)
        record.check(STUDY, f"{place} {quantile:g} % quantile mm", value, target.bracket() + " mm", target.holds(value),
                     target.source)


def share_at_most(values, bound):
    """Per cent of the values that are not above; one that is no number counts. NaN without values."""
    return 100.0 * float(np.mean(~(values > bound))) if len(values) else np.nan


def record_figures(draws, truncation, record):
    total = draws.where(settled="1")
    cortex, tumour, far = (total.numbers(column_of(place)) for place in PLACES)
    ratio = total.numbers("min_volume_ratio")
    outward = mean_std(total.numbers("outward_mm"))
    with np.errstate(divide="ignore", invalid="ignore"):
        beside = far / cortex
    for name, value, note in (
            ("draws with inverted elements %", share_at_most(ratio, 0.0), "det F <= 0"),
            ("draws with det F of 0.5 or less %", share_at_most(ratio, 0.5), "bound of an unusable field (decision 0019)"),
            ("mean of the cortex's outward motion mm", outward[0], "derived: 0 to -2"),
            ("sd of the cortex's outward motion mm", outward[1], "derived: 4.5 to 5"),
            ("correlation of cortex and tumour", correlation(cortex, tumour), "judgement: 0.3 to 0.7"),
            ("median of far side over cortex", percentile(beside, 50.0), "judgement: below 0.25"),
            ("draws whose contact did not settle", len(draws) - len(total), "left out")):
        record.figure(STUDY, name, value, note)
    for row in truncation:
        record.figure(STUDY, f"{row['place']} left out by truncation mm", row.number("left_out_sd_mm"),
                      "sd per component; not drawn")


def draw_predictive(total, targets, path):
    """Share of draws that move less, beside the published quantiles. That of the far side rests on no
    series."""
    fig, axes = chart.figure(f"Motion of {len(total)} brains drawn from the prior", columns=3, size=(12.5, 4.6))
    for ax, (place, title) in zip(axes, PLACES.items()):
        motion = np.maximum(LEAST_MM, np.sort(total.numbers(column_of(place))))
        ax.plot(motion, 100.0 * (np.arange(len(motion)) + 0.5) / len(motion), color=chart.BLUE, label="prior")
        ax.plot([percentile(motion, q) for q in TARGET_QUANTILES], TARGET_QUANTILES, "o", color=chart.BLUE,
                label="its 5, 50, 95 %")
        origin = "judgement" if place == "far side" else "published"
        of_place = [targets[place, q] for q in TARGET_QUANTILES]
        for one, quantile in zip(of_place, TARGET_QUANTILES):
            ax.plot([max(LEAST_MM, one.low_mm), one.high_mm], [quantile] * 2, color=chart.VERMILLION,
                    label=f"{origin}: bracket" if quantile == 5 else None)
        ax.plot([one.target_mm for one in of_place], TARGET_QUANTILES, "s", color=chart.VERMILLION, label=f"{origin}: target")
        ax.set_title(title, loc="left")
        chart.label(ax, "motion (mm)", "draws that move less (%)", log_x=True)
        chart.legend(ax, loc="upper left", bbox_to_anchor=None)
    chart.save(fig, path)


def draw_parts(parts, path):
    fig, ax = chart.figure("Motion by each part of the prior alone", "marker: median of the draws; line: 5 to 95 %",
                           size=(11.5, 4.8))
    for k, place in enumerate(PLACES):
        motion = [np.maximum(LEAST_MM, draws.where(settled="1").numbers(column_of(place))) for draws in parts.values()]
        low, median, high = (np.array([percentile(one, q) for one in motion]) for q in TARGET_QUANTILES)
        style = chart.style(k)
        ax.errorbar(np.arange(len(parts)) + 0.22 * (k - 1), median, yerr=[median - low, high - median], linestyle="none",
                    fmt=style["marker"], color=style["color"], label=place)
    ax.set_xticks(range(len(parts)), [part.replace("_gravity", " g").replace("_volume", " vol.") for part in parts])
    ax.grid(axis="x", visible=False)
    chart.label(ax, "part of the prior", "motion (mm)", log_y=True)
    chart.legend(ax)
    chart.save(fig, path)


def main(arguments):
    parser = study_parser("prior", __doc__.partition("\n")[0].partition(": ")[2], "make prior", "Prior")
    parser.add_argument("--targets", type=Path, default=Path(__file__).parents[1] / "prior_study" / "targets.csv",
                        help="table of published quantiles")
    options = parser.parse_args(arguments)
    targets = read_targets(Table.read(options.targets))
    draws = Table.read(options.dir / "draws.csv", ("part", "settled", *map(column_of, PLACES), "outward_mm", "min_volume_ratio"))
    truncation = Table.read(options.dir / "truncation.csv", ("place", "left_out_sd_mm"))
    parts = draws.groups("part")
    if "total" not in parts:
        raise InputError(f"{draws.origin}: column part: no row of total")
    write_file(options.dir / "quantiles.csv", quantile_table(parts, targets))
    total = parts["total"].where(settled="1")
    if len(total):
        draw_predictive(total, targets, options.dir / "prior-predictive.png")
        draw_parts(parts, options.dir / "prior-parts.png")
    record = Record(options.dir)
    check_quantiles(total, targets, record)
    record_figures(parts["total"], truncation, record)
    record.save()
    return finish(options)
