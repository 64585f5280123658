# SPDX-License-Identifier: GPL-3.0-or-later
"""Percentiles, a paired t test, means over patients and a Pareto front."""
import math
from dataclasses import dataclass

import numpy as np


def percentile(values, q):
    """Linear between the two values next to the rank; NaN without values."""
    values = np.sort(np.asarray(values, dtype=float))
    if not len(values):
        return math.nan
    rank = q / 100.0 * (len(values) - 1)
    below = math.floor(rank)
    above = min(below + 1, len(values) - 1)
    return float(values[below] + (rank - below) * (values[above] - values[below]))


def mean_std(values):
    """Mean and standard deviation of a sample (n - 1); zeros without values."""
    values = np.asarray(values, dtype=float)
    if not len(values):
        return 0.0, 0.0
    return float(values.mean()), float(values.std(ddof=1)) if len(values) > 1 else 0.0


def correlation(a, b):
    """Pearson's, of two samples of one size; NaN where one of them does not vary."""
    (mean_a, std_a), (mean_b, std_b) = mean_std(a), mean_std(b)
    if len(a) < 2 or std_a == 0.0 or std_b == 0.0:
        return math.nan
    return float(np.sum((np.asarray(a) - mean_a) * (np.asarray(b) - mean_b)) / ((len(a) - 1) * std_a * std_b))


def incomplete_beta(a, b, x):
    """The regularised I_x(a, b), by its continued fraction (Abramowitz and Stegun 26.5.8)."""
    if x <= 0.0 or x >= 1.0:
        return 0.0 if x <= 0.0 else 1.0
    if x >= (a + 1.0) / (a + b + 2.0):  # the fraction converges fast below
        return 1.0 - _by_fraction(b, a, 1.0 - x)
    return _by_fraction(a, b, x)


def _by_fraction(a, b, x):
    tiny = 1e-300
    kept = lambda value: tiny if abs(value) < tiny else value
    c, d = 1.0, 1.0 / kept(1.0 - (a + b) * x / (a + 1.0))
    value = d
    for m in range(1, 501):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for term in (even, odd):
            d = 1.0 / kept(1.0 + term * d)
            c = kept(1.0 + term / c)
            value *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    log_front = (math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x)
                 + b * math.log1p(-x))
    return math.exp(log_front) * value / a


@dataclass
class PairedTest:
    pairs: int = 0
    mean: float = 0.0  # of the differences
    t: float = 0.0
    p: float = 1.0  # two-sided; 1 where nothing can be said


def paired_t_test(a, b):
    """Student's test of a - b = 0. A pair with a missing value is left out.

    It assumes independent pairs whose differences are normal."""
    differences = np.asarray(a, dtype=float) - np.asarray(b, dtype=float)
    differences = differences[np.isfinite(differences)]
    mean, std = mean_std(differences)
    test = PairedTest(pairs=len(differences), mean=mean)
    if test.pairs < 2 or mean == 0.0:
        return test
    if std == 0.0:
        return PairedTest(test.pairs, mean, math.copysign(math.inf, mean), 0.0)
    test.t = mean / (std / math.sqrt(test.pairs))
    freedom = test.pairs - 1
    test.p = incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + test.t ** 2))
    return test


def t_quantile(freedom):
    """The 0.975 quantile of Student's t: half the width of a 95 % interval, in standard errors."""
    low, high = 0.0, 1e4
    for _ in range(200):
        middle = 0.5 * (low + high)
        beyond = incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + middle ** 2))  # two-sided
        low, high = (middle, high) if beyond > 0.05 else (low, middle)
    return high


@dataclass
class Interval:
    """A mean over independent patients, with its 95 % interval; NaN without a number, an interval without end
    over one patient."""
    mean: float = math.nan
    low: float = -math.inf
    high: float = math.inf
    count: int = 0  # patients

    def __str__(self):
        if self.count < 2:
            return f"{self.mean:.3g} of {self.count} patient{'' if self.count == 1 else 's'}"
        return f"{self.mean:.3g}; {self.low:.3g} to {self.high:.3g} over {self.count} patients"


def over_patients(values):
    """values: one a patient. Values that are not finite are left out."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    if not len(values):
        return Interval()
    mean, std = mean_std(values)
    half = t_quantile(len(values) - 1) * std / math.sqrt(len(values)) if len(values) > 1 else math.inf
    return Interval(mean, mean - half, mean + half, len(values))


def ratio_over_patients(ratios):
    """The same of ratios: their geometric mean, by logarithms. A ratio that is not positive is left out."""
    logs = over_patients([math.log(one) for one in ratios if one > 0.0])
    return Interval(*map(_exp, (logs.mean, logs.low, logs.high)), logs.count)


def _exp(x):
    return math.inf if x > 700 else math.exp(x)


def pareto_front(points):
    """Indices of the (cost, error) that no other one beats in both, by ascending cost.

    None has both values at most as large and one smaller. Of equal points the first; points that
    are not finite are left out."""
    finite = [i for i, point in enumerate(points) if all(map(math.isfinite, point))]
    front = []
    for i in sorted(finite, key=lambda i: tuple(points[i])):
        if not front or points[i][1] < points[front[-1]][1]:
            front.append(i)
    return front


def over(a, b):
    """a / b; NaN where there is no quotient."""
    return a / b if b else math.nan
