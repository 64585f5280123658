# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over patients and truths, not over updates.

Updates of one surgery share its truth, and surgeries of one patient share mesh, tumour and opening: they are no
independent samples. So the mean of a truth is taken first, over its updates, then that of a patient, over his
truths; intervals are over patients (stats.py).
"""
import math

import numpy as np

from .stats import over, over_patients, ratio_over_patients

PATIENT, TRUTH = ("head", "place"), ("scenario", "seed")


def finite_mean(numbers):
    numbers = [one for one in numbers if math.isfinite(one)]
    return float(np.mean(numbers)) if numbers else math.nan


def of_truths(rows, value, truth=TRUTH):
    """The mean over truths of the mean over their updates. value: of a row; NaN: it has none."""
    return finite_mean(finite_mean(map(value, own)) for own in rows.groups(*truth).values())


def by_patient(rows, of, patient=PATIENT):
    """of(his rows) of every patient."""
    return [of(own) for own in rows.groups(*patient).values()]


def mean(rows, value, patient=PATIENT, truth=TRUTH):
    """An Interval. value: a column, or what a row is worth."""
    value = _value(value)
    return over_patients(by_patient(rows, lambda own: of_truths(own, value, truth), patient))


def ratio(rows, above, below, patient=PATIENT, truth=TRUTH):
    """Of each patient's means; an Interval over patients."""
    above, below = _value(above), _value(below)
    return over_patients(by_patient(rows, lambda own: over(of_truths(own, above, truth), of_truths(own, below, truth)),
                                    patient))


def same_over(ours, theirs, value, patient=PATIENT, truth=TRUTH):
    """Of two tables of the same patients: each patient's mean of ours over that of theirs, and their geometric
    mean; an Interval."""
    means = [{key: of_truths(own, _value(value), truth) for key, own in rows.groups(*patient).items()}
             for rows in (ours, theirs)]
    return ratio_over_patients([over(one, means[1].get(key, math.nan)) for key, one in means[0].items()])


def share(rows, holds, patient=PATIENT, truth=TRUTH):
    return mean(rows, lambda row: 1.0 if holds(row) else 0.0, patient, truth)


def or_zero(column):
    """What a refused update, which has no number, is worth where it covers or recovers nothing."""
    def value(row):
        number = row.number(column)
        return number if math.isfinite(number) else 0.0
    return value


def _value(value):
    return (lambda row: row.number(value)) if isinstance(value, str) else value
