# SPDX-License-Identifier: GPL-3.0-or-later
"""anatomy: what falx, tentorium and ventricles of a label map bring, in the rows of the program `anatomy`.

    rows-HEAD.csv   a row per update of both models: head, kind, seed, stage; with_* the model with anatomy, without_*
                    the one of the same case without (docs/anatomy.md)

Judged is the last update of a surgery, each head by itself. An error ratio is the mean over surgeries of the one model's
error over that of the other; its 95 % interval is by a bootstrap over surgeries, both models of one drawn together. A
refused update is wrong by the true motion and covers nothing. Truths without an equilibrium are told and left out.
loaded_mm is what a model's own answer to the true load is wrong by: what no inference takes away.
"""
import math

import numpy as np

from . import chart
from .checks import Record
from .common import InputError, study_parser, write_file
from .rows import Table, cell_or_dash, study_rows
from .stats import over
from .summary import finish

STUDY = "anatomy"
KINDS = ("air-side", "falx-sag", "ventricles-drain", "sag")
BOUNDS = {"air-side": 0.6, "ventricles-drain": 0.6, "sag": 1.1}  # of the ratio; falx-sag is shown
VOLUME_BOUND, LEAST_COVERAGE, MOST_COVERAGE = 25.0, 0.80, 0.97
PARTS = {"": "", "opened_": " on the half with the opening", "other_": " on the other half"}  # of field errors
COLUMNS = ("head", "kind", "seed", "stage", "reason", "true_mm", "true_opened_mm", "true_other_mm", "true_max_mm", "volume_loss",
           "true_change_mm3") + tuple(
    f"{model}_{what}" for model in ("with", "without") for what in (
        "status", "field_mm", "field_opened_mm", "field_other_mm", "loaded_mm", "tumour_mm", "near_coverage_90",
        "far_coverage_90", "ventricle_change_mm3", "quality"))
DRAWS = 4000


def last_updates(rows):
    """Of every surgery that has a truth; in the order of the rows."""
    last = [own[-1] for own in rows.groups("head", "kind", "seed").values()]
    return Table(rows.columns, [row for row in last if math.isfinite(row.number("true_mm"))], rows.origin)


def error_mm(row, model, part=""):
    error = row.number(f"{model}_field_{part}mm")
    return error if math.isfinite(error) else row.number(f"true_{part}mm")


def errors(rows, part=""):
    """Two arrays: with and without anatomy, mm. part: a key of PARTS."""
    return tuple(np.array([error_mm(row, model, part) for row in rows]) for model in ("with", "without"))


def ratio(rows, part=""):
    """(ratio of means, low, high); the bootstrap has a seed of its own."""
    ours, theirs = errors(rows, part)
    if not len(ours) or not theirs.mean() > 0.0:
        return math.nan, math.nan, math.nan
    draws = np.random.default_rng(42).integers(0, len(ours), (DRAWS, len(ours)))
    ratios = ours[draws].mean(axis=1) / theirs[draws].mean(axis=1)
    return float(ours.mean() / theirs.mean()), *map(float, np.percentile(ratios, (2.5, 97.5)))


def volume_errors_pct(rows):
    """Of the change of the ventricles' volume, per surgery, over the true change; 100 where an update tells none."""
    found = []
    for row in rows:
        true, told = row.number("true_change_mm3"), row.number("with_ventricle_change_mm3")
        found.append(100.0 * abs((told if math.isfinite(told) else 0.0) / true - 1.0))
    return np.array(found)


def or_zero(numbers):
    return np.nan_to_num(numbers)


class Judge:
    def __init__(self, rows, record):
        self.rows, self.record = rows, record

    def run(self):
        for (head, kind), own in self.rows.groups("head", "kind").items():
            name = f"{head}: {kind}"
            last = last_updates(own)
            missing = len(own.groups("seed")) - len(last)
            if missing:
                self.record.left_out(STUDY, f"{name}: {missing} surgeries without an equilibrium")
            if not len(last):
                continue
            source = f"{len(last)} surgeries"
            self.ratio(name, kind, last, source)
            if kind == "ventricles-drain":
                self.volumes(name, last, source)
            self.coverage(name, last, source)

    def ratio(self, name, kind, last, source):
        mean, low, high = ratio(last)
        ours, theirs = errors(last)
        told = f"95 %: {low:.3g} to {high:.3g}; {ours.mean():.3g} and {theirs.mean():.3g} of {last.mean('true_mm'):.3g} mm"
        called = f"{name}: field error with anatomy over without"
        if kind in BOUNDS:
            self.record.check(STUDY, called, mean, f"<= {BOUNDS[kind]:g} ({told})", mean <= BOUNDS[kind], source)
        else:
            self.record.figure(STUDY, called, mean, f"shown ({told})", source)

        for part, where in list(PARTS.items())[1:]:
            mean, low, high = ratio(last, part)
            ours, theirs = errors(last, part)
            self.record.figure(STUDY, called + where, mean, f"shown (95 %: {low:.3g} to {high:.3g}; {ours.mean():.3g} and "
                               f"{theirs.mean():.3g} of {last.mean(f'true_{part}mm'):.3g} mm)", source)
        ours, theirs = (last.mean(f"{model}_loaded_mm") for model in ("with", "without"))
        if math.isfinite(ours) and theirs > 0.0:
            self.record.figure(STUDY, f"{name}: the same of the models' answers to the true load", ours / theirs,
                               f"shown ({ours:.3g} and {theirs:.3g} mm)", source)

    def volumes(self, name, last, source):
        found = volume_errors_pct(last)
        bias = 100.0 * (or_zero(last.numbers("with_ventricle_change_mm3")).sum() / last.numbers("true_change_mm3").sum() - 1.0)
        self.record.check(STUDY, f"{name}: error of the ventricles' change of volume %", float(found.mean()),
                          f"<= {VOLUME_BOUND:g} (mean; median {np.median(found):.3g}; all together {bias:+.3g} %)",
                          bool(found.mean() <= VOLUME_BOUND), source)
        lost = 100.0 * last.finite("volume_loss")
        self.record.figure(STUDY, f"{name}: part of the drained volume that is lost %", float(lost.mean()),
                           f"shown ({lost.min():.3g} to {lost.max():.3g}; 30 to 70 were drawn)", source)

    def coverage(self, name, last, source):
        near = float(or_zero(last.numbers("with_near_coverage_90")).mean())
        self.record.check(STUDY, f"{name}: coverage of the 90 % interval near with anatomy", near,
                          f"{LEAST_COVERAGE:.2f} to {MOST_COVERAGE:.2f}", LEAST_COVERAGE <= near <= MOST_COVERAGE, source)
        for part, model in (("near", "without"), ("far", "with"), ("far", "without")):
            value = float(or_zero(last.numbers(f"{model}_{part}_coverage_90")).mean())
            self.record.figure(STUDY, f"{name}: coverage {part} {model} anatomy", value, "shown", source)
        unusable = np.mean([row["with_quality"] == "unusable" for row in last])
        self.record.figure(STUDY, f"{name}: unusable updates with anatomy %", 100.0 * float(unusable), "shown", source)


def draw(rows, path):
    last = last_updates(rows)
    heads = last.values("head")
    fig, axes = chart.figure("Field error of the same surgeries with and without the anatomy of a label map",
                             "mean over the brain; last update; dashed: equal", columns=len(heads), size=(5.6 * len(heads), 5.2))
    for ax, head in zip(np.ravel(axes), heads):
        for k, kind in enumerate(kind for kind in KINDS if kind in last.values("kind")):
            ours, theirs = errors(last.where(head=head, kind=kind))
            ax.plot(theirs, ours, linestyle="none", label=kind, **chart.style(k))
        most = max(float(values.max()) for values in errors(last.where(head=head))) * 1.05
        ax.plot((0, most), (0, most), color=chart.INK, linestyle="--", linewidth=1.2)
        chart.label(ax, f"{head}: without anatomy (mm)", "with anatomy (mm)")
        ax.legend(loc="upper left")
    chart.save(fig, path)


def table_text(rows):
    """Markdown: a line per head and kind. Errors are means, mm."""
    text = ("| head | truth | surgeries | motion | error without | with | ratio; 95 % | opened half | other half "
            "| under the true load | coverage near without, with | ventricles: change, error |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n")
    for (head, kind), own in last_updates(rows).groups("head", "kind").items():
        ours, theirs = errors(own)
        mean, low, high = ratio(own)
        halves = " | ".join(f"{ratio(own, part)[0]:.2f}" for part in ("opened_", "other_"))
        loaded = over(own.mean("with_loaded_mm"), own.mean("without_loaded_mm"))
        covered = [float(or_zero(own.numbers(f"{model}_near_coverage_90")).mean()) for model in ("without", "with")]
        volume = "" if kind != "ventricles-drain" else (
            f"{own.mean('true_change_mm3') / 1000:.1f} cc, {volume_errors_pct(own).mean():.0f} %")
        text += (f"| {head} | {kind} | {len(own)} | {own.mean('true_mm'):.2f} | {theirs.mean():.2f} | {ours.mean():.2f} "
                 f"| {mean:.2f}; {low:.2f} to {high:.2f} | {halves} | {cell_or_dash(loaded, 2)} "
                 f"| {covered[0]:.2f}, {covered[1]:.2f} | {volume} |\n")
    return text


def main(arguments):
    parser = study_parser("anatomy", __doc__.partition("\n")[0].partition(": ")[2], "make anatomy", "Anatomy")
    options = parser.parse_args(arguments)
    rows = study_rows(options.dir, COLUMNS)
    if not len(last_updates(rows)):
        raise InputError(f"{options.dir}: no truth with an equilibrium in rows-*.csv")
    record = Record(options.dir)
    Judge(rows, record).run()
    write_file(options.dir / "kinds.md", table_text(rows))
    draw(rows, options.dir / "anatomy-fields.png")
    record.save()
    return finish(options)
