# SPDX-License-Identifier: Apache-2.0
"""Medians with intervals, and Wilcoxon's signed rank test. One value per subject; no normal law is assumed."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

EXACT_UP_TO = 60  # pairs; the exact law of more is the normal one to three digits


def median(values: Sequence[float]) -> float:
    ordered = sorted(values)
    half = len(ordered) // 2
    if not ordered:
        return math.nan
    return ordered[half] if len(ordered) % 2 else 0.5 * (ordered[half - 1] + ordered[half])


def median_interval(values: Sequence[float], level: float = 0.95) -> tuple[float, float] | None:
    """The narrowest pair of order statistics, alike from both ends, that holds the median with this
    probability at least (binomial law). None below 6 values: no pair reaches 95 %."""
    ordered, n = sorted(values), len(values)
    below, best = 0.0, None
    for k in range(n // 2):
        below += math.comb(n, k) / 2.0 ** n
        if 1.0 - 2.0 * below < level:
            break
        best = (ordered[k], ordered[n - 1 - k])
    return best


@dataclass(frozen=True)
class SignedRank:
    pairs: int        # with a difference other than zero
    plus: float       # sum of the ranks of differences above zero
    minus: float
    p: float          # two-sided; 1 without pairs
    exact: bool

    @property
    def effect(self) -> float:
        """Matched-pairs rank-biserial correlation: -1 all below zero, 1 all above."""
        total = self.plus + self.minus
        return (self.plus - self.minus) / total if total else 0.0


def _ranks(sizes: Sequence[float]) -> list[int]:
    """Twice the mid-ranks of the values: whole numbers."""
    order = sorted(range(len(sizes)), key=lambda i: sizes[i])
    doubled = [0] * len(sizes)
    start = 0
    while start < len(order):
        end = start
        while end < len(order) and sizes[order[end]] == sizes[order[start]]:
            end += 1
        for i in order[start:end]:
            doubled[i] = start + 1 + end
        start = end
    return doubled


def signed_rank(differences: Sequence[float]) -> SignedRank:
    """Wilcoxon's test that differences lie symmetrically about zero.

    Differences of zero are left out (Wilcoxon 1945). Up to 60 pairs the law is exact, ties
    included: the number of sign patterns for each sum of mid-ranks. Beyond, the normal law with
    correction for ties and continuity. Values that are not finite are a ValueError.
    """
    if not all(math.isfinite(d) for d in differences):
        raise ValueError("differences: not finite")
    kept = [d for d in differences if d != 0.0]
    ranks = _ranks([abs(d) for d in kept])
    total, plus = sum(ranks), sum(rank for rank, d in zip(ranks, kept) if d > 0.0)
    low = min(plus, total - plus)
    exact = len(kept) <= EXACT_UP_TO
    if not kept:
        p = 1.0
    elif exact:
        patterns = [1] + [0] * total
        for rank in ranks:
            for s in range(total, rank - 1, -1):
                patterns[s] += patterns[s - rank]
        p = min(1.0, 2 * sum(patterns[:low + 1]) / 2 ** len(kept))
    else:
        # Doubled ranks: sum of squares over 4 is the variance of the doubled sum.
        deviation = math.sqrt(sum(rank * rank for rank in ranks)) / 2.0
        p = min(1.0, math.erfc(max(0.0, total / 2.0 - low - 1.0) / deviation / math.sqrt(2.0)))
    return SignedRank(len(kept), plus / 2.0, (total - plus) / 2.0, p, exact)


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's adjusted p values: the chance of one false alarm among all of them stays below p."""
    order = sorted(range(len(p_values)), key=lambda i: p_values[i])
    adjusted, largest = [0.0] * len(p_values), 0.0
    for position, i in enumerate(order):
        largest = max(largest, min(1.0, (len(p_values) - position) * p_values[i]))
        adjusted[i] = largest
    return adjusted
