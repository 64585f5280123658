# SPDX-License-Identifier: GPL-3.0-or-later
"""ablations: what each part of the default estimate buys (docs/ablations.md).

Rows (rows-HEAD.csv) are those of the program `ablations`, one per update: the estimate with one part off,
or one on that it leaves out, against the default on the same surgeries. Four measures, of an update from
the tumour alone and of the last one of a surgery:

    tumour, craniotomy   mean error of the tumour's points, closest point distance (mm)
    brain                mean error over all nodes (mm)
    interval             | coverage of the 90 % interval - 0.9 |

Errors of different truths differ by decades: those in mm are compared by their logarithms, and their means
are geometric ones. Surgeries of one patient are no independent samples: means are over the seeds of a truth,
then over the patient's truths, and a paired t test is over the patients. A difference counts when it has
p < SIGNIFICANT and the mean changes by more than LEAST_CHANGE of the default's, or by LEAST_COVERAGE. A part is
held against 88 combinations of measure, group and data, of which one would count by chance: it must buy
something in LEAST_BUYS.
"""
import math
from dataclasses import dataclass

import numpy as np

from . import chart
from .checks import Record
from .common import InputError, study_parser, write_file
from .rows import Table, study_rows
from .stats import mean_std, over, paired_t_test, percentile
from .summary import finish

SIGNIFICANT, LEAST_CHANGE, LEAST_COVERAGE, LEAST_BUYS = 0.01, 0.02, 0.01, 2
LEAST_ERROR_MM = 1e-4  # below this an error is none
DEFAULT, EVERYTHING, ALONE, ALL_DATA = "default", "all surgeries", "tumour alone", "all data"

# Variant (tests/ablations/parts.cpp), what it is about, what differs. The part is ...
PARTS = {
    "prior": (  # ... of the model and the prior, and off
        ("fixed", "contact", "boundary condition fixed"),
        ("no-buoyancy", "buoyancy", "`prior.gravity_mode_sd: 0`"),
        ("no-tumour-volume", "swelling about the tumour", "`prior.tumour_volume_strain_sd: 0`"),
        ("no-brain-volume", "brain volume", "`prior.brain_volume_strain_sd: 0`"),
        ("no-opening", "opening", "`prior.opening_pressure_sd_pa: 0`"),
        ("no-unevenness", "buoyancy that differs from side to side",
         "`prior.gravity_sides_sd: 0`, `gravity_ends_sd: 0`"),
        ("no-tract", "instruments on the way to the tumour", "`prior.tract_pressure_sd_pa: 0`"),
        ("no-ventricle-volume", "volume where the ventricles lie", "`prior.ventricle_volume_strain_sd: 0`"),
        ("no-medium", "medium remainder", "`prior.medium_density_sd_n_m3: 0`"),
        ("no-coarse", "coarse remainder", "`prior.coarse_density_sd_n_m3: 0`"),
        ("uncorrelated", "correlation of the remainder", "its lengths at their least: 1 mm"),
        ("low-rank", "rank", "`condensed.max_rank: 157`")),
    "data": (  # ... what is made of the data, and off
        ("fixed-strengths", "strengths from the data", "`prior.scales: fixed`"),
        ("no-broad-hypothesis", "a hypothesis that every part is strong", "`prior.broad_weight: 0`"),
        ("no-shared-errors", "shared errors of a surface", "`sensing.surface_pose_sd_mm: 0`, `_deg: 0`"),
        ("no-robust-weights", "robust weights", "`sensing.outliers: kept`"),
        ("no-boundary-error", "error of a boundary's points", "`sensing.boundary_error_sd_mm: 0`"),
        ("no-outline-errors", "shared errors of the tumour's outline", "`sensing.boundary_outline_errors: none`"),
        ("no-averages", "averages of a boundary's points", "`sensing.boundary_average_mm: 0`"),
        ("rigid-tumour", "tumour as distances", "`sensing.tumour: rigid`"),
        ("rigid-cortex", "cortex as distances", "`sensing.surface: rigid`"),
        ("no-cortex", "surface data and vessel tracks", "the tumour's data alone")),
    "added": (  # ... left out by the default, and on
        ("fine", "fine remainder", "`prior.force_density_sd_n_m3: 1000`"),
        ("across", "buoyancy across gravity", "`prior.gravity_direction_sd_deg: 10`"),
        ("resection", "resection", "`prior.resection_weight_sd: 1`, `resection_stress_sd_pa: 300`"),
        ("all-families", "these three with room for their modes", "all of these, and `condensed.max_rank: 253`"),
        ("probe-pose", "shared error of the probe", "`sensing.probe_pose_sd_mm: 0.5`, `_deg: 0.5`"),
        ("high-rank", "a higher rank", "`condensed.max_rank: 253`"),
        ("refined", "refinement",
         "half the edge at tumour and rim (`mesh.generate.tumour_edge_mm`, `craniotomy_edge_mm`)"),
        ("pressure", "pore pressure", "`scene.pressure: on`"))}
LEFT_OUT = (
    ("evidence", "an update does not publish the evidence of its data: no -log evidence is shown"),
    ("model error", "the tenth of the motion that the medium remainder keeps has no key"),
    ("correlation of neighbouring boundary points", "no key: decision 0029 has figures"),
    ("calculix", "that truth belongs to the mesh with 18 thousand nodes"))

MOTIONS = ("joint-tangential", "joint-mixed", "joint-distension", "resection", "retraction", "mannitol", "outliers")
# What is averaged and tested together.
GROUPS = (EVERYTHING, "consistency", "one ingredient", "all ingredients", *MOTIONS)
MEASURES = (("tumour", "mm", lambda row: row.number("tumour_mm")),
            ("craniotomy", "mm", lambda row: row.number("cppd_mm")),
            ("brain", "mm", lambda row: row.number("field_mm")),
            ("interval", "", lambda row: abs(row.number("coverage_90") - 0.9)))
SHORT = ("head", "patient", "truth", "seed", "variant", "data", "status", "nodes", "initial_mm", "tumour_mm",
         "cppd_mm", "initial_field_mm", "field_mm", "coverage_90", "quality", "update_ms")


def group_of(truth):
    return truth if truth in ("consistency", *MOTIONS) else "all ingredients" if truth == "all" else "one ingredient"


@dataclass
class Difference:
    measure: str
    unit: str
    group: str
    data: str
    patients: int
    of_default: float  # means over the patients
    of_variant: float
    p: float

    def change(self):
        """Of the default's mean; of the interval the difference itself. Positive: the variant is worse."""
        more = self.of_variant - self.of_default
        return more / max(self.of_default, 1e-9) if self.unit else more

    def counts(self):
        return self.p < SIGNIFICANT and abs(self.change()) > (LEAST_CHANGE if self.unit else LEAST_COVERAGE)

    def text(self):
        return (f"{self.measure}, {self.group}, {self.data}: {self.of_default:.2f} → {self.of_variant:.2f}"
                + (f" {self.unit}" if self.unit else ""))


def surgery_of(row):
    return tuple(row[column] for column in ("head", "patient", "truth", "seed"))


def updates_of(rows, data):
    """{surgery: its row}: of the update from the tumour alone, or of the last one."""
    return {surgery_of(row): row for row in rows if data == ALL_DATA or row["data"] == "tumour"}


def differences(default, variant):
    """Of every measure, group and data with two patients or more; a surgery that either of them was refused
    in does not count."""
    found = []
    for data in (ALONE, ALL_DATA):
        defaults = updates_of(default, data)
        both = [(defaults[surgery], row) for surgery, row in updates_of(variant, data).items() if surgery in defaults]
        for measure, unit, value in MEASURES:
            pairs = [(row, np.array((value(before), value(row)))) for before, row in both]
            pairs = [(row, np.log(np.maximum(pair, LEAST_ERROR_MM)) if unit else pair)
                     for row, pair in pairs if np.isfinite(pair).all()]
            for group in GROUPS:
                ours = of_patients([(row, pair) for row, pair in pairs if group in (EVERYTHING, group_of(row["truth"]))])
                if len(ours) < 2:
                    continue
                means = [math.exp(one) if unit else one for one in (mean_std(ours[:, 0])[0], mean_std(ours[:, 1])[0])]
                found.append(Difference(measure, unit, group, data, len(ours), *means,
                                        paired_t_test(ours[:, 1], ours[:, 0]).p))
    return found


def of_patients(pairs):
    """A row per patient: the mean over his truths of the mean over their surgeries."""
    patients = {}
    for row, pair in pairs:
        patients.setdefault((row["head"], row["patient"]), {}).setdefault(row["truth"], []).append(pair)
    return np.array([np.mean([np.mean(own, axis=0) for own in truths.values()], axis=0) for truths in patients.values()])


def median_time_ratio(default, variant):
    """Of the updates of the same data; what else the machine did is in it. NaN without any."""
    times = {(*surgery_of(row), row["data"]): row.number("update_ms") for row in default}
    ratios = [over(row.number("update_ms"), times.get((*surgery_of(row), row["data"]), 0)) for row in variant]
    return percentile([ratio for ratio in ratios if math.isfinite(ratio)], 50)


class Held:
    """A part that has rows, held against the default."""

    def __init__(self, kind, name, change, default, variant):
        self.kind, self.name, self.change = kind, name, change
        self.differences = differences(default, variant)
        self.time = median_time_ratio(default, variant)
        counting = sorted((one for one in self.differences if one.counts()), key=lambda one: -round(abs(one.change()), 9))
        # Without the part worse, or, where it was added, with it better.
        self.buys = [one for one in counting if (one.of_variant > one.of_default) != (kind == "added")]
        self.costs = [one for one in counting if one not in self.buys]

    def find(self, measure, group, data):
        return next((one for one in self.differences
                     if (one.measure, one.group, one.data) == (measure, group, data)), None)


def held_parts(rows):
    variants = rows.groups("variant")
    default = variants.pop(DEFAULT, Table(rows.columns))
    held = [Held(kind, name, change, default, variants.pop(variant))
            for kind, parts in PARTS.items() for variant, name, change in parts if variant in variants]
    if variants:
        raise InputError(f"{rows.origin}: variant {next(iter(variants))} is not described in studies/ablations.py")
    return held


def parts_table(held):
    """The table of docs/ablations.md: errors over all surgeries, the variant's over the default's; in how
    many combinations the part buys or costs something, and the largest of each."""
    def ratio(difference):
        return f"{1 + difference.change():.2f}" if difference else "–"

    def found(some, of):
        return f"{len(some)} of {of}; {some[0].text()}" if some else "nothing"

    text = ("| part | changed | tumour, tumour alone | tumour | craniotomy | brain | time | the part buys "
            "| the part costs |\n|---|---|---|---|---|---|---|---|---|\n")
    for one in held:
        cells = [one.name + (" (off by default)" if one.kind == "added" else ""), one.change,
                 ratio(one.find("tumour", EVERYTHING, ALONE)),
                 *(ratio(one.find(measure, EVERYTHING, ALL_DATA)) for measure in ("tumour", "craniotomy", "brain")),
                 f"{one.time:.2f}" if math.isfinite(one.time) else "–",
                 found(one.buys, len(one.differences)), found(one.costs, len(one.differences))]
        text += f"| {' | '.join(cells)} |\n"
    return text


def left_out_list():
    return "".join(f"- {part}: {reason}\n" for part, reason in LEFT_OUT)


def short_rows(rows):
    """The columns that the table and its reader want: what docs/ablations keeps."""
    return "".join(",".join(line) + "\n" for line in (SHORT, *([row[column] for column in SHORT] for row in rows)))


def judge(rows, held, record):
    """Every part that is on by default buys something, in more places than by chance."""
    surgeries = len(rows.where(variant=DEFAULT, data="tumour"))
    source = f"{surgeries} surgeries of {len(rows.values('patient'))} patients; {rows[0]['nodes']} nodes"
    for one in held:
        name = f"{one.name}: combinations in which it buys something"
        beside = f"of {len(one.differences)}; it costs something in {len(one.costs)}"
        if one.kind == "added":
            record.figure("ablations", name, len(one.buys), f"shown; {beside}", source)
        else:
            record.check("ablations", name, len(one.buys), f">= {LEAST_BUYS} ({beside})", len(one.buys) >= LEAST_BUYS, source)
    record.figure("ablations", "updates that were refused", len(rows.where(status="refused")),
                  f"shown; of {len(rows)}", source)
    for part, reason in LEFT_OUT:
        record.left_out("ablations", f"{part}: {reason}".replace(",", ";"))


def draw(held, folder):
    """Error of the last update, the variant's over the default's: a line per part, a column per group."""
    colours = chart.colour_map(chart.BLUE, "white", chart.VERMILLION)
    for measure, title in (("tumour", "Error at the tumour"), ("craniotomy", "Distance at the craniotomy")):
        fig, ax = chart.figure(f"{title} without a part (–), or with one more (+), over the default's",
                               "geometric means over patients; updates from all data. Above 1: worse than the default.\n"
                               "Bold: by more than 2 % with p < 0.01 over patients. 1: by less than 2 %",
                               size=(9.8, 1.7 + 0.26 * len(held)))
        found = [[one.find(measure, group, ALL_DATA) for group in GROUPS] for one in held]
        ratios = np.array([[1 + one.change() if one else math.nan for one in line] for line in found])
        ax.imshow(np.log2(np.maximum(ratios, 1e-6)), cmap=colours, vmin=-2, vmax=2, aspect="auto")
        for i, line in enumerate(found):
            for k, one in enumerate(line):
                same = bool(one) and abs(one.change()) < LEAST_CHANGE
                ax.text(k, i, "–" if one is None else "1" if same else f"{ratios[i, k]:.2f}", ha="center", va="center",
                        fontsize=9, color=chart.GREY if same else chart.INK,
                        fontweight="bold" if one and one.counts() else "normal")
        ax.set_xticks(range(len(GROUPS)), [group.replace(" ", "\n").replace("-", "-\n") for group in GROUPS],
                      fontsize=8)
        ax.set_yticks(range(len(held)), [("+ " if one.kind == "added" else "– ") + one.name for one in held],
                      fontsize=9)
        for i in range(1, len(held)):
            if held[i].kind != held[i - 1].kind:
                ax.axhline(i - 0.5, color=chart.INK, linewidth=1.5)
        ax.tick_params(length=0)
        ax.grid(visible=False)
        chart.save(fig, folder / f"ablations-{measure}.png")


def main(arguments):
    options = study_parser("ablations", "Checks, table and pictures of rows-*.csv of the folder.", "make ablations",
                           "Ablations").parse_args(arguments)
    rows = study_rows(options.dir, SHORT)
    held = held_parts(rows)
    record = Record(options.dir)
    judge(rows, held, record)
    record.save()
    write_file(options.dir / "page.md", f"{parts_table(held)}\n{left_out_list()}")
    write_file(options.dir / "rows.csv", short_rows(rows))
    draw(held, options.dir)
    return finish(options)
