# SPDX-License-Identifier: GPL-3.0-or-later
"""bench: what one `make bench` wrote to its folder -> pictures, tables.md, summary.json.

    machine.txt                      --machine: where it ran, and the commit
    meshes-*.csv, error_time-*.csv   bench_error_time (tests/benchmarks/error_time.hpp)
    run-NAME.json, latency-NAME.csv  `brainshift replay` of the surgery NAME; with another BLAS kernel
                                     NAME@KERNEL
    stages.csv                       bench_update: where the time of an update goes
    limits.csv                       bench_update: what an update takes at least, and the machine's speed
    scenes.csv                       bench_scenes: what leaving out parts saves and costs
    peers.csv                        another code on the same mesh and load, forward
    facts.csv                        name,value: what the script measured itself
    left_out.csv                     what the script did not run, a line each
    prepare.json, prepare-100k.json  `brainshiftd prepare --json`; with edges for 100 thousand nodes
    direct-NAME.json                 bench_exactness --scenario NAME

tables.md has all tables, updates.md the one of BENCHMARK.md. Parts that are missing stay empty; what was not measured does not hold.
"""
import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path

from .bench_pictures import draw
from .checks import Check, at_most, every_check_holds, print_checks, summary_json
from .common import InputError, Parser, read_text, write_file
from .rows import Table, cell_or_dash as cell, significant
from .stats import paired_t_test, percentile

GIB, MIB = 2.0 ** 30, 2.0 ** 20
MANY_ACTIVE, UPDATES_FOR_TAIL, UPDATES_FOR_GROWTH = 500, 2000, 10000
SURGERIES = 20  # of a paired test
# Kinds of surgery: of run-NAME.json, its recording in limits.csv, what it is, most of t_solve at the median.
UPDATES = (("sag-progress", "short", "sag, contact", 0.45), ("region", None, "the same, region of 40 mm about the tumour", 0.3),
           ("no-contact", "no-contact", "no contact", 0.2), ("joint-sag", "joint-sag", "sag, three sources", 1.0),
           ("distension", "distension", "swelling", 2.5), ("joint-mixed", "joint-mixed", "sag, swelling, shrinkage, three sources", 1.5))
BOUNDS = {name: bound for name, _, _, bound in UPDATES}
KEYS = ("mesh", "scenario", "method", "prior", "rank", "start")
MESHES = ("mesh", "nodes", "tets", "slaves", "edge_mm", "t_solve_ms", "factor_s", "condense_s", "factor_bytes",
          "operator_bytes", "peak_rss_bytes")
ERROR_TIME = KEYS + ("repetition", "time_ms", "time_over_tsolve", "cross_mm", "field_mean_mm", "field_max_mm",
                     "active", "iterations", "status", "coverage_90")


@dataclass
class Method:
    """Repetitions of one method, prior, number of modes and start on one mesh and scenario.

    Errors and coverage are means over the repetitions in which every method of this mesh and scenario
    gave an estimate (`compared` of them): each has its own noise, which moves the error more than the
    choice of method does. A method that gave none at all does not count."""
    mesh: str
    scenario: str
    method: str
    prior: str
    rank: int  # prior modes; 0: the method has none
    start: str
    rows: Table
    compared: int = 0
    errors: dict = field(default_factory=dict)

    def __post_init__(self):
        # A repetition that was stopped shows how long it was given, not how long it takes.
        self.finished = self.rows.where(lambda row: math.isfinite(row.number("field_mean_mm")))
        self.p50_ms = percentile(self.finished.finite("time_ms"), 50.0)
        self.max_ms = percentile(self.rows.finite("time_ms"), 100.0)
        self.over_tsolve = percentile(self.finished.finite("time_over_tsolve"), 50.0)

    def compare(self, repetitions):
        rows = self.rows.where(lambda row: row["repetition"] in repetitions)
        self.compared = len(repetitions)
        self.errors = {column: rows.mean(column)
                       for column in ("cross_mm", "field_mean_mm", "field_max_mm", "coverage_90")}

    @property
    def status(self):
        """The one of all repetitions, or "N of M converged"."""
        texts = [row["status"] for row in self.rows]
        same = len(set(texts)) == 1
        return texts[0] if same else f"{texts.count('converged')} of {len(texts)} converged"


def summarise(error_time):
    """[Method], in the order of the rows."""
    methods = []
    for (mesh, scenario, method, prior, rank, start), rows in error_time.groups(*KEYS).items():
        methods.append(Method(mesh, scenario, method, prior, int(rank or 0), start, rows))
    for place in {(one.mesh, one.scenario) for one in methods}:
        rivals = [one for one in methods if (one.mesh, one.scenario) == place]
        estimated = [{row["repetition"] for row in one.finished} for one in rivals if len(one.finished)]
        for one in rivals:
            one.compare(set.intersection(*estimated) if estimated else set())
    return methods


def paired(first, second, column):
    """second - first on the repetitions that both have inverted."""
    a, b = ({row["repetition"]: row.number(column) for row in one.rows} for one in (first, second))
    shared = [one for one in a if one in b]
    return paired_t_test([b[one] for one in shared], [a[one] for one in shared])


def number_at(value, *keys):
    """The number at these keys of a JSON object; NaN where it is missing or null."""
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan


def read_json(path, kind):
    try:
        value = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: is not JSON: {error}") from None
    if not isinstance(value, kind):
        raise InputError(f"{path}: must be a JSON {'array' if kind is list else 'object'}")
    return value


class Results:
    def __init__(self, folder):
        self.folder = folder = Path(folder)
        if not folder.is_dir():
            raise InputError(f"{folder}: the folder does not exist")
        self.meshes, self.error_time = self._all("meshes", MESHES), self._all("error_time", ERROR_TIME)
        self.methods = summarise(self.error_time)
        self.stages = self._one("stages.csv", ("surgery", "stage", "over_tsolve"))
        self.limits = self._one("limits.csv", ("surgery", "p50_ms", "active", "rows", "bytes", "operations", "limit_ms",
                                               "bytes_per_s", "operations_per_s"))
        self.scenes = self._one("scenes.csv", ("scenario", "left_out", "active", "largest_mm", "difference_mm",
                                               "estimate_mm", "invert_ms", "rebuild_ms"))
        self.peers = self._one("peers.csv", ("code", "seconds", "mean_mm", "max_mm"))
        self.left_out = self._lines("left_out.csv")
        self.machine = (self._lines("machine.txt") or [""])[0]
        self.runs, self.latency_ms = {}, {}
        for path in sorted(folder.glob("run-*.json"), key=lambda path: path.stem):
            name, reports = path.stem.removeprefix("run-"), read_json(path, list)
            if reports:
                self.runs[name] = reports[0]
            latency = self._one(f"latency-{name}.csv", ("latency_ms",))
            if latency.rows:  # without the first update of the session
                self.latency_ms[name] = latency.where(lambda row: row is not latency[0]).finite("latency_ms")
        self.facts = {row["name"]: row.number("value") for row in self._one("facts.csv", ("name", "value"))}
        self._facts_of("prepare.json", prepare_s=("total_s",), prepare_peak_bytes=("peak_memory_bytes",),
                       model_file_bytes=("model_file_bytes",))
        self._facts_of("prepare-100k.json", large_prepare_s=("total_s",), large_peak_bytes=("peak_memory_bytes",))
        for scenario in ("paper", "distension"):
            self._read_direct(scenario)

    def _all(self, stem, columns):
        # 5k, 18k, 100k, 18k-refined
        return Table.read_all(sorted(self.folder.glob(stem + "-*.csv"), key=lambda path: (len(path.name), path.name)), columns)

    def _one(self, name, columns):
        path = self.folder / name
        return Table.read(path, columns) if path.exists() else Table(columns)

    def _lines(self, name):
        path = self.folder / name
        return read_text(path).splitlines() if path.exists() else []

    def _facts_of(self, file, **places):
        if (self.folder / file).exists():
            value = read_json(self.folder / file, dict)
            self.facts.update({name: number_at(value, *keys) for name, keys in places.items()})

    def _read_direct(self, scenario):
        """Of several ranks the one in everyday use counts, the largest."""
        path = self.folder / f"direct-{scenario}.json"
        if not path.exists():
            return
        value = read_json(path, dict)
        if not isinstance(value.get("reduced"), list):
            raise InputError(f'{path}: has no array "reduced"')
        largest = max(value["reduced"], key=lambda one: number_at(one, "rank"), default={})
        self.facts["direct_max_mm " + scenario] = number_at(largest, "max_mm")

    def fact(self, name):
        return self.facts.get(name, math.nan)

    def find(self, mesh, scenario, method, start, prior="case", rank=None):
        """The one with the most modes, unless asked for another; None without any."""
        there = [one for one in self.methods
                 if (one.mesh, one.scenario, one.method, one.start, one.prior) == (mesh, scenario, method, start, prior)
                 and rank in (None, one.rank)]
        return max(there, key=lambda one: one.rank, default=None)

    def over_tsolve(self, name, percent="p50"):
        """A percentile of the latency, the median, in units of the solve of the same report."""
        run = self.runs.get(name)
        return number_at(run, "latency_ms", percent) / number_at(run, "full_solve_ms")

    def active(self, name):
        """Slaves that press at the end; 0 when nothing is known."""
        active = number_at(self.runs.get(name), "contact", "active")
        return 0 if math.isnan(active) else int(active)


def _replay(folder, name):
    return f"brainshift replay {folder}/{name}.surgery --boundary contact, see cmake/scripts/bench.sh"


def _updates(results, folder, suffix):
    kernel = f", BLAS kernel {suffix[1:]}" if suffix else ""

    def median(what, name, contact, percent="p50", bound=None):
        check = at_most(f"{what}, {percent} / t_solve{kernel}", results.over_tsolve(name + suffix, percent), bound or BOUNDS[name], "",
                        _replay(folder, name))
        check.holds = check.holds and (results.active(name + suffix) > 0) == contact
        return check

    first = [name for name in results.runs if name.startswith("cold-") and name.partition("@")[1:] == suffix.partition("@")[1:]]
    first = {name: number_at(results.runs[name], "cold_ms") / number_at(results.runs[name], "full_solve_ms")
             for name in first}
    first = {name: value for name, value in first.items() if math.isfinite(value)}
    cold = at_most(f"first update of a session, more than 500 slaves press, median / t_solve{kernel}",
                   percentile(list(first.values()), 50.0), 1.5, "", _replay(folder, "cold"))
    cold.holds = cold.holds and min(map(results.active, first), default=0) > MANY_ACTIVE
    return [median("warm update with contact", "sag-progress", True),
            median("the same, region of 40 mm about the tumour", "region", True),
            cold,
            median("update without contact", "no-contact", False),
            median("three sources, warm", "joint-sag", True),
            median("swelling that presses the brain on the skull, warm", "distension", True),
            median("sag, swelling and shrinkage, three sources, warm", "joint-mixed", True),
            median("the same", "joint-mixed", True, "p95", 3.0)]


def _first_field(results, folder):
    """Of an update of sag: the provisional field, or the final one where that comes sooner. Provisional ones are of long
    updates alone."""
    run = results.runs.get("sag-progress")
    value = min(number_at(run, "latency_ms", "p50"), number_at(run, "first_iterate_ms"),
                key=lambda ms: math.inf if math.isnan(ms) else ms) / number_at(run, "full_solve_ms")
    return at_most("first field of a warm update with contact, provisional or final, p50 / t_solve", value, 0.25, "",
                   _replay(folder, "sag-progress"))


def _deadline(results, folder):
    """Of the updates that take longest, with a deadline of 100 ms: all of a session, the first too."""
    names = [name for name in results.runs if name.endswith("-100ms")]
    longest = [max(number_at(results.runs[name], "cold_ms"), number_at(results.runs[name], "latency_ms", "max"))
               for name in names]
    return at_most("longest update with a deadline of 100 ms, joint-mixed and distension",
                   max(longest) if len(names) == 2 else math.nan, 120.0, "ms", _replay(folder, "distension"))


def _tail(results, folder):
    latency = results.latency_ms.get("sag-progress", [])
    value = percentile(latency, 99.0) / percentile(latency, 50.0)
    # The first update of the session is not among them.
    return Check("p99 over 2,000 different updates / p50", value, "<= 2",
                 value <= 2.0 and len(latency) + 1 >= UPDATES_FOR_TAIL, _replay(folder, "sag-progress"))


def _paper(results, folder, method, bound, prior):
    """The paper's method and its faster form give the same estimates; the faster one inverts twenty
    surgeries on the small mesh, and errors are compared with it."""
    whose = "the paper's prior" if prior == "paper" else "the case's prior"
    check = Check(f"{method}, {whose} / condensed, both cold, time; error not larger", math.nan,
                  f">= {significant(bound)}", False,
                  f"bench_error_time --sizes 5,18 --scenarios paper --out {folder}")
    slow, ours = results.find("18k", "paper", method, "cold", prior), results.find("18k", "paper", "condensed", "cold")
    small_slow = results.find("5k", "paper", "paper-woodbury", "cold", prior)
    small_ours = results.find("5k", "paper", "condensed", "cold")
    if slow and ours:
        check.value = slow.p50_ms / ours.p50_ms
    if small_slow and small_ours:
        tumour, whole = (paired(small_slow, small_ours, column) for column in ("cross_mm", "field_mean_mm"))
        differs = lambda test: f"{significant(test.mean, 2)} mm (p = {significant(test.p, 2)})"
        check.name += (f": by {differs(tumour)} at the tumour, {differs(whole)} in the field, "
                       f"over {tumour.pairs} surgeries on 5 thousand nodes")
        check.holds = (check.value >= bound and min(tumour.pairs, whole.pairs) >= SURGERIES
                       and tumour.mean <= 0.0 and whole.mean <= 0.0)
    return check


def _exactness(results, folder):
    for scenario in ("paper", "distension"):
        command = f"bench_exactness --scenario {scenario} --out {folder}/direct-{scenario}.json"
        where = f" against the direct posterior, largest difference of a node, scenario {scenario}"
        yield at_most("condensed" + where, results.fact("direct_max_mm " + scenario), 0.01, "mm", command)


def _preparation(results, folder):
    prepare = f"brainshiftd prepare --case config/cases/colin27.yaml --out {folder}/colin27.h5 --json"
    serve = f"brainshiftd serve --model {folder}/colin27.h5"
    yield at_most("preparation, both boundaries", results.fact("prepare_s"), 25.0, "s", prepare)
    yield at_most("preparation, peak memory", results.fact("prepare_peak_bytes") / GIB, 8.0, "GiB", prepare)
    yield at_most("model file", results.fact("model_file_bytes") / MIB, 300.0, "MiB", prepare)
    yield at_most("daemon with a session, resident memory", results.fact("rss_session_bytes") / MIB, 400.0, "MiB", serve)
    yield at_most("from start of the daemon to ready", results.fact("load_to_ready_s"), 0.5, "s", serve)


def _large(results, folder):
    """The mesh of 100 thousand nodes, unless left_out.csv names it."""
    if any(line.startswith("mesh of 100 thousand nodes") for line in results.left_out):
        return
    prepare = f"brainshiftd prepare --case {folder}/large.yaml --out {folder}/large.h5 --json"
    large, warm = "100 thousand nodes, ", results.find("100k", "paper", "condensed", "warm")
    yield at_most(large + "peak memory of preparation", results.fact("large_peak_bytes") / GIB, 8.0, "GiB", prepare)
    yield at_most(large + "preparation, both boundaries", results.fact("large_prepare_s"), 300.0, "s", prepare)
    yield at_most(large + "warm update / t_solve", warm.over_tsolve if warm else math.nan, 0.4, "",
                  f"bench_error_time --sizes 100 --out {folder}")


def _scenes(results, folder):
    """What a part that is left out truly changes, beyond what the update says of it."""
    ratios = [row.number("difference_mm") / (row.number("estimate_mm") or math.nan)
              if row.number("difference_mm") > 0.01 else 0.0 for row in results.scenes]
    value = math.nan if not ratios or any(map(math.isnan, ratios)) else max(ratios)
    return Check("what leaving out a part changes / its estimate, largest (changes above 0.01 mm)", value, "<= 1",
                 value <= 1.0, f"bench_scenes --csv {folder}/scenes.csv")


def _coverage(results, folder):
    """Over all repetitions of this method, whatever the others did."""
    ours = results.find("18k", "paper", "condensed", "cold")
    value = ours.rows.mean("coverage_90") if ours else math.nan
    return Check("share of true displacements within the 90 % interval, scenario paper, mean", value, "0.80 to 0.97",
                 0.80 <= value <= 0.97, f"bench_error_time --sizes 18 --scenarios paper --out {folder}")


def _growth(results, folder):
    check = at_most("growth of the daemon's memory over 10,000 updates",
                    (results.fact("rss_after_bytes") - results.fact("rss_before_bytes")) / MIB, 0.0, "MiB",
                    _replay(folder, "no-contact"))
    check.holds = check.holds and results.fact("growth_updates") >= UPDATES_FOR_GROWTH
    return check


def checks(results, folder):
    """folder: for the commands."""
    return [*_updates(results, folder, ""), *_updates(results, folder, "@Haswell"), _tail(results, folder),
            _first_field(results, folder), _deadline(results, folder),
            *(_paper(results, folder, method, bound, prior) for prior in ("case", "paper")
              for method, bound in (("paper", 3000.0), ("paper-woodbury", 700.0))),
            *_exactness(results, folder), *_preparation(results, folder), *_large(results, folder),
            _scenes(results, folder), _coverage(results, folder), _growth(results, folder)]


def whole(value):
    return str(round(value)) if math.isfinite(value) else "-"


def markdown(heading, rows):
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def _check_table(all_checks):
    holds = lambda check: "yes" if check.holds else "**no**" if math.isfinite(check.value) else "not measured"
    return markdown(("check", "value", "bound", "holds"),
                    [(check.name, cell(check.value), check.bound, holds(check)) for check in all_checks])


def _latency_table(results):
    rows = []
    for name, run in results.runs.items():
        if not run.get("latency_ms"):
            continue
        times = [number_at(run, "latency_ms", one) for one in ("p50", "p95", "p99", "max")]
        numbers = [number_at(run, "cold_ms"), *times, number_at(run, "full_solve_ms"), results.over_tsolve(name)]
        rows.append((name, str(run.get("updates", 0)), *map(cell, numbers),
                     str(results.active(name)) if run.get("contact") else "-"))
    return markdown(("surgery", "updates", "first ms", "p50 ms", "p95 ms", "p99 ms", "max ms", "t_solve ms",
                     "p50 of t_solve", "active"), rows)


def _stage_table(results):
    surgeries = results.stages.values("surgery")
    cells = {(row["surgery"], row["stage"]): row.number("over_tsolve") for row in results.stages}
    return markdown(("stage", *surgeries),
                    [(stage, *(cell(cells.get((one, stage), 0.0), 2) for one in surgeries))
                     for stage in results.stages.values("stage")])


def _least(row):
    """MiB to read, millions of operations, ms: what an update takes at least."""
    return row.number("bytes") / MIB, row.number("operations") / 1e6, row.number("limit_ms")


def _limit_table(results):
    return markdown(("surgery", "active", "rows of data", "p50 ms", "reads MiB", "million operations", "at least ms",
                     "p50 of that"),
                    [(row["surgery"], whole(row.number("active")), whole(row.number("rows")), cell(row.number("p50_ms")),
                      *map(cell, _least(row)), cell(row.number("p50_ms") / row.number("limit_ms"))) for row in results.limits])


def _speed(results):
    if not results.limits.rows:
        return "Not measured."
    row = results.limits[0]
    return (f"This machine reads {cell(row.number('bytes_per_s') / 1e9)} GB/s and makes {cell(row.number('operations_per_s') / 1e9)} "
            "billion operations a second, double precision, all threads.")


def update_table(results):
    """Markdown, the table of BENCHMARK.md: updates by kind of surgery, in ms, t_solve and what they take at least."""
    least = {row["surgery"]: row for row in results.limits}
    rows = []
    for name, recording, what, bound in UPDATES:
        run = results.runs.get(name, {})
        numbers = [number_at(run, "full_solve_ms"), number_at(run, "cold_ms"),
                   *(number_at(run, "latency_ms", one) for one in ("p50", "p95", "p99")), number_at(run, "first_iterate_ms")]
        ratio, other = results.over_tsolve(name), results.over_tsolve(name + "@Haswell")
        of_t_solve = cell(ratio, 2) if ratio <= bound else f"**{cell(ratio, 2)}**"
        row = least.get(recording)
        limits = map(cell, _least(row)) if row is not None else ("-",) * 3
        rows.append((what, str(results.active(name)), *map(cell, numbers), of_t_solve, cell(other, 2), str(bound), *limits))
    return "\n".join([f"Processor: {results.machine}. {_speed(results)}", "",
                      *markdown(("surgery", "slaves that press", "t_solve ms", "first ms", "p50 ms", "p95 ms", "p99 ms", "provisional ms",
                                 "p50 of t_solve", "kernel Haswell", "bound", "reads MiB", "million operations", "at least ms"), rows)]) + "\n"


def _scene_table(results):
    numbers = ("largest_mm", "difference_mm", "estimate_mm", "invert_ms", "rebuild_ms")
    return markdown(("surgery", "left out", "active", "largest displacement mm", "change mm", "estimate of it mm",
                     "invert ms", "rebuild ms"),
                    [(row["scenario"], row["left_out"], row["active"], *(cell(row.number(one)) for one in numbers))
                     for row in results.scenes])


def _peer_table(results):
    """Times, and how far displacements lie from those of the forward model here."""
    return markdown(("code", "time s", "mean difference mm", "largest mm"),
                    [(row["code"], *(cell(row.number(one)) for one in ("seconds", "mean_mm", "max_mm")))
                     for row in results.peers])


def _mesh_table(results):
    rows = []
    for row in results.meshes:
        warm = results.find(row["mesh"], "paper", "condensed", "warm")
        rows.append((row["mesh"], row["nodes"], row["tets"], row["slaves"],
                     *(cell(row.number(one)) for one in ("edge_mm", "t_solve_ms", "factor_s", "condense_s")),
                     *(whole(row.number(one) / MIB) for one in ("operator_bytes", "peak_rss_bytes")),
                     cell(warm.p50_ms) if warm else "-", cell(warm.over_tsolve) if warm else "-"))
    return markdown(("mesh", "nodes", "tetrahedra", "slaves", "edge mm", "t_solve ms", "factor s", "condense s",
                     "operators MiB", "peak memory MiB", "warm update ms", "of t_solve"), rows)


def _method_table(results):
    return markdown(
        ("mesh", "scenario", "method", "prior", "modes", "start", "n", "p50 ms", "max ms", "of t_solve",
         "tumour error mm", "field error mm", "largest mm", "coverage", "active", "iterations", "status"),
        [(one.mesh, one.scenario, one.method, one.prior, str(one.rank or "-"), one.start, str(len(one.rows)),
          *map(cell, (one.p50_ms, one.max_ms, one.over_tsolve, *one.errors.values())),
          whole(one.rows.mean("active")), cell(one.rows.mean("iterations")), one.status) for one in results.methods])


def tables(results, all_checks):
    """Markdown: machine and commit, checks, latencies, stages, scenes, meshes, methods."""
    lines = ["# Benchmark: all tables", "", "[BENCHMARK.md](../../BENCHMARK.md) says how they were measured and what they come to.", "",
             f"Processor: {results.machine}."]
    for heading, above, table in (
            ("Checks", (), _check_table(all_checks)),
            ("Latency through daemon and client, loopback", (), _latency_table(results)),
            ("Where the time of an update goes",
             ("Medians in units of t_solve, in one process without messages.", ""), _stage_table(results)),
            ("What an update takes at least",
             (_speed(results) + " One linear model of the last active set and one field, each number read once, each operation made once at that "
              "speed; an update makes several. Medians in one process without messages.", ""), _limit_table(results)),
            ("What leaving out parts of a scene saves and costs", (), _scene_table(results)),
            *([("Another code on the same mesh, forces and contact, forward",
               ("Sag of patient 1, about 18 thousand nodes; a row for the part of the forward model here that waits for no load, and "
                "one for the other.", ""), _peer_table(results))] if len(results.peers) else []),
            ("Growth with the mesh", (), _mesh_table(results)),
            ("Methods", ("Times are over n repetitions, errors over those repetitions that all methods of a mesh "
                         "and scenario have.", ""), _method_table(results))):
        lines += ["", "## " + heading, "", *above, *table]
    if results.left_out:
        lines += ["", "## Left out", "", *("- " + line for line in results.left_out)]
    return "\n".join(lines) + "\n"


def machine_line(status, commit):
    """Processor, cores, memory, BLAS kernel, commit. status: `brainshift status --json` of a daemon,
    which knows its kernel."""
    def first(path, key):
        lines = (line.partition(":") for line in read_text(path).splitlines() if line.startswith(key))
        return next((value.strip() for _, _, value in lines), "unknown")

    memory_kib = float(first("/proc/meminfo", "MemTotal").split()[0])
    return (f"{first('/proc/cpuinfo', 'model name')}, {os.cpu_count()} logical cores, BLAS kernel "
            f"{status.get('blas_kernel', 'unknown')}; memory {significant(memory_kib / MIB, 3)} GiB; commit {commit}")


def main(arguments):
    parser = Parser("bench", "Pictures, tables and checks of what `make bench` measured.")
    parser.add_argument("--dir", default="out/bench", help="folder with the measurements; results go there too")
    parser.add_argument("--machine", metavar="STATUS", help="write machine.txt, and no more; STATUS: what "
                        "`brainshift status --json` says of the daemon")
    parser.add_argument("--commit", default="unknown", help="for --machine")
    parser.add_argument("--figures-only", action="store_true", help="no tables, no checks")
    options = parser.parse_args(arguments)
    folder = Path(options.dir)
    if options.machine:
        write_file(folder / "machine.txt", machine_line(read_json(options.machine, dict), options.commit) + "\n")
        return True
    results = Results(folder)
    draw(results, folder)
    if options.figures_only:
        return True
    found = checks(results, options.dir)
    write_file(folder / "tables.md", tables(results, found))
    write_file(folder / "updates.md", update_table(results))
    write_file(folder / "summary.json", summary_json(found, results.left_out))
    print_checks(found, results.left_out)
    return every_check_holds(found)
