#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the estimates of two builds: files of `bench_update --fields`, played from the same surgeries.

    python3 tests/benchmarks/update_difference.py BEFORE AFTER [--bound-mm 0.005]

A line per update: active slaves, slaves that only one of the two has, largest difference of a node's displacement and of its
standard deviation, mm. Exit status 1 where a displacement differs by more than the bound or a set of slaves differs, 2 for files
that do not belong together.
"""
import argparse
import sys

import numpy


def estimates(path):
    data = open(path, "rb").read()
    at = 0

    def take(kind, count):
        nonlocal at
        values = numpy.frombuffer(data, kind, count, at)
        at += values.nbytes
        return values

    while at < len(data):
        nodes, active = take(numpy.int32, 2)
        yield take(float, 3 * nodes).reshape(-1, 3), take(float, nodes), set(take(numpy.int32, active))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("--bound-mm", type=float, default=0.005)
    options = parser.parse_args()
    before, after = list(estimates(options.before)), list(estimates(options.after))
    if [len(each[1]) for each in before] != [len(each[1]) for each in after]:
        print("update_difference: the files do not hold the same updates", file=sys.stderr)
        return 2
    held = True
    for number, ((u, sd, active), (v, sd_after, active_after)) in enumerate(zip(before, after), 1):
        moved = numpy.linalg.norm(u - v, axis=1).max()
        slaves = len(active ^ active_after)
        held = held and moved <= options.bound_mm and slaves == 0
        print(f"update {number}: {len(active)} active, {slaves} differ, displacement {moved:.2e} mm, "
              f"sd {abs(sd - sd_after).max():.2e} mm")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
