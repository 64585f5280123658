# SPDX-License-Identifier: Apache-2.0
"""brainshift-bids: the command line.

    brainshift-bids BIDS_DIR OUTPUT_DIR participant [--participant-label 01 02] [--scenario joint-sag] [--seed 1 2]
    brainshift-bids BIDS_DIR OUTPUT_DIR group
    brainshift-bids compare BEFORE AFTER [--out FOLDER]

Exit status: 0 success; 2 bad usage or bad input, with one line for each subject that cannot run;
1 a program failed (run it again: it goes on), or compare found something worse.
"""
from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Sequence

from . import compare, group, layout, participant, programs
from .files import Path, Refused

ENDING = """\
BIDS has no names for mechanical cases and surgeries: docs/cohort.md lists this program's own.
Exit status: 0 success; 2 bad usage or bad input, one line for each subject that cannot run; 1 a program failed.
Two versions or settings over a cohort: brainshift-bids compare --help
Research software; no medical device."""


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        raise Refused(message)


def _whole(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not 1 or more")
    return number


def _seed(text: str) -> int:
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{text} is below 0")
    return number


def app_parser() -> Parser:
    parser = Parser(prog="brainshift-bids", allow_abbrev=False, epilog=ENDING, formatter_class=argparse.RawDescriptionHelpFormatter,
                    description="A cohort in BIDS: prepares every subject, plays simulated and recorded surgeries, and "
                                "makes tables, reports and statistics.")
    parser.add_argument("bids_dir", type=Path, help="the BIDS dataset; only read")
    parser.add_argument("output_dir", type=Path, help="the derivative, usually BIDS_DIR/derivatives/brainshift")
    parser.add_argument("analysis_level", choices=("participant", "group"))
    parser.add_argument("--participant-label", "--participant_label", nargs="+", default=[], metavar="L",
                        help="subjects, without sub-; default all")
    parser.add_argument("--session-label", "--session_label", nargs="+", default=[], metavar="S",
                        help="sessions, without ses-; default all that have a T1w image")
    parser.add_argument("--skip-bids-validator", "--skip_bids_validator", action="store_true",
                        help="do without a dataset_description.json that has Name and BIDSVersion")
    parser.add_argument("-v", "--version", action="version", version=_version())
    parser.add_argument("--n-cpus", "--n_cpus", type=_whole, default=len(os.sched_getaffinity(0)), metavar="N",
                        help="processors; subjects run beside one another on them; default all of this process")
    parser.add_argument("--mem-mb", "--mem_mb", type=_whole, metavar="N",
                        help="memory of all subjects that run at once: a preparation that needs more is refused")
    parser.add_argument("--scenario", nargs="+", default=["joint-sag"], metavar="NAME",
                        help="what is simulated (brainshift simulate --list), or none; default joint-sag")
    parser.add_argument("--seed", nargs="+", type=_seed, default=[1], metavar="N", help="seeds of every scenario; default 1")
    parser.add_argument("--adverse", default="", metavar="NAMES", help="as of brainshift simulate")
    parser.add_argument("--method", default="condensed", help="as of brainshift replay")
    parser.add_argument("--boundary", choices=("contact", "fixed", "both"), default="contact")
    parser.add_argument("--settings", type=Path, metavar="FILE",
                        help="sections of a case file for all subjects; its paths must be absolute")
    parser.add_argument("--edge-mm", type=float, metavar="MM", help="edge of the mesh; default that of a case")
    parser.add_argument("--simulated-tumour", action="store_true", help="a ball where the dataset has no tumour")
    parser.add_argument("--filter", nargs="+", default=[], metavar="KEY-VALUE",
                        help="entities that files must not contradict, e.g. run-1 acq-mprage")
    parser.add_argument("--programs", metavar="FOLDER", help="where brainshiftd and brainshift are; default PATH")
    return parser


def _version() -> str:
    from .. import __version__
    return f"brainshift-bids {__version__}"


def compare_parser() -> Parser:
    parser = Parser(prog="brainshift-bids compare", allow_abbrev=False,
                    description="Two versions or settings over one cohort, paired by subject (docs/cohort.md). Exit status: "
                                "0 nothing is worse; 1 something is; 2 bad usage or bad input.")
    parser.add_argument("before", type=Path, help="output_dir of the first")
    parser.add_argument("after", type=Path, help="output_dir of the second")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="compare_pairs.tsv and compare_statistics.tsv go here")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        if given[:1] == ["compare"]:
            chosen = compare_parser().parse_args(given[1:])
            text, worse = compare.run(chosen.before, chosen.after, chosen.out)
            print(text)
            return 1 if worse else 0
        options = app_parser().parse_args(given)
        if options.analysis_level == "group":
            print(f"brainshift-bids: {group.run(options.output_dir)}")
            return 0
        return participants(options)
    except (Refused, OSError) as refused:
        print(f"brainshift-bids: {refused}", file=sys.stderr)
        return 2 if isinstance(refused, Refused) else 1


def participants(options: argparse.Namespace) -> int:
    bids, output = options.bids_dir.resolve(), options.output_dir.resolve()
    if not options.skip_bids_validator:
        layout.check_dataset(bids)
    elif not bids.is_dir():
        raise Refused(f"{bids} is no folder")
    if output == bids:
        raise Refused(f"{output} is the dataset itself: choose a folder of its own, e.g. {bids / 'derivatives' / 'brainshift'}")
    if options.settings and not options.settings.is_file():
        raise Refused(f"--settings {options.settings}: no such file")
    if options.edge_mm is not None and not 1.0 <= options.edge_mm <= 40.0:
        raise Refused(f"--edge-mm {options.edge_mm:g} is not between 1 and 40")
    filters = {}
    for text in options.filter:
        key, dash, value = text.partition("-")
        if not dash or not key or not value:
            raise Refused(f"--filter {text} is no KEY-VALUE, e.g. run-1")
        filters[key] = value
    scenarios = () if options.scenario == ["none"] else tuple(dict.fromkeys(options.scenario))
    found = layout.with_anatomy(bids, layout.units(bids, options.participant_label, options.session_label))
    workers = max(1, min(options.n_cpus, len(found)))
    request = participant.Request(
        bids, output, programs.find(options.programs), scenarios, tuple(dict.fromkeys(options.seed)), options.adverse,
        options.method, options.boundary, options.settings, options.edge_mm, options.simulated_tumour, filters,
        round(options.mem_mb / 1024.0 / workers, 3) if options.mem_mb else None)
    participant.describe(request)

    # One thread a worker, on processors of its own: programs take as many threads as they may use processors.
    mine = sorted(os.sched_getaffinity(0))[:options.n_cpus]

    def work(worker: int) -> list[participant.Outcome]:
        os.sched_setaffinity(0, programs.cpus_for(worker, workers, mine))
        done = []
        while queue:
            try:
                unit = queue.pop(0)
            except IndexError:
                break
            done.append(participant.run(request, unit))
            stream = sys.stdout if done[-1].status == "done" else sys.stderr
            stream.write(f"brainshift-bids: {done[-1].line}\n")  # at once: other workers write too
            stream.flush()
        return done

    queue = list(found)
    with ThreadPoolExecutor(workers) as pool:
        outcomes = [outcome for share in list(pool.map(work, range(workers))) for outcome in share]
    states = {outcome.status for outcome in outcomes}
    return 1 if "failed" in states else 2 if "left out" in states else 0


if __name__ == "__main__":
    raise SystemExit(main())
