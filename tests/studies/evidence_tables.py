# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figures, and the tables of docs/evidence.md and docs/evidence/patients-HEAD.md in Markdown.

Means are over the patients' means, so that every patient counts alike.
"""
import math

from .stats import paired_t_test

# Ji, Roberts, Hartov, Paulsen (2009), of patients 1 to 5. NaN: the paper has none.
NONE = math.nan
PAPER = {
    # Table 3: initial misfit at the tumour, mm; what of it was recovered, %; what was left (epsilon_cross)
    "misfit_mm": (4.8, 5.9, 6.1, 4.0, 3.6),
    "contact_recovered": (92, 72, 75, 88, 96), "fixed_recovered": (85, 72, 75, 85, 96),
    "contact_error_mm": (0.4, 1.7, 1.5, 0.5, 0.13), "fixed_error_mm": (0.72, 1.7, 1.5, 0.6, 0.12),
    # Table 4: closest point distance at the craniotomy, mm: before, and after an update from the tumour
    # alone. Patient 5: before alone, from the footnote.
    "initial_cppd_mm": (4.7, 5.0, 0.74, 2.1, 0.57),
    "contact_cppd_mm": (1.1, 1.1, 1.2, 1.9, NONE), "fixed_cppd_mm": (7.8, 2.3, 1.1, 2.3, NONE),
    # Table 5: iterations to approximate convergence, and their time, s
    "contact_iterations": (19, 13, 10, 17, 12), "fixed_iterations": (23, 19, 75, 36, 16),
    "contact_time_s": (265, 142, 289, 215, 250), "fixed_time_s": (252, 73, 255, 107, 91),
    # Table 6: angle between gravity and the estimate's principal direction, degrees
    "direction_deg": (10, 140, 105, 93, 141), "fixed_direction_deg": (6, 164, 117, 88, 168),
}
# Means as the text gives them (abstract, section 5).
MEAN_CONTACT_RECOVERED, MEAN_CONTACT_CPPD_MM, MEAN_FIXED_CPPD_MM = 85, 1.6, 3.4



# Maps that predict a landmark: name, column
MAPS = (("no correction", "none_mm"), ("rigid", "rigid_mm"), ("affine", "affine_mm"),
        ("thin-plate spline", "thin_plate_mm"), ("estimate", "estimate_mm"))


def mean_of(numbers):
    """Of those that are finite; NaN without one."""
    numbers = [one for one in numbers if math.isfinite(one)]
    return sum(numbers) / len(numbers) if numbers else math.nan


def patient_mean(rows, column):
    """The mean over patients of each patient's mean; NaN without a number."""
    return mean_of(own.mean(column) for own in rows.groups("patient").values())


def rms(numbers):
    return math.sqrt(sum(one * one for one in numbers) / len(numbers))


def cell(value, digits):
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def claims_table(checks, study):
    """What is asked against what was measured: a line per kind of check and bound, over the truths that
    it was held against. A check is called "SUBJECT: KIND"; its bound ends where a bracket begins."""
    claims = {}
    for one in checks.where(study=study):
        if one["pass"]:
            subject, colon, kind = one["name"].partition(": ")
            key = kind if colon else subject, one["bound"].split(" (")[0]
            claims.setdefault(key, []).append((one.number("value"), subject if colon else "", one["pass"] == "1"))

    def named(claim):
        return f"{claim[0]:.3g}" + (f" (`{claim[1]}`)" if claim[1] else "")

    text = "| figure | bound | measured | |\n|---|---|---|---|\n"
    for (kind, bound), found in claims.items():
        ordered = sorted(found, key=lambda claim: claim[0])
        measured = named(ordered[0]) + (f" to {named(ordered[-1])}" if len(found) > 1 else "")
        missed = [claim for claim in found if not claim[2]]
        verdict = (f"**missed** in {len(missed)} of {len(found)}: {', '.join(map(named, missed))}" if missed
                   else "holds")
        text += f"| {kind} | {bound} | {measured} | {verdict} |\n"
    return text


def truths_table(rows):
    """A line per truth, of one head."""
    text = ("| truth | tumour recovered, tumour alone: contact, fixed | with cortex: contact | error mm: "
            "estimate, rigid shift | CPPD mm, tumour alone: before, contact, fixed | with cortex | "
            "coverage: tumour alone, with cortex | *unusable*, contact |\n|---|---|---|---|---|---|---|---|\n")
    for truth in rows.values("truth"):
        contact = rows.where(truth=truth, boundary="contact")
        alone, joint = contact.where(data="tumour"), contact.where(data="tumour+cortex")
        fixed = rows.where(truth=truth, boundary="fixed", data="tumour")

        def of(some, name, digits=2):
            return cell(patient_mean(some, name), digits)

        text += (f"| `{truth}` | {of(alone, 'recovered_pct', 1)}, {of(fixed, 'recovered_pct', 1)} % | "
                 f"{of(joint, 'recovered_pct', 1)} % | {of(alone, 'tumour_mm')}, {of(alone, 'shift_tumour_mm')} | "
                 f"{of(alone, 'initial_cppd_mm')}, {of(alone, 'cppd_mm')}, {of(fixed, 'cppd_mm')} | "
                 f"{of(joint, 'cppd_mm')} | {of(alone, 'coverage_90')}, {of(joint, 'coverage_90')} | "
                 f"{len(contact.where(quality='unusable'))} of {len(contact)} |\n")
    return text


def landmarks_table(landmarks):
    """A line per case and pose of the head: rms distances, and the share of components inside the estimate's 90 %
    interval. landmarks: {case: its rows}."""
    text = (f"| case, pose of the head | {', '.join(name for name, _ in MAPS[:-1])} mm | **estimate** mm "
            "| over rigid; p | coverage | its motion mm |\n|---|---|---|---|---|---|\n")
    for case, rows in landmarks.items():
        for pose, own in rows.groups("pose").items():
            estimate, rigid = own.numbers("estimate_mm"), own.numbers("rigid_mm")
            text += (f"| `{case}`, {pose} | {', '.join(f'{rms(own.numbers(column)):.3f}' for _, column in MAPS[:-1])} "
                     f"| {rms(estimate):.3f} | {rms(estimate) / rms(rigid):.3f}; "
                     f"{paired_t_test(estimate ** 2, rigid ** 2).p:.2g} | {own.mean('inside_90') / 3:.2f} "
                     f"| {own.mean('estimated_motion_mm'):.2f} |\n")
    return text


# Name of the line, of the paper's figures, boundary, column, digits, factor
PATIENT_LINES = (
    ("Table 3: initial misfit, mm", "misfit_mm", "contact", "initial_mm", 1, 1),
    ("error at the tumour with contact, mm", "contact_error_mm", "contact", "tumour_mm", 2, 1),
    ("the same, fixed", "fixed_error_mm", "fixed", "tumour_mm", 2, 1),
    ("recovered with contact, %", "contact_recovered", "contact", "recovered_pct", 0, 1),
    ("the same, fixed", "fixed_recovered", "fixed", "recovered_pct", 0, 1),
    None,  # contact against fixed
    ("Table 4: CPPD before, mm", "initial_cppd_mm", "contact", "initial_cppd_mm", 1, 1),
    ("CPPD with contact, mm", "contact_cppd_mm", "contact", "cppd_mm", 2, 1),
    ("the same, fixed", "fixed_cppd_mm", "fixed", "cppd_mm", 2, 1),
    ("Table 5: iterations with contact", "contact_iterations", "contact", "contact_sets", 0, 1),
    ("the same, fixed", "fixed_iterations", "fixed", "contact_sets", 0, 1),
    ("time with contact, s", "contact_time_s", "contact", "update_ms", 2, 1e-3),
    ("the same, fixed", "fixed_time_s", "fixed", "update_ms", 2, 1e-3),
    ("Table 6: principal direction to gravity with contact, degrees", "direction_deg", "contact", "direction_deg",
     0, 1),
    ("the same, fixed", "fixed_direction_deg", "fixed", "direction_deg", 0, 1))


def patient_tables(rows):
    """The paper's Tables 3 to 6 beside the same of the twins of one head, patients as columns, the mean
    last. Twins: the consistency truth, updates from the tumour alone, mean over the seeds."""
    patients = [str(1 + i) for i in range(len(PAPER["misfit_mm"]))]

    def line(name, numbers, digits):
        cells = [cell(one, digits) for one in (*numbers, mean_of(numbers))]
        return f"| {name} | {' | '.join(cells)} |\n"

    def here(boundary, name, factor=1):
        own = rows.where(truth="consistency", boundary=boundary, data="tumour")
        return [factor * own.where(patient=patient).mean(name) for patient in patients]

    text = f"| | {' | '.join(patients)} | mean |\n|---|---|---|---|---|---|---|\n"
    for one in PATIENT_LINES:
        if one is None:
            text += _contact_against_fixed(rows, patients)
            continue
        name, theirs, boundary, own, digits, factor = one
        text += line(f"{name}: paper", PAPER[theirs], digits) + line("*here*", here(boundary, own, factor), digits)
    return text + line("the same, truth", here("contact", "true_direction_deg"), 0)


def _contact_against_fixed(rows, patients):
    """The paired t test of section 3.2.1, over the truths of a patient: the mean over the seeds of each."""
    text = ("| p that contact and fixed differ at the tumour: paper | < 0.01 | > 0.05 | > 0.05 | < 0.01 | > 0.05 | |\n"
            "| *here, all truths* |")
    for patient in patients:
        own = rows.where(patient=patient, data="tumour")
        contact, fixed = ({truth: some.mean("tumour_mm") for truth, some in own.where(boundary=one).groups("truth").items()}
                          for one in ("contact", "fixed"))
        both = [truth for truth in contact if truth in fixed]
        test = paired_t_test([contact[one] for one in both], [fixed[one] for one in both])
        text += (f" {test.p:.2g}; {'contact' if test.mean < 0 else 'fixed'} better by {abs(test.mean):.2f} mm |"
                 if test.pairs > 1 else " – |")
    return text + " |\n"
