# SPDX-License-Identifier: GPL-3.0-or-later
"""MRI -> model -> simulated surgery -> daemon -> client -> report, with the programs a user runs.

The bounds are loose ones for the coarse mesh; the paper's figures are checked on the full one.
"""
import csv
import json
import os
import shutil
import signal

import inputs as shared
import pytest
from programs import COARSE_CASE, LOCAL, brainshift as command, good, refused, serve, write
from recordings import SurgeryFile

import brainshift
from brainshift.v1 import brainshift_pb2 as pb

# Scripts rely on these keys of a run in report.json.
REPORT_KEYS = ("case", "scenario", "method", "boundary", "mesh", "prepare_s", "model_bytes", "full_solve_ms", "updates",
               "latency_ms", "cold_ms", "stages_ms", "error_mm", "recovery_pct", "field_error_pct", "coverage_90",
               "region_known", "contact", "principal_direction_deg", "left_out", "quality", "prior_strengths", "hypotheses")


@pytest.fixture
def daemon(folder, inputs):
    """Starts a daemon that keeps a journal, as often as it is called."""
    (folder / "journal").mkdir()
    daemons = []

    def start():
        daemons.append(serve(folder, LOCAL + f"journal_dir: {folder / 'journal'}\n", model=inputs / "head" / "model.h5"))
        assert daemons[-1].address
        return daemons[-1]

    yield start
    for one in daemons:
        one.__exit__()


@pytest.fixture
def paper(inputs):
    return inputs / "head" / "paper.surgery"


def replay(surgery, daemon, report, *more):
    done = good(command("replay", surgery, "--endpoint", daemon.address, "--report", report, *more))
    assert f", {'paper' if '--method' in more else 'condensed'}, contact: " in done.stdout
    return json.loads(report.read_text()), done


def with_boundary(report, boundary):
    return next(run for run in report if run["boundary"] == boundary)


def assert_contract(run):
    assert set(REPORT_KEYS) <= set(run)
    assert run["quality"]["worst"] in ("good", "caution")
    assert run["quality"]["counts"]["unusable"] == 0
    for key in ("initial", "sparse", "cross", "craniotomy_initial", "craniotomy"):
        assert isinstance(run["error_mm"][key]["mean"], (int, float)), key
    assert {"register", "invert", "rebuild", "encode", "journal"} <= set(run["stages_ms"])
    assert run["method"] == "condensed"
    assert run["mesh"]["nodes"] > 500
    assert run["updates"] >= 1
    assert run["full_solve_ms"] > 0.0
    assert run["stages_ms"]["invert"] > 0.0
    assert run["left_out"]


def test_prepare_tells_what_it_built(inputs):
    told = json.loads((inputs / "head" / "prepare.json").read_text())
    assert told["case"] == "colin27-coarse"
    assert told["mesh"]["nodes"] > 500
    for name in ("craniotomy", "brainstem", "slaves", "fixed"):
        assert told["sets"][name] > 0, name
    for boundary in ("contact", "fixed"):
        timings = told["prepare"][boundary]
        assert timings["factor_s"] > 0.0
        assert timings["factor_nonzeros"] > 0
    assert (inputs / "head" / "prepare.err").read_text() == ""


def test_the_simulated_surgery_of_the_paper_is_recovered(folder, daemon, paper):
    running = daemon()
    report, _ = replay(paper, running, folder / "report.json", "--boundary", "both")
    assert len(report) == 2
    for run in report:
        assert_contract(run)
        assert run["scenario"] == "paper"
    contact, fixed = with_boundary(report, "contact"), with_boundary(report, "fixed")
    cross = contact["error_mm"]["cross"]["mean"]
    assert cross < 0.2
    assert cross < 0.15 * contact["error_mm"]["initial"]["mean"]
    assert contact["recovery_pct"] > 85.0
    assert contact["contact"]["max_penetration_mm"] < 0.2
    assert contact["error_mm"]["craniotomy"]["mean"] < fixed["error_mm"]["craniotomy"]["mean"]
    assert running.end() == 0


def test_tumour_boundary_points_that_must_be_registered_first_are_recovered(folder, daemon):
    surgery = shared.simulate("paper-icp", folder / "paper-icp.surgery")
    running = daemon()
    report, _ = replay(surgery, running, folder / "report.json")
    contact = with_boundary(report, "contact")
    assert_contract(contact)
    assert contact["recovery_pct"] > 75.0
    assert contact["stages_ms"]["register"] > 0.0
    assert running.end(signal.SIGINT) == 0


def test_a_recorded_surgery_can_be_repeated_to_measure_latency(folder, daemon, paper):
    """Sequences that count on, a row per update, and the truth of the observation that was sent last."""
    running = daemon()
    latencies = folder / "latency.csv"
    runs, _ = replay(paper, running, folder / "report.json", "--boundary", "contact", "--method", "paper", "--repeat", "3",
                     "--latency-csv", latencies)
    assert len(runs) == 1
    assert runs[0]["updates"] == 3
    assert runs[0]["failures"] == []
    assert runs[0]["truth_scalars"]["fluid_level_mm"] == pytest.approx(55.0, rel=1e-15)
    assert runs[0]["recovery_pct"] > 85.0

    assert latencies.read_text().startswith("update,observation_sequence,latency_ms,")
    with open(latencies, newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 3
    assert (rows[-1]["update"], rows[-1]["observation_sequence"]) == ("3", "3")
    times = [float(row["latency_ms"]) for row in rows]
    assert times[0] == pytest.approx(runs[0]["cold_ms"], rel=0.0, abs=1e-3)
    assert max(times[1:]) == pytest.approx(runs[0]["latency_ms"]["max"], rel=0.0, abs=1e-3)
    assert running.end() == 0


def test_the_journal_holds_what_was_asked_and_answered(folder, daemon, paper):
    running = daemon()
    replay(paper, running, folder / "report.json", "--boundary", "both")
    assert running.end() == 0
    journals = list((folder / "journal").iterdir())
    assert len(journals) == 2, "one per session, and no leftovers of the write-ahead log"
    recorded = SurgeryFile(paper).payloads("observation")
    for path in journals:
        journal = SurgeryFile(path)
        assert journal.meta["case_id"] == "colin27-coarse"
        observations = journal.payloads("observation")
        assert len(observations) == len(recorded)
        # What was asked, with its session and the daemon's time.
        observation = pb.Observation.FromString(observations[0])
        assert observation.session.model_id == journal.meta["model_id"]
        assert observation.session.session_id > 0
        observation.ClearField("session")
        observation.ClearField("daemon_ns")
        assert observation.SerializeToString() == recorded[0]
        updates = journal.payloads("update")
        assert len(updates) == len(recorded)
        assert pb.Update.FromString(updates[0]).observation_sequence == pb.Observation.FromString(recorded[0]).sequence


def test_a_journal_is_checked_exported_and_repaired(folder, daemon, inputs, paper):
    """A session is recorded, checked, exported, damaged and mended, as a user does it."""
    running = daemon()
    replay(paper, running, folder / "report.json")
    assert running.end() == 0
    journal = sorted((folder / "journal").iterdir())[0]
    checked = good(command("journal", "check", paper, journal))
    for part in (f"{journal}: ", "records, closed", "checksums    all match"):
        assert part in checked.stdout

    rows, fields = folder / "records.csv", folder / "fields"
    good(command("journal", "export", journal, "--csv", rows, "--vtu", fields, "--model", inputs / "head" / "model.h5"))
    assert rows.exists()
    assert (fields / (journal.stem + ".pvd")).exists()

    damaged, mended = folder / "damaged.surgery", folder / "mended.surgery"
    shutil.copyfile(journal, damaged)
    os.truncate(damaged, damaged.stat().st_size * 9 // 10)
    broken = command("journal", "check", damaged)
    assert broken.returncode == 2
    assert str(damaged) in broken.stderr
    good(command("journal", "repair", damaged, "--out", mended))
    good(command("journal", "check", mended))
    assert command("journal", "repair", damaged, "--out", mended).returncode == 2, "nothing is replaced"


def test_a_field_on_the_case_s_mesh_becomes_a_surgery_with_this_truth(folder, daemon, inputs, paper):
    """An exported field is measured and scored; one on another mesh is refused in a line."""
    running = daemon()
    replay(paper, running, folder / "report.json", "--boundary", "contact")
    journal = next((folder / "journal").glob("*.surgery"))
    good(command("journal", "export", journal, "--vtu", folder / "fields", "--model", inputs / "head" / "model.h5"))
    field = next((folder / "fields").glob("*.vtu"))

    def simulate(truth, *more):
        return command("simulate", "--case", COARSE_CASE, "--truth", truth, "--out", folder / "mine.surgery", *more)

    refused(simulate(field, "--adverse", "gap"), "--adverse gap", "--truth")
    other = write(folder / "other.vtu", OTHER_MESH)
    refused(simulate(other), other, "has 4 points, the case's mesh has ")
    assert not (folder / "mine.surgery").exists()
    good(simulate(field))
    assert SurgeryFile(folder / "mine.surgery").meta["scenario"] == "joint-sag+truth"
    runs, _ = replay(folder / "mine.surgery", running, folder / "mine.json", "--boundary", "contact")
    assert "fluid_level_mm" not in runs[0]["truth_scalars"]
    assert runs[0]["recovery_pct"] > 80.0
    assert running.end() == 0


OTHER_MESH = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="1"><Points>
<DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 9 0 0 0 9 0 0 0 9</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells>
<PointData><DataArray type="Float64" Name="displacement" NumberOfComponents="3" format="ascii">
0 0 1 0 0 1 0 0 1 0 0 1</DataArray></PointData></Piece></UnstructuredGrid></VTKFile>
"""


def test_after_a_crash_the_replay_goes_on_to_the_same_final_field(folder, daemon):
    """A daemon is killed. Another one goes on where the journal ends, with the same final field."""
    surgery = shared.simulate("sag-progress", folder / "sag-progress.surgery")
    first = daemon()
    whole, _ = replay(surgery, first, folder / "whole.json", "--boundary", "contact")
    first.end(signal.SIGKILL)
    # What a crash after the third observation leaves.
    journal = next((folder / "journal").glob("*.surgery"))
    crashed = folder / "crashed.surgery"
    good(command("journal", "trim", journal, "--from", 1, "--to", 3, "--out", crashed))

    second = daemon()
    rest, resumed = replay(surgery, second, folder / "rest.json", "--boundary", "contact", "--resume", crashed)
    assert "goes on after observation 3 of " in resumed.stdout
    assert rest[0]["updates"] == whole[0]["updates"] - 2
    assert rest[0]["error_mm"] == whole[0]["error_mm"]
    fields = [folder / f"{name}-sag-progress-contact.vtu" for name in ("rest", "whole")]
    assert fields[0].read_bytes() == fields[1].read_bytes()
    assert second.end() == 0


def test_a_journal_is_verified_bit_for_bit(folder, daemon):
    """The same daemon gives the same bits again; a journal that says otherwise is found out."""
    surgery = shared.simulate("joint-sag", folder / "joint-sag.surgery")
    first = daemon()
    replay(surgery, first, folder / "report.json", "--boundary", "contact")
    assert first.end() == 0
    path = sorted((folder / "journal").iterdir())[0]
    journal = SurgeryFile(path)
    assert journal.meta["build"] and journal.meta["machine"]
    second = daemon()
    verified = good(command("replay", path, "--verify", "--endpoint", second.address))
    if journal.meta.get("blas_kernel"):
        assert "agree bit for bit" in verified.stdout
    assert "greatest difference 0 mm" in verified.stdout

    # Another observation than the one that was answered.
    other = folder / "other.surgery"
    shutil.copyfile(path, other)
    at = next(i for i, record in enumerate(journal.records) if record[1] == "observation")
    observation = pb.Observation.FromString(journal.records[at][-1])
    assert observation.HasField("tumour_boundary")
    points = observation.tumour_boundary.points.xyz_mm
    points[:] = [number + 0.1 for number in points]
    journal.records[at] = (*journal.records[at][:-1], observation.SerializeToString())
    journal.write_into(other)
    good(command("journal", "check", other))
    differs = command("replay", other, "--verify", "--endpoint", second.address)
    assert differs.returncode == 1
    assert "answers differ; the first: update 1 " in differs.stderr
    assert "displacement" in differs.stdout
    assert second.end() == 0


# ---------- without a model ----------


def test_without_a_model_the_daemon_runs_and_tells_clients_that_no_model_is_loaded(folder):
    with serve(folder) as daemon:
        with brainshift.connect(daemon.address) as client:
            assert not client.status().model_ready
            with pytest.raises(brainshift.Error) as caught:
                client.start_session("colin27-coarse", method="paper", boundary="contact", publish_iterates=False)
        assert caught.value.code == "model_not_ready"
        assert "no model is loaded" in caught.value.message
        assert daemon.end() == 0
