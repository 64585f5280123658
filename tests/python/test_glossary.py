# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/glossary.md has every heading, key and flag of a report.

`brainshift report` makes a page and a merged report.json of the run below, which has something in every table; what
they say is looked for on the glossary's page.
"""
import html
import json
import os
import pathlib
import re
import subprocess

GLOSSARY = (pathlib.Path(os.environ["BRAINSHIFT_SOURCE"]) / "docs" / "glossary.md").read_text()
PAPER_COLUMNS = {"Ji et al.", "paper, simulated case", "the same", "paper, mean of five patients"}
FLAGS = ["misfit_unexplained", "strength_at_bound", "sources_contradict", "data_outside_region", "deadline",
         "contact_not_certified", "iteration_limit", "mostly_prior", "inverted_elements", "volume_lost", "beyond_skull",
         "not_finite"]
PARTS = ["along_gravity", "across_gravity", "gravity_sides", "gravity_ends", "tumour_volume", "brain_volume", "resection",
         "opening", "ventricles", "tract", "fine", "medium", "coarse", "far"]
PLAYED = {"case": "box", "scenario": "SCENARIO", "method": "METHOD", "boundary": "contact"}
RUN = PLAYED | {
    "error_mm": {"initial": {"mean": 2.0, "std": 0.5}},
    "quality": {"worst": "unusable", "last": "good", "reason": "", "counts": {"good": 1, "unusable": 1},
                "flags": {flag: 1 for flag in FLAGS}},
    "latency_ms": {"p50": 1.0}, "stages_ms": {"register": 1.0}, "field_error_pct": {"p50": 1.0}, "contact": {"active": 3},
    "sources": [{"source": "ius"}], "left_out": [{"part": "pressure", "reason": "drained", "estimated_error": "none"}],
    "failures": [{"observation_sequence": 1, "code": "unavailable", "message": "no answer"}],
    "prior_strengths": [{"part": part, "mean": 1.0} for part in PARTS],
    "hypotheses": [{"scales": {"fine": 1.0}, "weight": 1.0}],
    "trace": [{"iteration": 1, "sparse": {"mean": 1.0, "std": 0.5}, "cross": {"mean": 1.0, "std": 0.5}}],
}


def report(folder):
    """Page and merged report of RUN."""
    (folder / "run.json").write_text(json.dumps([RUN]))
    program = pathlib.Path(os.environ["BRAINSHIFT_PROGRAMS"]) / "brainshift"
    subprocess.run([program, "report", folder / "run.json", "--out", folder / "out"], check=True, capture_output=True)
    return (folder / "out" / "report.html").read_text(), json.loads((folder / "out" / "report.json").read_text())


def headings(page):
    """Texts of the sections and of the tables' headings, without what a run puts into them."""
    page = re.sub(r'<(th|tr)[^>]*class="paper".*?</\1>', "", page)
    found = set()
    for text in re.findall(r"<(?:th|h2)>(.*?)</(?:th|h2)>", page):
        text = html.unescape(re.sub(r"<code>.*?</code>|<br>.*", "", text)).strip()
        text = re.sub(r"^(updates where|strength of the prior:) .*", r"\1 …", text)
        if text not in PAPER_COLUMNS | {"", "SCENARIO"}:
            found.add(text)
    return found


def keys(value):
    """Every key of the report; names that a run chooses are no keys, but flags and parts are terms as well."""
    if isinstance(value, list):
        return set().union(*map(keys, value))
    if isinstance(value, dict):
        return set(value).union(*map(keys, value.values()))
    return set()


def terms():
    """Cells of the glossary's tables; several terms in one cell stand apart by semicolons."""
    cells = [cell.strip() for line in GLOSSARY.splitlines() if line.startswith("|") for cell in line.split("|")]
    return {term.strip() for cell in cells for term in [cell, *cell.split(";")]}


def test_every_heading_of_the_page_is_a_term(tmp_path):
    page, _ = report(tmp_path)
    found = headings(page)
    assert len(found) > 35, "the page has its tables"
    missing = found - terms()
    assert missing == set()


def test_every_key_flag_and_part_is_explained(tmp_path):
    _, runs = report(tmp_path)
    found = keys(runs) | set(FLAGS) | set(PARTS)
    assert {"coverage_90", "superseded", "elapsed_ms"} <= found
    missing = {key for key in found if f"`{key}`" not in GLOSSARY}
    assert missing == set()


def test_the_run_has_every_flag_and_part():
    source = pathlib.Path(os.environ["BRAINSHIFT_SOURCE"]) / "common" / "values"
    flags = re.findall(r'case QualityFlag::k\w+: return "(\w+)"', (source / "quality.cpp").read_text())
    parts = re.search(r"to_string\(PriorPart.*?\{([^{}]*)\};", (source / "estimate.cpp").read_text(), re.S)
    assert set(flags) == set(FLAGS)
    assert set(re.findall(r'"(\w+)"', parts[1])) == set(PARTS)
