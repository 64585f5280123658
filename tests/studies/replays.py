# SPDX-License-Identifier: GPL-3.0-or-later
"""replays: recorded surgeries through the daemon, timed (docs/replays.md): checks, tables, pictures.

    corpus        every observation is that of the committed table
    all speeds    what was sent is accounted for: fields + superseded + errors. No field came later than
                  3 x the median of its session without the mark (only the first answers of a session cannot
                  be marked: nothing is usual yet). Fields of the same evidence agree within 0.01 mm
    1x            no missed deadline
    per surgery   no stage slower than 1.5 x the committed run, p50 and p95 over t_solve

Rows (rows-CASE.csv) are those of the program `replays`, one per observation sent
(tests/replays/replay_player.hpp). A surgery at one speed is one entry. The first update of every session is
cold and stands apart, as in BENCHMARK.md. Times in units of t_solve are divided row by row.
"""
import math
from collections import namedtuple
from pathlib import Path

import numpy as np

from . import chart
from .checks import Record
from .common import study_parser, write_file
from .rows import Table, csv_text, study_rows
from .stats import mean_std, over, percentile
from .summary import finish

RECORDED, FULL = "1x", "max"
LATE_FACTOR = 3  # of the session's median (AnswerTime::late)
MOST_DIFFERENCE_MM, MOST_RATIO = 0.01, 1.5
# What takes less than 0.05 solves (2 ms) counts as that, since its ratio would be noise.
LEAST_SOLVES = 0.05
# What rounding does to a coordinate is 1e-9 mm (docs/conventions.md); noise is 0.5 mm.
SAME_SUM_MM = 1e-6
# The latency at the client has all others in it.
STAGES = ("register", "invert", "rebuild", "encode", "journal", "latency")
COLUMNS = ("head", "nodes", "kernel", "surgery", "seed", "speed", "pass", "update", "sequence", "source",
           "sent_late_ms", "outcome", *(f"{stage}_ms" for stage in STAGES), "usual_ms", "late", "quality", "deadline",
           "difference_mm", "t_solve_ms")


# updates: without the first of every session
StageTimes = namedtuple("StageTimes", "surgery speed stage updates p50_ms p95_ms p99_ms max_ms p50_solves p95_solves")
# First updates; p95 - p50; standard deviation; largest lateness of the sender, NaN at full speed
Jitter = namedtuple("Jitter", "cold_p50_ms spread_ms sd_ms sent_late_ms")


def is_warm(row):
    return row.number("update") > 1


def stage_times(rows):
    """Every surgery, speed and stage that has an update, in the order of the rows."""
    found = []
    for (surgery, speed), entry in rows.groups("surgery", "speed").items():
        own = entry.where(is_warm)
        for stage in STAGES:
            times = own.finite(f"{stage}_ms")
            solves = own.numbers(f"{stage}_ms") / own.numbers("t_solve_ms")
            if len(times):
                found.append(StageTimes(surgery, speed, stage, len(times),
                                        *(percentile(times, q) for q in (50, 95, 99, 100)),
                                        *(percentile(solves[np.isfinite(solves)], q) for q in (50, 95))))
    return found


def jitter(rows):
    """{(surgery, speed): Jitter}"""
    found = {}
    for key, entry in rows.groups("surgery", "speed").items():
        latency = entry.where(is_warm).finite("latency_ms")
        found[key] = Jitter(percentile(entry.where(update="1").finite("latency_ms"), 50),
                            percentile(latency, 95) - percentile(latency, 50), mean_std(latency)[1],
                            entry.largest("sent_late_ms"))
    return found


def not_comparable(now, committed):
    """Why rows of one surgery and speed cannot be compared with the committed ones; "" when they can."""
    if not len(committed):
        return "no committed rows of it"
    for column in ("head", "nodes"):
        if now[0][column] != committed[0][column]:
            return f"{column} is {now[0][column]}; that of the committed rows {committed[0][column]}"
    sent = lambda rows: set(rows.groups("seed", "sequence", "source"))
    return "" if sent(now) == sent(committed) else "the committed rows are of other observations"


def stage_ratios(now, committed):
    """[(stage, quantile, solves now, solves committed, ratio)] of one surgery at one speed: how much longer a
    stage takes than in the committed run. Empty when the runs cannot be compared."""
    if not_comparable(now, committed):
        return []
    theirs = {one.stage: one for one in stage_times(committed)}
    ratios = []
    for one in stage_times(now):
        for quantile in ("p50", "p95") if one.stage in theirs else ():
            a, b = (getattr(times, f"{quantile}_solves") for times in (one, theirs[one.stage]))
            if max(a, b) >= LEAST_SOLVES:
                ratios.append((one.stage, quantile, a, b, max(a, LEAST_SOLVES) / max(b, LEAST_SOLVES)))
    return ratios


# Checks


def source_of(rows):
    return f"{rows[0]['head']}; {rows[0]['nodes']} nodes; OpenBLAS kernel {rows[0]['kernel']}"


def old_fields(rows):
    """Fields later than LATE_FACTOR medians of their session and not marked: of those that could be marked, and
    of those that came when nothing was usual yet."""
    unmarked = too_few = 0
    for session in rows.where(outcome="field").groups("surgery", "pass").values():
        limit = LATE_FACTOR * percentile(session.finite("latency_ms"), 50)
        old = session.where(lambda row: not row.number("latency_ms") <= limit and row.number("late") != 1)
        could = len(old.where(lambda row: row.number("usual_ms") > 0))
        unmarked, too_few = unmarked + could, too_few + len(old) - could
    return unmarked, too_few


def check_speed(speed, rows, record):
    source = source_of(rows)
    none = lambda name, value, of: record.check(speed, name, value, f"0 of {of}", value == 0, source)
    shown = lambda name, value: record.figure(speed, name, value, "shown", source)
    arrived, superseded = rows.where(outcome="field"), rows.where(outcome="superseded")
    # Nothing arrived for it within the patience of the client, or nothing is known of it.
    lost = rows.where(lambda row: row["outcome"] in ("", "unavailable"))
    refused = len(rows) - len(arrived) - len(superseded) - len(lost)
    none("observations that nothing accounts for", len(lost),
         f"{len(rows)} sent ({len(arrived)} fields; {len(superseded)} superseded; {refused} without a field)")
    unmarked, too_few = old_fields(rows)
    none("fields later than 3 x the median of their session and not marked late", unmarked, len(arrived))
    shown("the same before a session has enough answers to tell", too_few)
    missed = int((arrived.finite("deadline") == 1).sum())
    if speed == RECORDED:
        none("missed deadlines", missed, len(arrived))
    else:
        shown("missed deadlines", missed)
    shown("observations superseded by a newer one", len(superseded))
    shown("fields marked late", int((arrived.finite("late") == 1).sum()))
    for quality in ("good", "caution", "unusable"):
        shown(f"fields of quality {quality}", len(arrived.where(quality=quality)))


def check_agreement(rows, record):
    full = rows.where(speed=FULL)
    differences, across = rows.finite("difference_mm"), len(full.finite("difference_mm"))
    if not len(rows.where(speed=RECORDED)) or not across:
        record.left_out("both speeds", "no field at one speed has the evidence of one at the other")
        return
    record.check("both speeds", "fields of the same evidence: greatest difference of a node mm", differences.max(),
                 f"<= {MOST_DIFFERENCE_MM:g} ({len(differences)} compared; {across} of them at full speed)",
                 differences.max() <= MOST_DIFFERENCE_MM, source_of(rows))


def check_replays(rows, record):
    """Of one head, not empty."""
    for speed, own in rows.groups("speed").items():
        check_speed(speed, own, record)
    check_agreement(rows, record)
    for one in stage_times(rows):
        if one.stage == STAGES[-1]:
            record.figure(f"{one.surgery} {one.speed}", "latency p50 ms", one.p50_ms,
                          f"shown; p95 {one.p95_ms:.1f}; p99 {one.p99_ms:.1f}; largest {one.max_ms:.1f}; "
                          f"{one.p50_solves:.2f} t_solve", source_of(rows))
    for entry, one in jitter(rows).items():
        record.figure(" ".join(entry), "jitter of the latency: p95 - p50 ms", one.spread_ms,
                      f"shown; standard deviation {one.sd_ms:.1f} ms", source_of(rows))


def check_regression(rows, committed, record):
    if not len(committed):
        record.left_out("regression", "no rows of an earlier run are kept for this head")
        return
    for (surgery, speed), now in rows.groups("surgery", "speed").items():
        before = committed.where(surgery=surgery, speed=speed)
        ratios = stage_ratios(now, before)
        if not ratios:
            reason = not_comparable(now, before) or "no stage takes long enough"
            record.left_out(f"{surgery} {speed}", f"regression: {reason}")
            continue
        stage, quantile, ours, theirs, ratio = max(ratios, key=lambda one: one[-1])
        record.check(f"{surgery} {speed}", "slowest stage over the committed run", ratio,
                     f"<= {MOST_RATIO:g} ({stage} {quantile}: {ours:.2f} t_solve now; {theirs:.2f} committed)",
                     ratio <= MOST_RATIO, f"{source_of(now)}; committed with {before[0]['kernel']}")


WHOLE = ("seed", "sequence", "recorded_ns", "acquired_ns", "coordinates", "crc32")


def entries_of(table):
    """{(surgery, sequence): its row} of a corpus (tests/replays/corpus.hpp)."""
    for row in table:
        for column in (*WHOLE, "mean_mm", "ordered_mm"):
            value = row.number(column)
            if not math.isfinite(value) or (column in WHOLE and not (value >= 0 and value == int(value))):
                raise row.error(column, f'"{row[column]}" is no such number')
    return {(row["surgery"], row["sequence"]): row for row in table}


def difference(committed, made):
    """"" when both observations are the same within rounding."""
    is_other = lambda *columns: any(committed[column] != made[column] for column in columns)
    if is_other("source"):
        return f"of {made['source']}, committed of {committed['source']}"
    if is_other("seed"):
        return f"seed {made['seed']}, committed {committed['seed']}"
    if is_other("recorded_ns", "acquired_ns"):
        return (f"recorded at {made['recorded_ns']} ns and acquired at {made['acquired_ns']} ns, "
                f"committed {committed['recorded_ns']} and {committed['acquired_ns']}")
    if is_other("coordinates"):
        return f"{made['coordinates']} coordinates, committed {committed['coordinates']}"
    sums = [[row.number(column) for column in ("mean_mm", "ordered_mm")] for row in (made, committed)]
    if all(abs(a - b) <= SAME_SUM_MM for a, b in zip(*sums)):
        return ""
    return ("mean and ordered mean {:.9g} and {:.9g} mm, committed {:.9g} and {:.9g}").format(*sums[0], *sums[1])


def compare_corpora(committed, made):
    """(how many are the same bit for bit, how many within rounding, what differs)."""
    expected, same_bits, same, differences = entries_of(committed), 0, 0, []
    for key, row in entries_of(made).items():
        other = expected.pop(key, None)
        how = difference(other, row) if other else "is not in the committed table"
        if how:
            differences.append(f"{key[0]}, observation {key[1]}: {how}")
        elif row["crc32"] == other["crc32"]:
            same_bits += 1
        else:
            same += 1
    differences += [f"{surgery}, observation {sequence}: is missing" for surgery, sequence in expected]
    return same_bits, same, differences


def check_corpus(committed, made, record):
    """committed: of the case, or None."""
    if committed is None:
        record.left_out("corpus", "no table of its observations is kept for this case")
        return
    same_bits, same, differences = compare_corpora(committed, made)
    first = f"; first: {differences[0].replace(',', ';')}" if differences else ""
    record.check("corpus", "observations that are not those of the committed table", len(differences),
                 f"0 of {len(committed)} ({same_bits} bit for bit; {same} within rounding){first}",
                 not differences, "tests/replays/corpus-CASE.csv")


# Tables and pictures


def ms(value):
    return f"{value:.{2 if value < 1 else 1}f}"


def percentiles(rows):
    """percentiles.csv: a row per StageTimes."""
    return csv_text(StageTimes._fields, [[*one[:3], str(one.updates), *one[4:]] for one in stage_times(rows)])


def latency_tables(rows):
    """The tables of docs/replays.md."""
    spreads = jitter(rows)
    latency = ("| surgery | speed | updates | p50 ms | p95 | p99 | largest | p50 / t_solve | first update p50 "
               "ms | p95 - p50 ms | standard deviation ms | sent late at most ms |\n" + "|---" * 12 + "|\n")
    stages = f"| surgery | speed | {' | '.join(STAGES)} |\n" + "|---" * (2 + len(STAGES)) + "|"
    entry = None
    for one in stage_times(rows):
        if (one.surgery, one.speed) != entry:
            entry = one.surgery, one.speed
            stages += f"\n| `{one.surgery}` | {one.speed} |"
        stages += f" {ms(one.p50_ms)}, {ms(one.p95_ms)}, {ms(one.p99_ms)} |"
        if one.stage == STAGES[-1]:
            spread = spreads[entry]
            late = ms(spread.sent_late_ms) if math.isfinite(spread.sent_late_ms) else "–"
            latency += (f"| `{one.surgery}` | {one.speed} | {one.updates} | {ms(one.p50_ms)} | {ms(one.p95_ms)} | "
                        f"{ms(one.p99_ms)} | {ms(one.max_ms)} | {one.p50_solves:.2f} | {ms(spread.cold_p50_ms)} | "
                        f"{ms(spread.spread_ms)} | {ms(spread.sd_ms)} | {late} |\n")
    solve = percentile(rows.finite("t_solve_ms"), 50)
    return (f"{rows[0]['nodes']} nodes, t_solve {solve:.1f} ms, OpenBLAS kernel {rows[0]['kernel']}.\n\n{latency}\n"
            f"Stages, ms: p50, p95, p99.\n\n{stages}\n")


def panels(rows, title, subtitle):
    """A figure with a panel per speed, and [(speed, its rows, its axes)]."""
    speeds = rows.groups("speed")
    fig, axes = chart.figure(title, rows=len(speeds), size=(9.6, 1 + 3.2 * len(speeds)))
    titles = {RECORDED: "at the recorded times (1x)", FULL: "at full speed"}
    found = list(zip(speeds, speeds.values(), np.ravel(axes)))
    for speed, _, ax in found:
        ax.set_title(f"{titles.get(speed, speed)}: {subtitle}", loc="left", fontsize=10, fontweight="normal")
    return fig, found


def draw_latency(rows, folder):
    fig, found = panels(rows, "Latency of updates",
                        "from sending an observation to its field at the client, loopback, journal on")
    for _, own, ax in found:
        ax.sharex(found[0][2])
        for k, (surgery, entry) in enumerate(own.where(is_warm).groups("surgery").items()):
            ratios = np.sort([over(row.number("latency_ms"), row.number("t_solve_ms")) for row in entry])
            ratios = ratios[ratios > 0]
            ax.step(ratios, 1 - (np.arange(len(ratios)) + 0.5) / max(len(ratios), 1), color=chart.COLOURS[k % 6],
                    linestyle=("-", "--", ":")[k % 3], label=f"{surgery} ({len(ratios)})")
        chart.label(ax, "latency / t_solve", "share that takes longer", log_x=True, log_y=True)
        chart.legend(ax)
    chart.save(fig, folder / "replays-latency.png")


def draw_stages(rows, folder):
    fig, found = panels(rows, "Stages of updates", "p50 (lower mark) to p95 (upper mark)")
    for _, own, ax in found:
        surgeries = own.values("surgery")
        for one in stage_times(own):
            k = surgeries.index(one.surgery)
            x = STAGES.index(one.stage) + 0.7 * ((k + 0.5) / len(surgeries) - 0.5)
            ax.plot((x, x), (one.p50_solves, one.p95_solves), markersize=5, **chart.style(k),
                    label=one.surgery if one.stage == STAGES[0] else "")
        ax.set_xticks(range(len(STAGES)), STAGES)
        ax.grid(axis="x", visible=False)
        chart.label(ax, "", "time / t_solve", log_y=True)
        chart.legend(ax)
    chart.save(fig, folder / "replays-stages.png")


def main(arguments):
    parser = study_parser("replays", "Checks, tables and pictures of rows-*.csv and corpus.csv of the folder.",
                          "make replays", "Replays")
    parser.add_argument("--committed-rows", type=Path, help="of an earlier run, if there is one")
    parser.add_argument("--committed-corpus", type=Path, help="what the corpus must hold, if that is known")
    options = parser.parse_args(arguments)
    there = lambda path, *columns: Table.read(path, columns) if path and path.exists() else None
    rows = study_rows(options.dir, COLUMNS)
    record = Record(options.dir)
    check_corpus(there(options.committed_corpus), Table.read(options.dir / "corpus.csv"), record)
    check_replays(rows, record)
    check_regression(rows, there(options.committed_rows, *COLUMNS) or Table(rows.columns), record)
    record.save()
    write_file(options.dir / "percentiles.csv", percentiles(rows))
    write_file(options.dir / "latency.md", latency_tables(rows))
    draw_latency(rows, options.dir)
    draw_stages(rows, options.dir)
    return finish(options)
