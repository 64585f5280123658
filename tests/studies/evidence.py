# SPDX-License-Identifier: GPL-3.0-or-later
"""evidence: twins of the paper's five patients against truths that share the estimate's model and truths
that do not: bounds, tables and pictures (docs/evidence.md).

Rows (rows-HEAD.csv) are those of the program `evidence`, one per update; landmarks-CASE.csv those of
`evidence_landmarks`. Means are over the patients' means, so that every patient counts alike, and what is said of
chance is said over patients: two updates of one patient are no two samples.
"""
import math
from functools import partial

from . import chart, clusters
from .checks import Record
from .common import study_parser, write_file
from .evidence_tables import (MAPS, MEAN_CONTACT_CPPD_MM, MEAN_CONTACT_RECOVERED, MEAN_FIXED_CPPD_MM, PAPER,
                              claims_table, landmarks_table, mean_of, patient_mean, patient_tables, rms, truths_table)
from .rows import Table, study_rows
from .stats import paired_t_test
from .summary import finish

COVERED = (0.80, 0.97)  # of what landmarks left out are predicted to be
FAR_OFF = ("all", "calculix")  # all ingredients together, and another code
COVERAGE = (0.75, 0.97)  # bounds of the mean over the adverse truths
COLUMNS = ("head", "patient", "truth", "seed", "boundary", "data", "status", "reason", "nodes", "initial_mm",
           "recovered_pct", "tumour_mm", "shift_tumour_mm", "rigid_tumour_mm", "initial_cppd_mm", "cppd_mm",
           "coverage_90", "direction_deg", "true_direction_deg", "quality", "contact_sets", "update_ms")
OUTLINES = ("head", "patient", "truth", "seed", "boundary", "data", "swelling_absent")
WITHOUT_SWELLING = ("1",)  # patients (docs/evidence/truths.md)
ONE_NAT = 1 / (1 + math.e)  # what is left for "no swelling" where the odds, even before, are e to 1 against it
LANDMARKS = ("pose", "landmark", *(column for _, column in MAPS), "sd_mm", "inside_90", "quality")
INTERVALS = (50, 68, 80, 90, 95, 99)


def least_recovered(truth):
    return 95 if truth == "consistency" else 80 if truth in FAR_OFF else 88


class EvidenceChecks:
    """Of the rows of one head."""

    def __init__(self, rows, record):
        self.rows, self.record = rows, record
        self.head = rows[0]["head"]
        source = f"twins of {len(rows.values('patient'))} patients; {rows[0]['nodes']} nodes"
        self.check = partial(record.check, self.head, source=source)
        self.figure = partial(record.figure, self.head, source=source)

    def run(self):
        for truth in self.rows.values("truth"):
            rows = self.rows.where(truth=truth)
            # Fields of another code are those of one mesh; refused() says so.
            if truth == "calculix" and all(row["status"] == "refused" for row in rows):
                continue
            by = {(boundary, data): rows.where(boundary=boundary, data=data)
                  for boundary in ("contact", "fixed") for data in ("tumour", "tumour+cortex")}
            self.recovered(truth, by)
            self.craniotomy(truth, by)
            self.boundaries(truth, by)
            alone = patient_mean(by["contact", "tumour"], "coverage_90")
            self.figure(f"{truth}: coverage of the 90 % interval",
                        patient_mean(by["contact", "tumour+cortex"], "coverage_90"),
                        f"shown (from the tumour alone {alone:.2f})")
            self.shift(truth, by["contact", "tumour"])
            self.unusable(truth, rows.where(boundary="contact"), rows.where(boundary="fixed"))
        self.mean_coverage()
        for patient in self.rows.values("patient"):
            self.of_patient(patient)
        self.refused()

    def recovered(self, truth, by):
        alone = patient_mean(by["contact", "tumour"], "recovered_pct")
        fixed = patient_mean(by["fixed", "tumour"], "recovered_pct")
        joint = patient_mean(by["contact", "tumour+cortex"], "recovered_pct")
        least = least_recovered(truth)
        self.check(f"{truth}: tumour recovered %", alone,
                   f">= {least} (paper {MEAN_CONTACT_RECOVERED}; fixed {fixed:.1f}; with cortex {joint:.1f})",
                   alone >= least)

    def craniotomy(self, truth, by):
        alone = patient_mean(by["contact", "tumour"], "cppd_mm")
        before = patient_mean(by["contact", "tumour"], "initial_cppd_mm")
        fixed = patient_mean(by["fixed", "tumour"], "cppd_mm")
        joint = patient_mean(by["contact", "tumour+cortex"], "cppd_mm")
        name = f"{truth}: craniotomy CPPD mm from the tumour alone"
        beside = (f"(paper {MEAN_CONTACT_CPPD_MM:.1f} and fixed {MEAN_FIXED_CPPD_MM:.1f}; "
                  f"here before {before:.2f} and fixed {fixed:.2f})")
        if truth == "consistency":
            self.check(name, alone, f"<= 1.0 {beside}", alone <= 1.0)
        else:
            self.figure(name, alone, f"shown {beside}")
        most = 0.5 if truth == "consistency" else 1.0
        self.check(f"{truth}: craniotomy CPPD mm from tumour and cortex", joint, f"<= {most:.1f} (paper: none)",
                   joint <= most)

    def boundaries(self, truth, by):
        """Contact over fixed on the same surgeries: each patient's ratio, and their geometric mean."""
        for name, what in (("tumour_mm", "tumour error"), ("cppd_mm", "craniotomy CPPD")):
            ratio = over_fixed(by, name)
            if ratio.count >= 2:
                self.check(f"{truth}: {what} with contact over that of fixed", ratio.mean, f"<= 1 ({ratio})",
                           ratio.mean <= 1)

    def shift(self, truth, rows):
        """An update must not do worse at the tumour than shifting it by the same boundary does."""
        worse = sum(row.number("tumour_mm") > row.number("shift_tumour_mm") for row in rows)
        name = f"{truth}: updates worse at the tumour than a rigid shift of it"
        beside = (f"{len(rows)} (estimate {patient_mean(rows, 'tumour_mm'):.2f}; "
                  f"shift {patient_mean(rows, 'shift_tumour_mm'):.2f}; "
                  f"best rigid motion {patient_mean(rows, 'rigid_tumour_mm'):.2f} mm)")
        self.check(name, worse, f"0 of {beside}", worse == 0)

    def unusable(self, truth, contact, fixed):
        """Where an update from the tumour and one beside the cortex are both unusable, the daemon makes
        the latter again from the cortex alone."""
        self.figure(f"{truth}: updates of quality unusable", len(contact.where(quality="unusable")),
                    f"shown; of {len(contact)} (fixed {len(fixed.where(quality='unusable'))} of {len(fixed)})")

    def mean_coverage(self):
        joint = self.rows.where(boundary="contact", data="tumour+cortex")
        means = [patient_mean(joint.where(truth=truth), "coverage_90")
                 for truth in self.rows.values("truth") if truth != "consistency"]
        covered = mean_of(means)
        if math.isfinite(covered):
            self.check("adverse truths: coverage of the 90 % interval", covered, "0.75 to 0.97",
                       COVERAGE[0] <= covered <= COVERAGE[1])

    def of_patient(self, patient):
        """The consistency truth beside the paper's Tables 3, 4 and 6."""
        own = self.rows.where(truth="consistency", patient=patient, data="tumour")
        contact, fixed = own.where(boundary="contact"), own.where(boundary="fixed")
        index = int(patient) - 1
        if not contact or index >= len(PAPER["misfit_mm"]):
            return
        for what, name, theirs in (("initial misfit mm", "initial_mm", "misfit_mm"),
                                   ("tumour recovered %", "recovered_pct", "contact_recovered"),
                                   ("initial CPPD mm", "initial_cppd_mm", "initial_cppd_mm"),
                                   ("CPPD mm", "cppd_mm", "contact_cppd_mm"),
                                   ("principal direction to gravity degrees", "direction_deg", "direction_deg")):
            paper = PAPER[theirs][index]
            note = (f"(paper {paper:g}; here fixed {fixed.mean(name):.3g})" if math.isfinite(paper)
                    else "(paper: none)")
            self.figure(f"patient {patient}: {what}", contact.mean(name), f"shown {note}")

    def refused(self):
        rows = self.rows.where(status="refused")
        self.figure("updates that were refused", len(rows), f"shown; of {len(self.rows)}")
        for reason in rows.values("reason"):
            self.record.left_out(self.head, reason)


def over_fixed(by, name):
    """An Interval of errors with contact over fixed; both data together. A surgery that one of them refused
    counts in neither."""
    tables = {boundary: Table(by[boundary, "tumour"].columns,
                              [*by[boundary, "tumour"], *by[boundary, "tumour+cortex"]]) for boundary in ("contact", "fixed")}
    key = lambda row: (row["patient"], row["seed"], row["data"])
    usable = [{key(row) for row in rows if math.isfinite(row.number(name))} for rows in tables.values()]
    contact, fixed = (rows.where(lambda row: key(row) in usable[0] & usable[1]) for rows in tables.values())
    return clusters.same_over(contact, fixed, name, patient=("patient",), truth=("truth", "seed"))


def check_outlines(rows, record):
    """Of one head: sags seen through an outline that is off, which must not be taken for swelling. rows: those of
    patients without swelling under the truth `segmentation`."""
    own = rows.where(lambda row: row["patient"] in WITHOUT_SWELLING, truth="segmentation", boundary="contact")
    absent = own.finite("swelling_absent")
    if not len(absent):
        return
    taken = 100 * sum(absent < ONE_NAT) / len(absent)
    record.check(own[0]["head"], "segmentation: updates that take the outline's error for swelling %", taken,
                 f"<= 10 (by more than one nat; {len(absent)} updates of sags)", taken <= 10,
                 f"{len(own.values('seed'))} surgeries of patients without swelling")


def check_landmarks(study, rows, record):
    """Landmarks of a real operation, each predicted from the others alone; in each pose of the head."""
    for pose, own in rows.groups("pose").items():
        source = f"leave-one-out over {len(own)} landmarks; evidence_landmarks"
        estimate = own.numbers("estimate_mm")
        for name, column in MAPS:
            other = own.numbers(column)
            record.figure(study, f"{pose}: rms distance of {name} mm", rms(other), "shown", source)
            if column in ("none_mm", "estimate_mm"):
                continue
            test = paired_t_test(estimate ** 2, other ** 2)
            beside = f"p {test.p:.2g} on squares"
            ratio = rms(estimate) / rms(other)
            if name == "affine":
                record.figure(study, f"{pose}: estimate over {name}", ratio, f"shown ({beside})", source)
            else:  # the estimate must be nearer
                record.check(study, f"{pose}: estimate over {name}", ratio, f"< 1 ({beside})", ratio < 1, source)
        covered = own.mean("inside_90") / 3
        record.check(study, f"{pose}: coverage of the 90 % interval", covered, f"{COVERED[0]:.2f} to {COVERED[1]:.2f}",
                     COVERED[0] <= covered <= COVERED[1], source)


def draw(rows, folder):
    truths = rows.values("truth")
    for name, title, data, y, value, bounds in (
            ("tumour", "Left of the tumour's motion, updates from the tumour alone", "tumour", "error / motion (%)",
             lambda row: 100 - row.number("recovered_pct"), {one: 100 - least_recovered(one) for one in truths}),
            ("craniotomy", "Closest point distance at the craniotomy, updates from the tumour alone", "tumour",
             "CPPD (mm)", lambda row: row.number("cppd_mm"), {one: 1 for one in truths if one == "consistency"}),
            ("coverage", "Coverage of the 90 % interval, updates from tumour and cortex", "tumour+cortex",
             "share of true components inside", lambda row: row.number("coverage_90"), {})):
        fig, ax = chart.figure(title, "a dot per simulated surgery, patient after patient", size=(12, 5))
        chart.strips(ax, truths, {boundary: [[value(row) for row in own.where(truth=truth)] for truth in truths]
                                  for boundary, own in rows.where(data=data).groups("boundary").items()})
        for k, (truth, bound) in enumerate(bounds.items()):
            at = truths.index(truth)
            ax.plot((at - 0.48, at + 0.48), (bound, bound), color=chart.INK, linestyle="--", linewidth=1.2,
                    label="" if k else "bound of the mean with contact")
        if name == "coverage":
            chart.bound_lines(ax, COVERAGE, "bounds of the mean, contact")
        chart.label(ax, "what the truth has and the estimate does not believe", y, log_y=name != "coverage")
        chart.legend(ax)
        chart.save(fig, folder / f"evidence-{name}.png")


def draw_reliability(rows, folder):
    joint = rows.where(boundary="contact", data="tumour+cortex")
    fig, ax = chart.figure("How often the truth lies in the published intervals",
                           "contact, updates from tumour and cortex; mean over patients, all nodes", size=(7.6, 5.2))
    ax.plot((50, 99), (50, 99), color=chart.INK, linestyle="--", linewidth=1.2, label="as promised")
    for k, (legend, belongs) in enumerate({
            "consistency": lambda truth: truth == "consistency",
            "one adverse ingredient": lambda truth: truth not in ("consistency", *FAR_OFF),
            "all of them": lambda truth: truth == "all",
            "CalculiX": lambda truth: truth == "calculix"}.items()):
        own = joint.where(lambda row: belongs(row["truth"]))
        if len(own):
            ax.plot(INTERVALS, [100 * patient_mean(own, f"coverage_{percent}") for percent in INTERVALS],
                    label=legend, **{**chart.style(k), "marker": "os^D"[k]})
    chart.label(ax, "share that the interval promises (%)", "share of true components inside (%)")
    chart.legend(ax)
    chart.save(fig, folder / "evidence-reliability.png")


def draw_landmarks(case, rows, folder):
    pose, rows = next(iter(rows.groups("pose").items()))
    fig, ax = chart.figure(f"Landmarks of {case} predicted from the others", f"each landmark left out once; head {pose}",
                           size=(9, 4.6))
    colours = (chart.GREY, chart.BLUE, chart.GREEN, chart.VERMILLION, chart.INK)
    for k, ((name, column), colour, marker) in enumerate(zip(MAPS, colours, "sos^D")):
        ax.plot([i + 0.15 * (k - 2) for i in range(len(rows))], rows.numbers(column), linestyle="none", marker=marker,
                color=colour, label=name)
    ax.set_xticks(range(len(rows)), [row["landmark"] for row in rows])
    ax.grid(axis="x", visible=False)
    ax.set_ylim(bottom=0)
    chart.label(ax, "landmark", "distance from where it was found (mm)")
    chart.legend(ax)
    chart.save(fig, folder / f"evidence-landmarks-{case}.png")


def page(rows, checks, landmarks):
    """The tables of docs/evidence.md, a study after the other. landmarks: {case: their rows}."""
    text = ""
    for study in checks.values("study"):
        text += f"{study}\n\n{claims_table(checks, study)}\n"
        head = rows.where(head=study)
        text += truths_table(head) + "\n" if len(head) else ""
    return text + landmarks_table(landmarks)


def main(arguments):
    options = study_parser("evidence", "Checks, tables and pictures of rows-*.csv and landmarks-*.csv of the folder.",
                           "make evidence", "Evidence").parse_args(arguments)
    folder = options.dir
    rows = study_rows(folder, COLUMNS)
    record = Record(folder)
    landmarks = {path.stem.partition("-")[2]: Table.read(path, LANDMARKS) for path in sorted(folder.glob("landmarks-*.csv"))}
    for case, own in landmarks.items():
        check_landmarks(case, own, record)
        draw_landmarks(case, own, folder)
    for head, own in rows.groups("head").items():
        EvidenceChecks(own, record).run()
        outlines = folder / f"outlines-{head}.csv"
        if outlines.exists():
            check_outlines(Table.read(outlines, OUTLINES), record)
        write_file(folder / f"patients-{head}.md", patient_tables(own))
    record.save()
    write_file(folder / "page.md", page(rows, Table.read(folder / "checks.csv", ("study",)), landmarks))
    draw(rows, folder)
    draw_reliability(rows, folder)
    return finish(options)
