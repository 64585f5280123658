# SPDX-License-Identifier: GPL-3.0-or-later
"""advice: what `brainshift advise` predicts, held against measurements that are made.

    rows*.csv   advice_study: a row per surgery (place, seed) and candidate; before_sd_mm, predicted_sd_mm and
                made_sd_mm at the target; *_ratio: the misfit ratios in them; *_error_mm against the truth

Best by brute force: the least made_sd_mm of the surgery. Writes pictures and checks, and ends with the
summary of all records.
"""
import numpy as np

from . import chart
from .checks import Record
from .common import InputError, study_parser
from .rows import Table
from .stats import correlation, percentile
from .summary import finish

STUDY = "advice"
COLUMNS = ("place", "seed", "scenario", "state", "candidate", "kind", "before_sd_mm", "predicted_sd_mm", "made_sd_mm",
           "before_ratio", "made_ratio", "before_error_mm", "made_error_mm", "refused")
WITHIN, LEAST_CANDIDATES = 0.25, 10


class Surgery:
    """Candidates that were ranked and made, best advice first."""

    def __init__(self, rows):
        self.state = rows[0]["state"]
        number = lambda column: np.array([row.number(column) for row in rows])
        usable = np.isfinite(number("predicted_sd_mm")) & np.isfinite(number("made_sd_mm"))
        order = np.argsort(number("predicted_sd_mm")[usable], kind="stable")
        of = lambda column: number(column)[usable][order]
        self.names = [row["candidate"] for row, used in zip(rows, usable) if used]
        self.names = [self.names[i] for i in order]
        self.before, self.predicted, self.made = of("before_sd_mm"), of("predicted_sd_mm"), of("made_sd_mm")
        # The misfit ratio that the estimate had before: nobody can predict that of noise to come.
        self.made_same_ratio = self.made / of("made_ratio") * of("before_ratio")
        self.error_before, self.error_made = of("before_error_mm"), of("made_error_mm")
        self.candidates = len(self.names)

    def place_of_best(self):
        """Of the best by brute force in the advice, from 1."""
        return int(np.argmin(self.made)) + 1

    def lost_mm(self):
        """By following the advice and not the best."""
        return float(self.made[0] - self.made.min())

    def reductions(self, made=None):
        return self.before - self.predicted, self.before - (self.made if made is None else made)


def share(values):
    values = np.asarray(values, dtype=bool)
    return 100.0 * float(values.mean()) if len(values) else np.nan


def within(predicted, made):
    return np.abs(predicted - made) <= WITHIN * np.abs(made)


def record_checks(surgeries, left_out, record):
    first = np.array([[*(one[0] for one in s.reductions()), s.reductions(s.made_same_ratio)[1][0]] for s in surgeries])
    among = share([s.place_of_best() <= 2 for s in surgeries])
    record.check(STUDY, "surgeries", len(surgeries), ">= 100", len(surgeries) >= 100)
    record.figure(STUDY, "surgeries left out", left_out, f"fewer than {LEAST_CANDIDATES} measurements give a usable field")
    record.check(STUDY, "best by brute force among the first two %", among, ">= 90 % of surgeries", among >= 90.0)
    ratio = float(first[:, 0].sum() / first[:, 1].sum())
    record.check(STUDY, "predicted over made reduction of the first", ratio, "within 25 %", abs(ratio - 1.0) <= WITHIN)
    record.figure(STUDY, "first within 25 % of the made reduction %", share(within(first[:, 0], first[:, 1])), "of surgeries")
    record.figure(STUDY, "the same at the misfit ratio of before %", share(within(first[:, 0], first[:, 2])), "of surgeries")
    record.figure(STUDY, "best by brute force is the first %", share([s.place_of_best() == 1 for s in surgeries]),
                  "of surgeries")
    lost = [s.lost_mm() for s in surgeries]
    record.figure(STUDY, "sd lost by the first against the best p50 mm", percentile(lost, 50), "at the target")
    record.figure(STUDY, "sd lost by the first against the best p95 mm", percentile(lost, 95), "at the target")
    excess = [100.0 * (min(s.made[:2]) / s.made.min() - 1.0) for s in surgeries]
    for percent in (1, 5):
        record.figure(STUDY, f"better of the first two within {percent} % of the best sd %", share([one <= percent for one in excess]),
                      "of surgeries")
    gain = [s.before[0] - s.made.min() for s in surgeries]
    record.figure(STUDY, "share of the best's reduction that the first brings %",
                  100.0 * sum(s.before[0] - s.made[0] for s in surgeries) / sum(gain), "over all surgeries")
    record.figure(STUDY, "correlation of predicted and made reductions", correlation(
        *(np.concatenate([s.reductions()[k] for s in surgeries]) for k in (0, 1))), "all candidates")
    for state in sorted({s.state for s in surgeries}):
        of = [s for s in surgeries if s.state == state]
        record.figure(STUDY, f"after {state}: among the first two %", share([s.place_of_best() <= 2 for s in of]),
                      f"{len(of)} surgeries")
    mean = lambda values: float(np.mean(values))
    for name, value in (("sd before mm", mean([s.before[0] for s in surgeries])),
                        ("sd after the first mm", mean([s.made[0] for s in surgeries])),
                        ("sd after the last mm", mean([s.made[-1] for s in surgeries])),
                        ("error before mm", mean([s.error_before[0] for s in surgeries])),
                        ("error after the first mm", mean([s.error_made[0] for s in surgeries])),
                        ("error after the last mm", mean([s.error_made[-1] for s in surgeries]))):
        record.figure(STUDY, name, value, "mean; per component at the target")


def draw_predicted(surgeries, path):
    fig, ax = chart.figure("Reduction of the sd at the tumour: predicted and made",
                           f"{len(surgeries)} surgeries, every candidate; dashed: 25 %", size=(7.4, 6.0))
    for k, state in enumerate(sorted({s.state for s in surgeries})):
        of = [s.reductions() for s in surgeries if s.state == state]
        predicted, made = (np.concatenate([one[i] for one in of]) for i in (0, 1))
        ax.plot(predicted, made, linestyle="none", markersize=3, alpha=0.6, label="after " + state, **chart.style(k))
    most = max(float(s.reductions()[0].max()) for s in surgeries)
    for slope, dash in ((1.0, "-"), (1.0 / (1.0 - WITHIN), "--"), (1.0 / (1.0 + WITHIN), "--")):
        ax.plot([0, most], [0, slope * most], dash, color=chart.INK, linewidth=1.0)
    chart.label(ax, "predicted reduction (mm)", "made reduction (mm)")
    chart.legend(ax)
    chart.save(fig, path)


def draw_places(surgeries, path):
    fig, ax = chart.figure("Place in the advice of the measurement that turned out best",
                           f"{len(surgeries)} surgeries", size=(7.4, 4.2))
    places = [s.place_of_best() for s in surgeries]
    counts = [100.0 * places.count(place) / len(places) for place in range(1, max(places) + 1)]
    ax.bar(range(1, len(counts) + 1), counts, color=chart.BLUE)
    chart.label(ax, "place in the advice", "surgeries (%)")
    chart.save(fig, path)


def main(arguments):
    parser = study_parser("advice", __doc__.partition("\n")[0].partition(": ")[2], "make advice", "Advice")
    options = parser.parse_args(arguments)
    table = Table.read_all(sorted(options.dir.glob("rows*.csv")), COLUMNS)
    by_surgery = {}
    for row in table:
        by_surgery.setdefault((row["place"], row["seed"]), []).append(row)
    surgeries = [one for one in map(Surgery, by_surgery.values()) if one.candidates >= LEAST_CANDIDATES]
    if not surgeries:
        raise InputError(f"{options.dir}: rows*.csv hold no surgery of {LEAST_CANDIDATES} candidates")
    draw_predicted(surgeries, options.dir / "advice-predicted.png")
    draw_places(surgeries, options.dir / "advice-places.png")
    record = Record(options.dir)
    record_checks(surgeries, len(by_surgery) - len(surgeries), record)
    record.save()
    return finish(options)
