# SPDX-License-Identifier: GPL-3.0-or-later
"""What the studies' rows say: checks, tables, charts and summary.json.

C++ programs measure and write rows (CSV); this package judges and draws them, and measures nothing.

    PYTHONPATH=tests python3 -m studies NAME ...     NAME: a module below, with its own --help

Exit status: 0 every check holds, 1 one does not or a file cannot be written, 2 bad usage or input.
What is wrong is told in one line. It needs numpy and matplotlib (docker/packages-build.txt).

    rows.py      tables of comma-separated values        checks.py   checks, summary.json, records
    stats.py     percentiles, paired test, Pareto front  chart.py    one style for all charts
    common.py    errors, options, files                  clusters.py means over truths, then patients
"""
