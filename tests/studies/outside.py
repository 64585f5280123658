# SPDX-License-Identifier: GPL-3.0-or-later
"""outside: truths from outside the prior, in the rows of `surgeries`: what an estimate must do there, each figure
told as held or missed; a table of kinds; reliability; and the summary that other pages open with
(docs/surgeries.md).

Means are over truths, then over patients, a head's tumours with their openings; their 95 % intervals are over
patients (clusters.py). A bound holds where every head's mean holds it. A refused update recovers and covers
nothing; its field is that of no correction. Near: nodes within 30 mm of what was measured; far: the others;
cortex: the opened region.
"""
import math
from pathlib import Path

from . import chart, clusters
from .checks import CHECKS, Record, checks_of, every_check_holds, print_checks
from .clusters import or_zero
from .common import InputError, read_text, study_parser, write_file
from .evidence_tables import claims_table
from .rows import Table, cell_or_dash, csv_text, study_rows

STUDY = "outside"
# Where the motion lies out of sight of all data: the field may stay as wrong as it is.
OUT_OF_SIGHT = {"haematoma-other": "the blood lies on the other side",
                "air-back": "the air may lie behind all that is seen",
                "air-front": "the air may lie before all that is seen"}
GROUPS = {"air finds its way unevenly": ("air-side", "air-side-partial", "air-back", "air-front"),
          "sag that the prior does not hold": ("falx-sag", "repositioned", "large-strain"),
          "ventricles drain": ("ventricles-drain",),
          "blood presses from the skull": ("haematoma-same", "haematoma-other"),
          "blades": ("blade-midline", "blade-tract"),
          "a cavity that falls in": ("cavity",),
          "raised pressure": ("second-opening", "bulge")}
# Flags that say what is wrong with a field; that data lie beside the prepared region, or that a limit of
# iterations was met, does not.
RIGHT_REASONS = {"mostly_prior", "misfit_unexplained", "strength_at_bound", "sources_contradict"}
FAR_MM = 3.0  # rms of the far error's length, above which good is the wrong word
INTERVALS = (50, 68, 80, 90, 95, 99)
COLUMNS = ("outside", "flags", "quality_reason", "none_field_mean_mm", "none_tumour_mm", "beyond_band", "misfit_ratio",
           "true_max_mm", "all_interval_mm") + tuple(f"{part}_{what}" for part in ("near", "far", "cortex") for what in (
               "error_mm", "none_mm", "coverage_90", "interval_mm", "crps_mm", "rms_sd_mm", "rms_error_mm"))
SURGERY = ("head", "place", "seed", "scenario")


def split(rows):
    """Rows of the prior's own truths, and those from outside; older tables have the former only."""
    if not rows.has("outside"):
        return rows, rows.where(lambda row: False)
    rows.need(*COLUMNS)
    outside = lambda row: row["outside"] == "1"
    kinds = {row["scenario"] for row in rows if outside(row)}  # a refused update does not say
    return (rows.where(lambda row: row["scenario"] not in kinds), rows.where(lambda row: row["scenario"] in kinds))


def last_updates(rows):
    """The row of the last update of every surgery, in the order of the rows."""
    return Table(rows.columns, [own[-1] for own in rows.groups(*SURGERY).values()], rows.origin)


def careful(row):
    """The update says that something is wrong with its field, and what it says is to the point."""
    return (row["quality"] == "unusable" or row["status"] == "refused"
            or (row["quality"] == "caution" and not RIGHT_REASONS.isdisjoint(row["flags"].split(";"))))


def unmarked_far_mm(row):
    """Root mean square of the error's length over the far nodes that the update does not mark as unseen; over
    all of them where the table does not say."""
    error = math.sqrt(3) * row.number("far_rms_error_mm")
    return row.number("far_unmarked_mm") if row.has("far_unmarked_mm") else error


def field_ratio(rows):
    """Field error over no correction; that of a refused update is no correction's."""
    def error(row):
        return row.number("none_field_mean_mm" if row["status"] == "refused" else "field_mean_mm")
    return clusters.ratio(rows, error, "none_field_mean_mm")


class Musts:
    """rows: of all heads. last: their last updates."""

    def __init__(self, rows, record):
        self.rows, self.last, self.record = rows, last_updates(rows), record
        patients = len(rows.groups(*clusters.PATIENT))
        self.source = f"outside; {len(self.last)} surgeries of {patients} patients"
        self.heads = rows.groups("head")

    def check(self, name, value, bound, holds):
        self.record.check(STUDY, name, value, bound, holds, self.source)

    def figure(self, name, value, note):
        self.record.figure(STUDY, name, value, note, self.source)

    def run(self):
        for kind in self.rows.values("scenario"):
            rows, last = self.rows.where(scenario=kind), self.last.where(scenario=kind)
            for part in ("near", "far"):
                self.coverage(kind, part, rows)
            self.tumour(kind, last)
            self.field(kind, rows)
        self.single()
        self.band()
        self.unseen()
        self.scores()

    def per_head(self, rows, of):
        """[(head, its Interval)], of those that have rows."""
        return [(head, of(own)) for head, own in rows.groups("head").items()]

    def told(self, found):
        return "; ".join(f"{head} {interval}" for head, interval in found)

    def coverage(self, kind, part, rows):
        found = self.per_head(rows, lambda own: clusters.mean(own, or_zero(f"{part}_coverage_90")))
        doubted = dict(self.per_head(rows, lambda own: clusters.share(own, careful)))
        holds = all(one.mean >= 0.80 or (one.mean >= 0.65 and doubted[head].mean >= 0.9) for head, one in found)
        self.check(f"{kind}: coverage of the 90 % interval {part}", min(one.mean for _, one in found),
                   ">= 0.80 or >= 0.65 with a right caution in 90 % of the updates "
                   f"({self.told(found)}; caution {100 * min(one.mean for one in doubted.values()):.0f} %)", holds)

    def tumour(self, kind, last):
        recovered = self.per_head(last, lambda own: clusters.mean(own, or_zero("recovered_pct")))
        error = dict(self.per_head(last, lambda own: clusters.mean(own, "tumour_mm")))
        held = lambda head, one: one.mean >= 93 or error[head].mean <= 0.15
        worst = min(recovered, key=lambda one: (held(*one), one[1].mean))
        self.check(f"{kind}: tumour recovered %", worst[1].mean,
                   f">= 93 or error <= 0.15 mm ({self.told(recovered)}; error of the worst {error[worst[0]].mean:.2f} mm)",
                   all(held(*one) for one in recovered))

    def field(self, kind, rows):
        found = self.per_head(rows, field_ratio)
        bound, why = (1.0, f"; {OUT_OF_SIGHT[kind]}") if kind in OUT_OF_SIGHT else (0.7, "")
        worst = max(one.mean for _, one in found)
        self.check(f"{kind}: field error over no correction", worst, f"<= {bound:g} ({self.told(found)}{why})", worst <= bound)

    def single(self):
        low = self.last.where(lambda row: not row.number("coverage_90") >= 0.6)
        share = 100 * len(low) / len(self.last)
        kinds = "".join(f"; {kind} {len(own)}" for kind, own in low.groups("scenario").items())
        self.check("single surgeries with coverage below 0.6 %", share, f"<= 3 ({len(low)} of {len(self.last)}{kinds})",
                   share <= 3)

    def band(self):
        beyond = self.rows.where(lambda row: row.number("beyond_band") > 0)
        self.check("updates with nodes worse than no correction beyond a simultaneous 90 % band", len(beyond),
                   f"0 (of {len(self.rows)}; in {len(beyond.groups(*SURGERY))} of {len(self.last)} surgeries)",
                   not len(beyond))

    def unseen(self):
        """Whatever quality is called good: a caution that says nothing of the field is as sure of it."""
        sure = clusters.share(self.rows, lambda row: not careful(row) and unmarked_far_mm(row) > FAR_MM)
        note = "" if self.rows.has("far_unmarked_mm") else "; the rows do not say what is marked as unseen: all far nodes"
        self.check(f"updates without a right caution whose unmarked far field is wrong by {FAR_MM:g} mm rms %",
                   100 * sure.mean, f"<= 1 ({sure.count} patients{note})", sure.mean <= 0.01)

    def scores(self):
        for part in ("near", "far", "all"):
            for what, name in (("interval", "interval score"), ("crps", "CRPS")):
                if self.rows.has(f"{part}_{what}_mm"):
                    found = clusters.mean(self.rows, f"{part}_{what}_mm")
                    self.figure(f"{name} {part} mm", found.mean, f"shown ({found})")


def judge(rows, record):
    if len(rows):
        Musts(rows, record).run()


def same_updates(rows, others):
    """Of both tables those that both have, in one order."""
    key = lambda row: tuple(row[column] for column in (*SURGERY, "stage"))
    theirs = {key(row): row for row in others}
    both = [(row, theirs[key(row)]) for row in rows if key(row) in theirs]
    return (Table(rows.columns, [one for one, _ in both], rows.origin),
            Table(others.columns, [one for _, one in both], others.origin))


def check_against(rows, others, name, bounds, record):
    """Ours over theirs on the same updates. bounds: (truths, what, column, at most)."""
    outside_kinds = set(split(rows)[1].values("scenario"))
    for truths, what, column, most in bounds:
        own = lambda row: row["scenario"] not in outside_kinds
        ours, theirs = same_updates(rows.where(own) if truths == "own truths" else rows, others)
        called = f"{truths}: {what} over that of {name}"
        if not len(ours) or not theirs.has(column):
            record.left_out(STUDY, f"{called}: no rows of the same surgeries")
            continue
        ratio = clusters.same_over(ours, theirs, column)
        record.check(STUDY, called, ratio.mean, f"<= {most:g} ({ratio})", ratio.mean <= most, f"{len(ours)} updates")


def compare(rows, before, fixed, record):
    """Against the earlier default and against fixed strengths, where their tables are at hand."""
    check_against(rows, before, "the earlier default",
                  (("all truths", "interval score", "all_interval_mm", 0.6),
                   ("own truths", "interval score", "all_interval_mm", 1.6),
                   ("own truths", "tumour error", "tumour_mm", 1.05),
                   ("own truths", "field error", "field_mean_mm", 1.05)), record)
    check_against(rows, fixed, "fixed strengths", (("all truths", "interval score", "all_interval_mm", 1.0),), record)


def sharpness(rows, record):
    """Of the prior's own truths near the data, with all sources of each surgery."""
    if not len(rows) or not rows.has("near_coverage_90"):
        record.left_out(STUDY, "own truths: coverage and sharpness near the data: no rows of them")
        return
    for head, own in last_updates(rows).groups("head").items():
        covered = clusters.mean(own, or_zero("near_coverage_90"))
        record.check(STUDY, f"own truths on {head}: coverage of the 90 % interval near the data", covered.mean,
                     f">= 0.85 ({covered})", covered.mean >= 0.85)
        width = clusters.ratio(own, "near_rms_sd_mm", "near_rms_error_mm")
        record.check(STUDY, f"own truths on {head}: rms sd over rms error near the data", width.mean, f"<= 3 ({width})",
                     width.mean <= 3)


def _mean(column):
    return lambda rows: clusters.mean(rows, column).mean


def _ratio(above, below):
    return lambda rows: clusters.ratio(rows, above, below).mean


def _share(holds):
    return lambda rows: 100 * clusters.share(rows, holds).mean


TABLE = (("recovered %", _mean(or_zero("recovered_pct")), 3),
         ("tumour mm", _mean("tumour_mm"), 2),
         ("field", lambda rows: field_ratio(rows).mean, 2),
         ("near", _ratio("near_error_mm", "near_none_mm"), 2),
         ("cortex", _ratio("cortex_error_mm", "cortex_none_mm"), 2),
         ("far", _ratio("far_error_mm", "far_none_mm"), 2),
         ("coverage near", _mean(or_zero("near_coverage_90")), 2),
         ("coverage far", _mean(or_zero("far_coverage_90")), 2),
         ("interval score near mm", _mean("near_interval_mm"), 2),
         ("interval score far mm", _mean("far_interval_mm"), 2),
         ("CRPS near mm", _mean("near_crps_mm"), 2),
         ("CRPS far mm", _mean("far_crps_mm"), 2),
         ("sd over error near", _ratio("near_rms_sd_mm", "near_rms_error_mm"), 2),
         ("good %", _share(lambda row: row["quality"] == "good"), 3),
         ("careful %", _share(careful), 3),
         ("beyond band", lambda rows: len(rows.where(lambda row: row.number("beyond_band") > 0)), 3),
         ("largest mm", _mean("true_max_mm"), 2))


def table_text(rows):
    """Markdown: a line per head, kind and data. field, near, cortex, far: error over no correction."""
    heading = ("head", "kind", "data", "n", "patients") + tuple(name for name, _, _ in TABLE)
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    for (head, kind, stage), own in rows.groups("head", "scenario", "stage").items():
        cells = [head, kind, stage, str(len(own)), str(len(own.groups(*clusters.PATIENT)))]
        cells += [cell_or_dash(float(of(own)), digits) for _, of, digits in TABLE]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def musts_text(record):
    """A line per must, held or missed, with its figures; then what was not measured."""
    checks = Table.parse(csv_text(CHECKS, [one for one in record.checks if one[0] == STUDY]), "checks")
    missed = len(checks.where(lambda row: row["pass"] == "0"))
    bounded = len(checks.where(lambda row: row["pass"] != ""))
    text = f"{bounded - missed} of {bounded} bounds hold, {missed} are missed.\n\n{claims_table(checks, STUDY)}"
    left = [reason for study, reason in record.parts_left_out if study == STUDY]
    return text + ("\nNot measured:\n\n" + "".join(f"- {reason}\n" for reason in left) if left else "")


def summary_text(rows, commit):
    """What other pages open with: a line per group of kinds, means over patients; updates with all data."""
    last = last_updates(rows)
    nodes = sorted({int(one) for one in rows.finite("nodes")})
    size = f"{nodes[0] / 1000:.0f}" if nodes[-1] < 1.5 * nodes[0] else f"{nodes[0] / 1000:.0f} to {nodes[-1] / 1000:.0f}"
    text = (f"{len(last)} surgeries of {len(last.values('scenario'))} kinds that the prior does not hold; "
            f"{len(rows.groups(*clusters.PATIENT))} patients on {len(rows.values('head'))} "
            f"head{'s' if len(rows.values('head')) > 1 else ''}, {size} thousand nodes, seeds that nobody chose anything on, "
            f"commit {commit}. Means over patients; all instruments together.\n\n"
            "| what happens | surgeries | tumour recovered | its error | field error over no correction "
            "| coverage of the 90 % interval near the data, far |\n|---|---|---|---|---|---|\n")
    named = {**GROUPS, "all together": tuple(last.values("scenario"))}
    for name, kinds in named.items():
        own = last.where(lambda row: row["scenario"] in kinds)
        if len(own):
            text += (f"| {name} | {len(own)} | {_mean(or_zero('recovered_pct'))(own):.0f} % | {_mean('tumour_mm')(own):.2f} mm "
                     f"| {field_ratio(own).mean:.2f} | {_mean(or_zero('near_coverage_90'))(own):.2f}, "
                     f"{_mean(or_zero('far_coverage_90'))(own):.2f} |\n")
    return text


def draw_reliability(rows, folder):
    """Promised against true share, a curve per group of kinds. True where it is drawn: older rows have the 90 %
    interval alone."""
    if not rows.has("near_coverage_50"):
        return False
    last = last_updates(rows)
    fig, axes = chart.figure("How often truths from outside lie in the published intervals",
                             "within 30 mm of the data; all instruments, mean over patients", columns=2, size=(12, 5.2))
    axes[1].set_title("farther away", loc="left", fontsize=10, fontweight="normal")
    for ax, part in zip(axes, ("near", "far")):
        ax.plot((50, 99), (50, 99), color=chart.INK, linestyle="--", linewidth=1.2, label="as promised")
        for k, (name, kinds) in enumerate(GROUPS.items()):
            own = last.where(lambda row: row["scenario"] in kinds)
            if len(own):
                shares = [100 * _mean(or_zero(f"{part}_coverage_{one}"))(own) for one in INTERVALS]
                ax.plot(INTERVALS, shares, label=name, **{**chart.style(k), "marker": "os^Dv<>"[k % 7]},
                        linestyle="-" if k < len(chart.COLOURS) else ":")
        chart.label(ax, "share that the interval promises (%)", "share of true components inside (%)")
    for ax in axes:
        ax.set_ylim(min(one.get_ylim()[0] for one in axes), 101)
    fig.get_layout_engine().set(rect=(0, 0.12, 1, 0.88))
    fig.legend(*axes[0].get_legend_handles_labels(), ncols=4, loc="lower left", bbox_to_anchor=(0.04, 0.0))
    chart.save(fig, folder / "outside-reliability.png")
    return True


def publish(rows, record, folder, commit):
    """The files that pages take their figures from."""
    write_file(folder / "outside.md", table_text(rows))
    write_file(folder / "musts.md", musts_text(record))
    write_file(folder / "summary.md", summary_text(rows, commit))
    drawn = draw_reliability(rows, folder)
    write_file(folder / "reliability.txt",
               f"![How often truths from outside lie in the intervals]({folder.parent.name}/{folder.name}/outside-reliability.png)\n"
               if drawn else "Reliability curves are not drawn: these rows have the 90 % interval alone.\n")


def with_blocks(text, page, folder):
    """The page with each block between `<!-- outside: FILE -->` and `<!-- end -->` made FILE of the folder."""
    parts, rest = [], text
    while "<!-- outside: " in rest:
        before, _, rest = rest.partition("<!-- outside: ")
        name, found, rest = rest.partition(" -->")
        _, closed, rest = rest.partition("<!-- end -->")
        if not (found and closed) or "/" in name:
            raise InputError(f"{page}: a block of outside.py is not closed by <!-- end -->")
        parts.append(f"{before}<!-- outside: {name} -->\n{read_text(folder / name)}<!-- end -->")
    return "".join(parts) + rest


def main(arguments):
    parser = study_parser("outside", "What an estimate must do on truths from outside: rows-*.csv or .csv.gz of the folder.",
                          "make surgeries", "Truths from outside")
    parser.add_argument("--before", type=Path, nargs="*", default=[], help="tables of the earlier default on the same surgeries")
    parser.add_argument("--fixed", type=Path, nargs="*", default=[], help="the same with prior.scales: fixed")
    parser.add_argument("--pages", type=Path, nargs="*", default=[], help="pages whose blocks are made anew")
    options = parser.parse_args(arguments)
    rows = study_rows(options.dir, ("head", "place", "seed", "scenario", "stage", "status", "nodes", "recovered_pct",
                                    "tumour_mm", "field_mean_mm", "coverage_90", "quality", *COLUMNS))
    own, from_outside = split(rows)
    if not len(from_outside):
        raise InputError(f"{options.dir}: no truth from outside in rows-*.csv")
    record = Record(options.dir)
    judge(from_outside, record)
    sharpness(own, record)
    compare(rows, Table.read_all(options.before), Table.read_all(options.fixed), record)
    table = csv_text(CHECKS, record.checks)
    write_file(options.dir / "checks.csv", table)
    publish(from_outside, record, options.dir, options.commit)
    for page in options.pages:
        write_file(page, with_blocks(read_text(page), page, options.dir))
    checks = checks_of(Table.parse(table, "checks.csv"))
    print_checks(checks, [reason for _, reason in record.parts_left_out])
    return every_check_holds(checks)
