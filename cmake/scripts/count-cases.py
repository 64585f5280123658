#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""count-cases.py TEST_RESULTS: how many cases the last run of run-tests.sh ran, and which of them failed.

TEST_RESULTS holds ctest.xml, and for each test that has cases TEST.json (GoogleTest) or TEST.xml (pytest). A test without
such a file is one case. A program that ended before it wrote its file counts as one failed case. Prints failed cases by name
and a closing line in CTest's words. Exit status: 0, or 1 when the results cannot be read.
"""
import json
import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def googletest(path):
    """(name, outcome) of the cases that ran."""
    for suite in json.loads(path.read_text())["testsuites"]:
        for case in suite["testsuite"]:
            if case.get("result") == "SUPPRESSED" or case.get("status") == "NOTRUN":
                continue
            outcome = "failed" if case.get("failures") else "skipped" if case.get("result") == "SKIPPED" else "passed"
            yield f"{suite['name']}.{case['name']}", outcome


def pytest(path):
    for case in ElementTree.parse(path).iter("testcase"):
        bad = case.find("failure") is not None or case.find("error") is not None
        yield case.get("name"), "failed" if bad else "skipped" if case.find("skipped") is not None else "passed"


def cases_of(test, folder):
    """(name, outcome) of the cases of one CTest test, given its element in ctest.xml."""
    name, status = test.get("name"), test.get("status")
    whole = [(name, {"run": "passed", "notrun": "skipped", "disabled": "skipped"}.get(status, "failed"))]
    for suffix, read in ((".json", googletest), (".xml", pytest)):
        path = folder / (name + suffix)
        if path.is_file():
            found = [(f"{name}: {case}", outcome) for case, outcome in read(path)]
            # It failed, but none of its cases did: it crashed at its end, or ran out of time.
            return found + whole if status == "fail" and all(o != "failed" for _, o in found) else found
    return whole


def main():
    folder = pathlib.Path(sys.argv[1])
    try:
        tests = list(ElementTree.parse(folder / "ctest.xml").iter("testcase"))
        cases = [case for test in tests for case in cases_of(test, folder)]
    except (OSError, ValueError, KeyError, ElementTree.ParseError) as error:
        print(f"count-cases: {folder}: {error}", file=sys.stderr)
        return 1
    failed = [name for name, outcome in cases if outcome == "failed"]
    skipped = sum(outcome == "skipped" for _, outcome in cases)
    for name in failed:
        print(f"failed: {name}")
    passed = 100 * (len(cases) - len(failed)) // max(1, len(cases))
    print(f"cases: {passed}% tests passed, {len(failed)} tests failed out of {len(cases)} ({skipped} skipped)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
