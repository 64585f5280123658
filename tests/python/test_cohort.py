# SPDX-License-Identifier: GPL-3.0-or-later
"""brainshift-bids around stand-ins for the programs: what it reads, refuses, keeps and counts."""
import csv
import itertools
import json
import os
import pathlib
import random
import struct
import subprocess
import sys

import bids_tree
import cohort_programs
import numpy as np
import pytest

from brainshift.cohort import case, compare, files, layout, median_interval, nifti, signed_rank
from brainshift.cohort import statistics


@pytest.fixture
def bids(tmp_path):
    return bids_tree.dataset(tmp_path / "ds")


@pytest.fixture
def programs(tmp_path):
    return cohort_programs.make(tmp_path / "bin")


def command(*arguments):
    return [sys.executable, "-m", "brainshift.cohort", *map(str, arguments)]


def app(*arguments, expect=0):
    done = subprocess.run(command(*arguments), capture_output=True, text=True, timeout=280)
    assert done.returncode == expect, done.stdout + done.stderr
    return done


def table(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(stream, delimiter="\t"))


def everything(output):
    """Bytes of all tables of subjects and group that must not depend on the machine."""
    found = {f.relative_to(output).as_posix(): f.read_bytes() for f in sorted(output.rglob("*.tsv"))}
    found.pop("group_timing.tsv", None)
    return found


def refusal(function, *arguments):
    with pytest.raises(files.Refused) as raised:
        function(*arguments)
    return str(raised.value)


# Statistics

def test_the_signed_rank_test_counts_every_pattern_of_signs():
    source = random.Random(4)
    for n in range(1, 10):
        for values in ([source.gauss(0.5, 1.0) for _ in range(n)], [source.choice([-2.0, -1.0, 1.0, 2.0]) for _ in range(n)]):
            order = sorted(abs(v) for v in values)
            rank = {size: np.mean([i + 1 for i, o in enumerate(order) if o == size]) for size in order}
            ranks = [rank[abs(v)] for v in values]
            plus = sum(r for r, v in zip(ranks, values) if v > 0)
            low = min(plus, sum(ranks) - plus)
            sums = [sum(r for r, sign in zip(ranks, signs) if sign) for signs in itertools.product((0, 1), repeat=n)]
            expected = min(1.0, 2.0 * sum(s <= low for s in sums) / 2 ** n)
            assert signed_rank(values).p == pytest.approx(expected, abs=1e-15)


def test_the_signed_rank_test_agrees_with_the_published_table():
    # Wilcoxon's table: n = 20, two-sided 5 %: critical sum 52.
    def with_smaller_sum(total):
        values, left = [], total
        for rank in range(20, 0, -1):
            values.append(-float(rank) if rank <= left else float(rank))
            left -= rank if rank <= left else 0
        assert left == 0
        return signed_rank(values)

    assert with_smaller_sum(52).p <= 0.05 < with_smaller_sum(53).p
    assert with_smaller_sum(52).minus == 52.0


def test_beyond_sixty_pairs_the_normal_law_is_close_to_the_exact_one(monkeypatch):
    source = random.Random(2)
    values = [round(source.gauss(0.25, 1.0), 1) for _ in range(90)]
    normal = signed_rank(values)
    monkeypatch.setattr(statistics, "EXACT_UP_TO", 100)
    exact = signed_rank(values)
    assert exact.exact and not normal.exact
    assert normal.p == pytest.approx(exact.p, rel=0.03)


def test_zero_differences_are_left_out_and_none_is_no_evidence():
    assert signed_rank([0.0, 0.0, 1.0]).pairs == 1
    assert signed_rank([0.0, 0.0]).p == 1.0
    assert signed_rank([1.0] * 6).effect == 1.0
    with pytest.raises(ValueError):
        signed_rank([float("nan")])


def test_the_interval_of_a_median_is_made_of_order_statistics():
    assert median_interval([1.0] * 5) is None
    assert median_interval([6.0, 1.0, 2.0, 3.0, 4.0, 5.0]) == (1.0, 6.0)
    assert median_interval([float(i) for i in range(1, 21)]) == (6.0, 15.0)


def test_holm_adjusts_from_the_smallest():
    assert statistics.holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])


# Images

def test_voxels_and_affine_are_those_of_the_header(tmp_path):
    values = np.arange(24, dtype="int16").reshape(2, 3, 4)
    affine = np.array([[0.0, -2.0, 0.0, 5.0], [3.0, 0.0, 0.0, 6.0], [0.0, 0.0, 4.0, 7.0]])
    image = nifti.read(bids_tree.put(tmp_path / "a.nii.gz", values, affine))
    assert (image.values == values).all()
    assert image.points(values == 23) == pytest.approx(np.array([[1.0, 9.0, 19.0]]))


def test_a_qform_is_read_where_there_is_no_sform(tmp_path):
    raw = bytearray(bids_tree.nifti(np.ones((2, 2, 2), "uint8")))
    struct.pack_into("<2h", raw, 252, 1, 0)
    half = np.sqrt(0.5)
    struct.pack_into("<6f", raw, 256, 0.0, 0.0, half, 1.0, 2.0, 3.0)  # a quarter turn about z
    struct.pack_into("<4f", raw, 76, -1.0, 1.0, 2.0, 3.0)
    (tmp_path / "q.nii").write_bytes(raw)
    expected = [[0, -2, 0, 1], [1, 0, 0, 2], [0, 0, -3, 3], [0, 0, 0, 1]]
    assert nifti.read(tmp_path / "q.nii").affine == pytest.approx(np.array(expected), abs=1e-6)


def test_an_image_that_cannot_be_read_is_named_with_the_reason(tmp_path):
    raw = bids_tree.nifti(np.ones((4, 4, 4), "uint8"))
    (tmp_path / "empty.nii.gz").touch()
    (tmp_path / "cut.nii").write_bytes(raw[:-1])
    (tmp_path / "text.nii.gz").write_text("no image")
    (tmp_path / "annex.nii.gz").symlink_to("../.git/annex/objects/x")
    bids_tree.put(tmp_path / "flat.nii", np.ones((4, 4, 4), "uint8"), np.zeros((3, 4)))
    (tmp_path / "nowhere.nii").write_bytes(raw[:252] + bytes(4) + raw[256:])
    for name, part in (("empty.nii.gz", "is empty (0 bytes)"), ("cut.nii", "ends after 415 of 416 bytes"),
                       ("text.nii.gz", "is no NIfTI-1 file"), ("annex.nii.gz", "link to content that is not here"),
                       ("nowhere.nii", "neither sform nor qform"), ("flat.nii", "affine that has no inverse")):
        said = refusal(nifti.read, tmp_path / name)
        assert name in said and part in said


# Layout and case

def inputs_of(bids, label, session=None, **filters):
    return layout.inputs(bids, layout.Unit(label, session), bids / "derivatives" / "brainshift", filters)


def test_masks_of_another_space_or_run_do_not_count(bids):
    beside = bids_tree.subject(bids, "01", brain=False)
    inside = bids_tree.head().astype("uint8")
    bids_tree.put(beside / "sub-01_space-MNI152NLin2009cAsym_desc-brain_mask.nii.gz", inside)
    assert "no brain" in refusal(inputs_of, bids, "01")
    bids_tree.put(beside / "sub-01_space-T1w_desc-brain_mask.nii.gz", inside)
    found = inputs_of(bids, "01")
    assert found.brain.file.name == "sub-01_space-T1w_desc-brain_mask.nii.gz"
    assert found.tumour.file.name == "sub-01_label-lesion_mask.nii.gz"


def test_of_several_images_the_mask_or_a_filter_says_which(bids):
    beside = bids_tree.subject(bids, "01")
    for run in "12":
        bids_tree.put(bids / "sub-01" / "anat" / f"sub-01_run-{run}_T1w.nii.gz", np.ones((2, 2, 2), "uint8"))
    (bids / "sub-01" / "anat" / "sub-01_T1w.nii.gz").unlink()
    said = refusal(inputs_of, bids, "01")
    assert "2 files could be the T1w image" in said and "--filter" in said
    assert inputs_of(bids, "01", run="2").image.name == "sub-01_run-2_T1w.nii.gz"
    (beside / "sub-01_desc-brain_mask.nii.gz").rename(beside / "sub-01_run-1_desc-brain_mask.nii.gz")
    assert inputs_of(bids, "01").image.name == "sub-01_run-1_T1w.nii.gz"


def test_names_of_a_segmentation_tell_brain_and_tumour(bids, tmp_path):
    beside = bids_tree.subject(bids, "01", brain=False, lesion=False)
    labels = bids_tree.head().astype("uint8")
    labels[bids_tree.head(1.1) & ~bids_tree.head()] = 7
    labels[bids_tree.tumour()] = 3
    bids_tree.put(beside / "sub-01_dseg.nii.gz", labels)
    (beside / "sub-01_dseg.tsv").write_text("index\tname\n0\tbackground\n1\tbrain\n3\ttumour\n7\tskull\n")
    found = inputs_of(bids, "01")
    assert found.brain.labels == (1, 3) and found.tumour.labels == (3,)
    case.build("sub-01", found, {}, {}, None, False, tmp_path)
    made = nifti.read(tmp_path / "brain.nii.gz")
    assert (made.values == (labels > 0) * (labels < 7)).all()
    assert made.affine == pytest.approx(nifti.read(found.image).affine)


def test_sessions_without_an_image_are_passed_over(bids):
    bids_tree.subject(bids, "01", session="pre")
    (bids / "sub-01" / "ses-post" / "func").mkdir(parents=True)
    (bids / "sub-02" / "ses-a").mkdir(parents=True)
    found = layout.with_anatomy(bids, layout.units(bids, [], []))
    assert [unit.name for unit in found] == ["sub-01_ses-pre", "sub-02_ses-a"]


def test_by_default_the_opening_is_uppermost_outside_the_tumour(bids, tmp_path):
    bids_tree.subject(bids, "01")
    text, told = case.build("sub-01", inputs_of(bids, "01"), {}, {}, 12.0, False, tmp_path)
    lines = dict(line.split(": ", 1) for line in text.splitlines())
    opening = np.array(json.loads(lines["craniotomy"])["centre_mm"])
    gravity = np.array(json.loads(lines["gravity"])["direction"])
    assert np.linalg.norm(opening / [65, 80, 60]) == pytest.approx(1.0, abs=0.06)      # on the surface
    assert np.cross(gravity, opening) == pytest.approx(np.zeros(3), abs=4.0)           # through the middle
    assert gravity @ opening < 0
    assert json.loads(lines["brainstem"])["centre_mm"][2] < -50
    assert json.loads(lines["mesh"]) == {"generate": {"edge_mm": 12.0}}


def test_plan_goes_before_settings_and_settings_before_defaults(bids, tmp_path):
    bids_tree.subject(bids, "01")
    (tmp_path / "settings.yaml").write_text("# all\ngravity:\n  direction: [0, -1, 0]\nmesh: {generate: {edge_mm: 9}}\n")
    (tmp_path / "plan.yaml").write_text("gravity: {direction: [1, 0, 0]}\n")
    settings, plan = (case.sections(tmp_path / name, ("case_id",)) for name in ("settings.yaml", "plan.yaml"))
    text, told = case.build("sub-01", inputs_of(bids, "01"), settings, plan, 12.0, False, tmp_path)
    assert text.count("gravity:") == 1 and "direction: [1, 0, 0]" in text and "edge_mm: 9" in text
    assert told["Gravity"] == "plan"


def test_a_section_that_is_the_subjects_own_or_there_twice_is_refused(tmp_path):
    file = tmp_path / "settings.yaml"
    file.write_text("case_id: x\n")
    assert "line 1: case_id" in refusal(case.sections, file, ("case_id",))
    file.write_text("prior:\n  a: 1\nprior: {}\n")
    assert "line 3: prior is there twice" in refusal(case.sections, file, ())


# Subjects

def test_a_cohort_has_a_row_per_surgery_and_a_line_for_whom_it_left_out(bids, programs, tmp_path):
    bids_tree.subject(bids, "01")
    bids_tree.subject(bids, "02", session="a")
    bids_tree.subject(bids, "03", lesion=False)
    out = bids / "derivatives" / "brainshift"
    done = app(bids, out, "participant", "--programs", programs, "--seed", 2, 1, "--boundary", "both", expect=2)
    assert done.stderr.splitlines() == [line for line in done.stderr.splitlines() if "sub-03: left out: no tumour" in line]
    assert len(done.stderr.splitlines()) == 1
    described = json.loads((out / "dataset_description.json").read_text())
    assert {"Name", "BIDSVersion", "DatasetType", "GeneratedBy", "SourceDatasets"} <= set(described)
    assert described["DatasetType"] == "derivative" and described["GeneratedBy"][0]["Version"] == "0.1.0"
    rows = table(out / "sub-02" / "ses-a" / "sub-02_ses-a_surgeries.tsv")
    assert [(r["session_id"], r["seed"], r["boundary"]) for r in rows] == [
        ("ses-a", seed, boundary) for seed in "12" for boundary in ("contact", "fixed")]
    assert (out / "sub-01" / "sub-01_report.html").exists() and (out / "sub-01" / "sub-01_case.yaml").exists()

    assert "8 surgeries of 2 subjects, 1 left out" in app(bids, out, "group").stdout
    assert [r["reason"][:9] for r in table(out / "group_leftout.tsv")] == ["no tumour"]
    assert [r["surgeries"] for r in table(out / "group_subjects.tsv")] == ["2"] * 4
    assert {r["subjects"] for r in table(out / "group_statistics.tsv") if r["measure"] == "tumour_error_mm"} == {"2"}
    for file in out.glob("group_*.tsv"):
        assert list(json.loads(file.with_suffix(".json").read_text())) == file.read_text().split("\n")[0].split("\t")


def test_what_is_done_is_not_done_again_and_more_is_added(bids, programs, tmp_path):
    bids_tree.subject(bids, "01")
    out = tmp_path / "out"
    app(bids, out, "participant", "--programs", programs)
    first = (out / "sub-01" / "sub-01_desc-jointsagseed1_result.json").read_bytes()
    assert "1 surgery was done" in app(bids, out, "participant", "--programs", programs).stdout
    assert len((programs / "replays.log").read_text().splitlines()) == 1
    app(bids, out, "participant", "--programs", programs, "--seed", 1, 2)
    assert (out / "sub-01" / "sub-01_desc-jointsagseed1_result.json").read_bytes() == first
    assert len(table(out / "sub-01" / "sub-01_surgeries.tsv")) == 2


@pytest.mark.parametrize("change", ["settings", "image", "program", "option"])
def test_a_result_of_other_inputs_is_refused_not_replaced(bids, programs, tmp_path, change):
    bids_tree.subject(bids, "01")
    out, more = tmp_path / "out", []
    app(bids, out, "participant", "--programs", programs)
    before = everything(out)
    if change == "settings":
        (tmp_path / "s.yaml").write_text("prior: {scales: fixed}\n")
        more = ["--settings", tmp_path / "s.yaml"]
    elif change == "image":
        bids_tree.subject(bids, "01", scale=0.9)
    elif change == "program":
        with open(programs / "brainshift", "a") as file:
            file.write("# another build\n")
    else:
        more = ["--method", "pcg"]
    done = app(bids, out, "participant", "--programs", programs, *more, expect=2)
    assert "is from other inputs, settings or programs" in done.stderr
    assert everything(out) == before


def test_bad_input_and_a_program_that_failed_have_different_statuses(bids, programs, tmp_path):
    beside = bids_tree.subject(bids, "01")
    plan = beside / "sub-01_plan.yaml"
    plan.write_text("refuse: me\n")
    done = app(bids, tmp_path / "out", "participant", "--programs", programs, expect=2)
    assert "sub-01: left out: brainshiftd prepare: case.yaml: refuse: not a section" in done.stderr
    plan.write_text("fail: me\n")
    done = app(bids, tmp_path / "out", "participant", "--programs", programs, expect=1)
    assert "sub-01: failed: brainshiftd prepare: out of memory (exit status 1)" in done.stderr
    plan.unlink()
    app(bids, tmp_path / "out", "participant", "--programs", programs)
    assert not list((tmp_path / "out").rglob("*_leftout.json"))


def test_a_recording_that_cannot_be_played_takes_no_other_surgery_with_it(bids, programs, tmp_path):
    beside = bids_tree.subject(bids, "01")
    (beside / "sub-01_task-a_surgery.surgery").write_text("broken")
    (beside / "sub-01_task-b_landmarks.csv").write_text("1,2,3,1,2,3\n")
    done = app(bids, tmp_path / "out", "participant", "--programs", programs, "--scenario", "joint-sag", expect=2)
    assert "1 of 3 surgeries: task-a: brainshift replay" in done.stderr and len(done.stderr.splitlines()) == 1
    rows = table(tmp_path / "out" / "sub-01" / "sub-01_surgeries.tsv")
    assert [(row["surgery"], row["seed"]) for row in rows] == [("joint-sag", "1"), ("task-b", "n/a")]


def test_ten_kills_lose_and_double_nothing(bids, programs, tmp_path):
    for label in ("01", "02", "03"):
        bids_tree.subject(bids, label)
    how = ["participant", "--programs", programs, "--scenario", "joint-sag", "paper", "--seed", 1, 2, 3, "--n-cpus", 2]
    app(bids, tmp_path / "whole", *how)
    app(bids, tmp_path / "whole", "group")
    out, source = tmp_path / "out", random.Random(7)
    kills, kept = 0, {}
    while kills < 10:
        running = subprocess.Popen(command(bids, out, *how), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            running.wait(source.uniform(0.1, 1.2))
            # All was done before it could be killed: a subject loses its table and one result, as a kill leaves them.
            assert running.returncode == 0, running.stderr.read()
            label = source.choice(["01", "02", "03"])
            for file in [*out.glob(f"sub-{label}/*_surgeries.tsv"), *out.glob(f"sub-{label}/*_desc-paperseed2_*")]:
                file.unlink()
                kept.pop(file, None)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
            kills += 1
        running.stderr.close()
        for file in out.glob("sub-*/*_result.json"):
            json.loads(file.read_text())  # whole
        for file, content in kept.items():
            assert file.read_bytes() == content
        kept = {file: file.read_bytes() for file in out.glob("sub-*/*_result.json")}
    app(bids, out, *how)
    app(bids, out, "group")
    assert everything(out) == everything(tmp_path / "whole")
    left = [f for f in out.rglob("*") if f.name.endswith(".tmp") or f.suffix == ".h5" or f.name.endswith(".part")]
    assert left == []


def test_runs_that_share_a_folder_do_each_surgery_once(bids, programs, tmp_path):
    for label in ("01", "02"):
        bids_tree.subject(bids, label)
    out = tmp_path / "out"
    both = [subprocess.Popen(command(bids, out, "participant", "--programs", programs, "--seed", 1, 2),
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    for process in both:
        said = process.communicate(timeout=120)
        assert process.returncode == 0, said
    replays = [line for line in (programs / "replays.log").read_text().splitlines()]
    assert len(replays) == 4
    assert len(table(out / "sub-01" / "sub-01_surgeries.tsv")) == 2


# Command line

@pytest.mark.parametrize("arguments, part", [
    (["participant", "--participant-label", "09"], "--participant-label 09"),
    (["participants"], "invalid choice"), (["participant", "--edge-mm", "0.1"], "--edge-mm 0.1"),
    (["participant", "--n-cpus", "0"], "--n-cpus"), (["participant", "--filter", "run"], "--filter run"),
    (["participant", "--settings", "none.yaml"], "--settings none.yaml"), (["group"], "no folder")])
def test_bad_usage_is_one_line_and_status_2(bids, programs, tmp_path, arguments, part):
    bids_tree.subject(bids, "01")
    done = app(bids, tmp_path / "out", *arguments, *(["--programs", programs] if "participant" in arguments else []), expect=2)
    assert len(done.stderr.splitlines()) == 1 and part in done.stderr


def test_a_folder_that_is_no_dataset_is_refused_unless_validation_is_skipped(bids, programs, tmp_path):
    bids_tree.subject(bids, "01")
    (bids / "dataset_description.json").unlink()
    done = app(bids, tmp_path / "out", "participant", "--programs", programs, expect=2)
    assert "dataset_description.json is missing" in done.stderr
    app(bids, tmp_path / "out", "participant", "--programs", programs, "--skip-bids-validator")


def test_another_dataset_is_no_output_folder(bids, programs, tmp_path):
    bids_tree.subject(bids, "01")
    other = bids_tree.dataset(tmp_path / "other")
    before = (other / "dataset_description.json").read_bytes()
    assert "is not brainshift's" in app(bids, other, "participant", "--programs", programs, expect=2).stderr
    assert (other / "dataset_description.json").read_bytes() == before
    assert [file.name for file in other.iterdir()] == ["dataset_description.json"]


# Compare

def cohorts(bids, programs, tmp_path, subjects):
    for i in range(subjects):
        bids_tree.subject(bids, f"{i:02}", scale=1.0 - 0.01 * i)
    (tmp_path / "worse.yaml").write_text("worse: true\n")
    app(bids, tmp_path / "a", "participant", "--programs", programs)
    app(bids, tmp_path / "b", "participant", "--programs", programs, "--settings", tmp_path / "worse.yaml")
    return tmp_path / "a", tmp_path / "b"


def test_a_version_that_is_worse_for_everybody_is_called_so(bids, programs, tmp_path):
    a, b = cohorts(bids, programs, tmp_path, 6)
    # The stand-in draws anew for other settings, so the errors of b are set to twice those of a.
    for file in a.glob("sub-*/*_result.json"):
        result = json.loads(file.read_text())
        result["Runs"][0]["error_mm"]["cross"]["mean"] *= 2.0
        (b / file.relative_to(a)).write_text(json.dumps(result))
    done = app("compare", a, b, "--out", tmp_path / "c", expect=1)
    rows = {row["measure"]: row for row in table(tmp_path / "c" / "compare_statistics.tsv")}
    assert rows["tumour_error_mm"]["verdict"] == "worse" and float(rows["tumour_error_mm"]["p"]) == 2 / 2 ** 6
    assert rows["tumour_error_mm"]["worse"] == "6" and rows["tumour_recovered_pct"]["verdict"] == "alike"
    assert "6 surgeries of 6 subjects" in done.stdout
    assert app("compare", a, a).returncode == 0


def test_a_folder_of_both_boundaries_is_compared_in_the_one_that_both_have(bids, programs, tmp_path):
    bids_tree.subject(bids, "01")
    app(bids, tmp_path / "a", "participant", "--programs", programs)
    app(bids, tmp_path / "b", "participant", "--programs", programs, "--boundary", "both")
    assert "1 surgeries of 1 subjects; only before: 0, only after: 1" in app("compare", tmp_path / "a", tmp_path / "b").stdout


def test_few_subjects_decide_nothing_and_nothing_shared_is_refused(bids, programs, tmp_path):
    a, b = cohorts(bids, programs, tmp_path, 2)
    app("compare", a, b, "--out", tmp_path / "c")
    verdicts = {row["verdict"] for row in table(tmp_path / "c" / "compare_statistics.tsv")}
    assert verdicts <= {"few", "alike"} and "few" in verdicts
    app(bids, tmp_path / "d", "participant", "--programs", programs, "--seed", 9)
    assert "share no surgery" in app("compare", a, tmp_path / "d", expect=2).stderr


def test_a_coverage_nearer_to_its_level_is_better():
    run = {"participant_id": "sub-01", "surgery": "s"}
    pairs = compare.subject_pairs([({**run, **dict.fromkeys(("tumour_error_mm",), 1.0), **_coverage(0.99)},
                                    {**run, **dict.fromkeys(("tumour_error_mm",), 1.0), **_coverage(0.88)})])
    loss = next(p["loss"] for p in pairs if p["measure"] == "coverage_90")
    assert loss == pytest.approx(0.02 - 0.09)


def _coverage(value):
    return {**{m.column: None for m in compare.COMPARED if m.column != "tumour_error_mm"}, "coverage_90": value}


# Datasets of other people's making

def example(name, folder, images):
    """The tree of a public dataset; images are empty files as there, or small heads."""
    lines = (pathlib.Path(__file__).parent / "bids_examples.txt").read_text().splitlines()
    for line in (line for line in lines if line.startswith(name + "/")):
        file = folder / line
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.name == "dataset_description.json":
            bids_tree.dataset(file.parent)
        elif images and file.name.endswith((".nii", ".nii.gz")):
            bids_tree.put(file, bids_tree.head().astype("uint8"))
        else:
            file.touch()
    return folder / name


# Units that run, and what the lines of the others say.
EXAMPLES = {"ds000001-fmriprep": (1, 0, ""), "ds114": (0, 4, "no brain"), "synthetic": (0, 2, "no brain"),
            "ds000117": (0, 1, "no brain"), "atlas-4S": (0, 1, "no brain")}


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_public_layout_runs_or_has_one_line_per_subject(programs, tmp_path, name):
    run, lines, part = EXAMPLES[name]
    for images in (False, True):
        bids = example(name, tmp_path / str(images), images)
        out = bids / "derivatives" / "brainshift"
        good = run if images else 0
        done = app(bids, out, "participant", "--programs", programs, "--simulated-tumour", expect=0 if good and not lines else 2)
        said = done.stderr.splitlines()
        assert len(done.stdout.splitlines()) == good and len(said) == lines + run - good
        wrong = [line for line in said if not line.startswith("brainshift-bids: sub-") or images and part not in line]
        assert wrong == []


def test_masks_that_are_put_beside_a_public_dataset_make_it_run(programs, tmp_path):
    bids = example("ds114", tmp_path, images=True)
    for image in bids.glob("sub-*/ses-*/anat/*_T1w.nii.gz"):
        mask = bids / "derivatives" / "masks" / image.relative_to(bids)
        bids_tree.put(mask.with_name(image.name.replace("T1w", "desc-brain_mask")), bids_tree.head().astype("uint8"))
    out = tmp_path / "out"
    app(bids, out, "participant", "--programs", programs, "--simulated-tumour")
    assert "4 surgeries of 2 subjects, 0 left out" in app(bids, out, "group").stdout
