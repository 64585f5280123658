# SPDX-License-Identifier: Apache-2.0
"""Two versions or settings over one cohort, paired.

A pair is a subject: the mean, over the surgeries that both folders have of it (session, scenario and
seed; both with truth), of after - before. For every measure: medians, difference, how many subjects
got better and worse, Wilcoxon's signed rank test, and Holm's p over all rows of the table. `coverage_90`
counts by its distance from 0.9. A measure is *worse* (or *better*) when p is at most 0.05.
"""
from __future__ import annotations

from typing import Any

from . import group, measures
from .files import Path, Refused, Row, cell, write_table
from .statistics import holm, median, median_interval, signed_rank

LEVEL = 0.05
COMPARED = tuple(m for m in measures.MEASURES if m.better)
PAIRS: dict[str, dict[str, object]] = {
    "participant_id": measures.KEYS["participant_id"], "surgery": measures.KEYS["surgery"],
    "measure": {"Description": "what is compared; see group_surgeries.json"},
    "surgeries": {"Description": "surgeries that both have"},
    "before": {"Description": "mean of the first folder"}, "after": {"Description": "mean of the second"},
    "loss": {"Description": "mean change for the worse: above 0, the second is worse"}}
TABLE: dict[str, dict[str, object]] = {
    "surgery": measures.KEYS["surgery"], "measure": PAIRS["measure"], "subjects": {"Description": "pairs"},
    "before": {"Description": "median over subjects, first folder"},
    "after": {"Description": "median over subjects, second folder"},
    "difference": {"Description": "median over subjects of after - before"},
    "low": {"Description": "lower end of its 95 % interval (order statistics); n/a below 6 subjects"},
    "high": {"Description": "its upper end"},
    "better": {"Description": "subjects for which the second is better"},
    "worse": {"Description": "subjects for which it is worse"},
    "effect": {"Description": "matched-pairs rank-biserial correlation: 1, the second is worse for everybody; -1, better"},
    "p": {"Description": "Wilcoxon's signed rank test, two-sided, exact up to 60 pairs"},
    "p_holm": {"Description": "Holm's p over the rows of this table"},
    "verdict": {"Description": f"worse or better where p is at most {LEVEL}; alike where every difference is zero; "
                               "else undecided; few: below 6 subjects no difference can reach that p"}}


def load(folder: Path) -> tuple[list[dict[str, object]], str]:
    found = group.results(folder)
    return group.rows_of(found, measures.MEASURES), str(found[0]["Programs"])


def several(rows: list[dict[str, object]]) -> bool:
    return len({(row["method"], row["boundary"]) for row in rows}) > 1


def keyed(rows: list[dict[str, object]], how: bool) -> dict[tuple[object, ...], Row]:
    """Runs by what must agree: method and boundary too, where one of the folders has several of them."""
    keys = ("participant_id", "session_id", "surgery", "seed") + (("method", "boundary") if how else ())
    return {tuple(row[key] for key in keys): row for row in rows}


def run(before: Path, after: Path, out: Path | None) -> tuple[str, bool]:
    """The text to print, and whether some measure is worse. Writes compare_*.tsv into `out`."""
    for folder in (before, after):
        if not folder.is_dir():
            raise Refused(f"{folder} is no folder")
    (rows_before, made_first), (rows_after, made_second) = load(before), load(after)
    how = several(rows_before) or several(rows_after)
    first, second = keyed(rows_before, how), keyed(rows_after, how)
    both = sorted(set(first) & set(second), key=str)
    if not both:
        raise Refused(f"{before} and {after} share no surgery (same subject, session, scenario, seed)")
    pairs = subject_pairs([(first[key], second[key]) for key in both])
    table = compare(pairs)
    if out:
        write_table(out / "compare_pairs.tsv", PAIRS, pairs)
        write_table(out / "compare_statistics.tsv", TABLE, table)
    lines = [f"before: {before} ({made_first})", f"after:  {after} ({made_second})",
             f"{len(both)} surgeries of {len({key[0] for key in both})} subjects; only before: {len(first) - len(both)}, "
             f"only after: {len(second) - len(both)}", ""]
    shown = ("surgery", "measure", "subjects", "before", "after", "difference", "better", "worse", "p", "verdict")
    texts = [list(shown), *([group.short(row[c]) if c != "measure" else cell(row[c]) for c in shown] for row in table)]
    widths = [max(len(line[i]) for line in texts) for i in range(len(shown))]
    lines += ["  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip() for line in texts]
    return "\n".join(lines), any(row["verdict"] == "worse" for row in table)


def subject_pairs(both: list[tuple[Row, Row]]) -> list[dict[str, object]]:
    made: list[dict[str, object]] = []
    grouped: dict[tuple[str, str], list[tuple[Row, Row]]] = {}
    for pair in both:
        grouped.setdefault((str(pair[0]["surgery"]), str(pair[0]["participant_id"])), []).append(pair)
    for (surgery, subject), own in sorted(grouped.items()):
        for measure in COMPARED:
            values = [(a, b) for a, b in ((x[measure.column], y[measure.column]) for x, y in own)
                      if isinstance(a, float) and isinstance(b, float)]
            if values:
                n = len(values)
                made.append({"participant_id": subject, "surgery": surgery, "measure": measure.column, "surgeries": n,
                             "before": sum(a for a, _ in values) / n, "after": sum(b for _, b in values) / n,
                             "loss": sum(measure.loss(b) - measure.loss(a) for a, b in values) / n})
    return made


def compare(pairs: list[dict[str, object]]) -> list[dict[str, object]]:
    table: list[dict[str, object]] = []
    for surgery in sorted({str(pair["surgery"]) for pair in pairs}):
        for measure in COMPARED:
            own: list[dict[str, Any]] = [p for p in pairs if p["surgery"] == surgery and p["measure"] == measure.column]
            if not own:
                continue
            losses = [float(pair["loss"]) for pair in own]
            changes = [float(pair["after"]) - float(pair["before"]) for pair in own]
            test, interval = signed_rank(losses), median_interval(changes)
            low, high = interval if interval else (None, None)
            if test.pairs == 0:
                verdict = "alike"
            elif len(own) < 6:
                verdict = "few"
            elif test.p > LEVEL:
                verdict = "undecided"
            else:
                verdict = "worse" if test.effect > 0.0 else "better"
            table.append({"surgery": surgery, "measure": measure.column, "subjects": len(own),
                          "before": median([float(p["before"]) for p in own]), "after": median([float(p["after"]) for p in own]),
                          "difference": median(changes), "low": low, "high": high, "better": sum(d < 0.0 for d in losses),
                          "worse": sum(d > 0.0 for d in losses), "effect": test.effect, "p": test.p, "verdict": verdict})
    for row, adjusted in zip(table, holm([float(str(row["p"])) for row in table])):
        row["p_holm"] = adjusted
    return table
