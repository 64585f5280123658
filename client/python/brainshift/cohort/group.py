# SPDX-License-Identifier: Apache-2.0
"""Tables, statistics over subjects and report of a cohort, from what `participant` left.

    group_surgeries.tsv    a row per surgery and run
    group_subjects.tsv     a row per subject and kind of surgery: means over its surgeries
    group_statistics.tsv   over subjects, each counted once: median with its 95 % interval, quartiles ...
    group_leftout.tsv      subjects without a result, with the reason
    group_timing.tsv       how long it took: the only table that differs between machines
    group_report.html

Each has its data dictionary beside it (.json). The same results give the same bytes.
"""
from __future__ import annotations

import html
from typing import Any, Iterable

from . import measures
from .files import Path, Refused, Row, cell, drop_temporaries, locked, read_json, write, write_table
from .statistics import median, median_interval

Group = tuple[str, str, str]  # surgery, method, boundary
GROUP = {key: measures.KEYS[key] for key in ("surgery", "method", "boundary")}
LEFT_OUT: dict[str, dict[str, object]] = {"participant_id": measures.KEYS["participant_id"],
                                          "session_id": measures.KEYS["session_id"],
                                          "reason": {"Description": "why the subject cannot run"}}
STATISTICS: dict[str, dict[str, object]] = {
    **GROUP, "measure": {"Description": "column of group_subjects.tsv"},
    "subjects": {"Description": "subjects that have it"},
    "median": {"Description": "over subjects"},
    "median_low": {"Description": "lower end of the 95 % interval of the median (order statistics); n/a below 6 subjects"},
    "median_high": {"Description": "its upper end"},
    "mean": {"Description": "over subjects"},
    "sd": {"Description": "standard deviation over subjects (n - 1)"},
    "min": {"Description": "smallest"}, "max": {"Description": "largest"}}


def results(output: Path) -> list[dict[str, Any]]:
    """Every result, sorted; refused when builds are mixed or there is none."""
    files = sorted(output.glob("sub-*/*_result.json")) + sorted(output.glob("sub-*/ses-*/*_result.json"))
    found = [read_json(file) for file in files]
    if not found:
        raise Refused(f"{output} has no result of a subject (*_result.json): run participant first")
    made_by = sorted({str(result["Programs"]) for result in found})
    if len(made_by) > 1:
        raise Refused(f"{output} mixes results of {len(made_by)} builds: {', '.join(made_by)}")
    return found


def rows_of(found: Iterable[dict[str, Any]], some: tuple[measures.Measure, ...]) -> list[dict[str, object]]:
    return sorted((row for result in found for row in measures.rows(result, some)), key=measures.order)


def kind(row: Row) -> Group:
    return str(row["surgery"]), str(row["method"]), str(row["boundary"])


def per_subject(rows: Iterable[Row]) -> list[dict[str, object]]:
    """Means over the surgeries of one kind of each subject, sessions included: a subject counts once."""
    grouped: dict[tuple[str, Group], list[Row]] = {}
    for row in rows:
        grouped.setdefault((str(row["participant_id"]), kind(row)), []).append(row)
    made = []
    for (subject, (surgery, method, boundary)), own in sorted(grouped.items()):
        line: dict[str, object] = {"participant_id": subject, "surgery": surgery, "method": method, "boundary": boundary,
                                   "surgeries": len(own)}
        for measure in measures.MEASURES:
            values = [v for v in (row[measure.column] for row in own) if isinstance(v, float)]
            line[measure.column] = sum(values) / len(values) if values else None
        made.append(line)
    return made


def statistics(subjects: Iterable[Row]) -> list[dict[str, object]]:
    grouped: dict[Group, list[Row]] = {}
    for row in subjects:
        grouped.setdefault(kind(row), []).append(row)
    made = []
    for (surgery, method, boundary), own in sorted(grouped.items()):
        for measure in measures.MEASURES:
            values = [v for v in (row[measure.column] for row in own) if isinstance(v, float)]
            n, mean = len(values), sum(values) / max(1, len(values))
            interval = median_interval(values)
            low, high = interval if interval else (None, None)
            made.append({"surgery": surgery, "method": method, "boundary": boundary, "measure": measure.column, "subjects": n,
                         "median": median(values), "median_low": low, "median_high": high, "mean": mean if n else None,
                         "sd": (sum((v - mean) ** 2 for v in values) / (n - 1)) ** 0.5 if n > 1 else None,
                         "min": min(values, default=None), "max": max(values, default=None)})
    return made


def left_out(output: Path) -> list[dict[str, object]]:
    files = sorted(output.glob("sub-*/*_leftout.json")) + sorted(output.glob("sub-*/ses-*/*_leftout.json"))
    return [{"participant_id": r["ParticipantId"], "session_id": r["SessionId"], "reason": r["Reason"]}
            for r in map(read_json, files)]


def run(output: Path) -> str:
    """Writes everything; one line of what there is."""
    if not output.is_dir():
        raise Refused(f"{output} is no folder")
    with locked(output / ".work" / "group.lock"):
        drop_temporaries(output, "group_")
        found = results(output)
        rows = rows_of(found, measures.MEASURES + measures.COUNTS)
        subjects = per_subject(rows)
        table, missing = statistics(subjects), left_out(output)
        columns: dict[str, dict[str, object]] = {
            "participant_id": measures.KEYS["participant_id"], **GROUP,
            "surgeries": {"Description": "runs that the row is the mean of"}, **measures.dictionary(measures.MEASURES)}
        write_table(output / "group_surgeries.tsv", measures.SURGERIES, rows)
        write_table(output / "group_subjects.tsv", columns, subjects)
        write_table(output / "group_statistics.tsv", STATISTICS, table)
        write_table(output / "group_leftout.tsv", LEFT_OUT, missing)
        write_table(output / "group_timing.tsv", {**measures.KEYS, **measures.dictionary(measures.TIMES)},
                    rows_of(found, measures.TIMES))
        write(output / "group_report.html", page(found, subjects, table, missing, output))
    count = len({row["participant_id"] for row in rows})
    return f"{len(rows)} surgeries of {count} subjects, {len(missing)} left out: {output / 'group_report.html'}"


def html_table(columns: Iterable[str], rows: Iterable[Row]) -> str:
    names = list(columns)
    head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(short(row.get(name)))}</td>" for name in names) + "</tr>\n" for row in rows)
    return f"<table><tr>{head}</tr>\n{body}</table>\n"


def short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else cell(value)


def strips(subjects: list[dict[str, object]]) -> str:
    """Shift of the tumour and error left, a dot per subject, a row per kind of surgery."""
    kinds = sorted({kind(row) for row in subjects})
    pairs = {k: [(row["tumour_shift_mm"], row["tumour_error_mm"]) for row in subjects if kind(row) == k] for k in kinds}
    largest = max((v for values in pairs.values() for pair in values for v in pair if isinstance(v, float)), default=0.0)
    if largest <= 0.0:
        return ""
    parts = [f'<svg width="760" height="{40 * len(kinds) + 30}" font-family="sans-serif" font-size="12">']
    for i, k in enumerate(kinds):
        parts.append(f'<text x="0" y="{40 * i + 24}">{html.escape(" ".join(k))}</text>')
        for values in pairs[k]:
            for v, colour, y in zip(values, ("#b04a3a", "#2a6f97"), (40 * i + 14, 40 * i + 26)):
                if isinstance(v, float):
                    parts.append(f'<circle cx="{260 + 480 * v / largest:.1f}" cy="{y}" r="4" fill="{colour}" fill-opacity="0.6"/>')
    parts.append(f'<text x="260" y="{40 * len(kinds) + 20}">0</text><text x="740" y="{40 * len(kinds) + 20}" '
                 f'text-anchor="end">{largest:.3g} mm</text></svg>')
    return "".join(parts) + "<p>Red: how far the tumour moved. Blue: error left. A dot is a subject.</p>\n"


def page(found: list[dict[str, Any]], subjects: list[dict[str, object]], table: list[dict[str, object]],
         missing: list[dict[str, object]], output: Path) -> str:
    links = sorted(file.relative_to(output).as_posix() for file in output.rglob("sub-*_report.html"))
    shown = ("participant_id", "surgery", "method", "boundary", "surgeries", "tumour_shift_mm", "tumour_error_mm",
             "tumour_recovered_pct", "craniotomy_error_mm", "coverage_90", "unusable_updates")
    return ('<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>brainshift: cohort</title><style>'
            "body{font-family:sans-serif;margin:2em;max-width:70em}table{border-collapse:collapse}"
            "td,th{border-bottom:1px solid #ccc;padding:2px 8px;text-align:left}</style></head><body>\n"
            "<h1>brainshift: cohort</h1><p><b>Research software; no medical device.</b> Statistics are over subjects, each "
            f"counted once. Programs: {html.escape(str(found[0]['Programs']))}.</p>\n<h2>Tumour</h2>{strips(subjects)}"
            f"<h2>Statistics over subjects</h2>{html_table(STATISTICS, table)}"
            f"<h2>Subjects</h2>{html_table(shown, subjects)}"
            f"<h2>Left out</h2>{html_table(LEFT_OUT, missing) if missing else '<p>Nobody.</p>'}"
            "<h2>Reports</h2><ul>" + "".join(f'<li><a href="{html.escape(link)}">{html.escape(link)}</a></li>' for link in links)
            + "</ul></body></html>\n")
