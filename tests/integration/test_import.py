# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift import` as a user runs it: a recorded sweep becomes a surgery that the daemon answers, and bad input exits 2 with
one line that names what is wrong and leaves nothing behind."""
import json
import os

import numpy as np
import pytest
from programs import COARSE_CASE, brainshift, good, refused, serve, write
from recordings import Sequence, matrix, matrix_text


@pytest.fixture
def model(inputs):
    return inputs / "head" / "model.h5"


@pytest.fixture
def options(folder, inputs):
    """Of an import of the sweep over the coarse case's tumour, 2 mm lower; one that is None is not given."""
    sweep = inputs / "sweep"
    return {"--recording": sweep / "sweep.igs.mha", "--device": sweep / "device.xml", "--contours": sweep / "contours.csv",
            "--registration": sweep / "registration.txt", "--case": COARSE_CASE, "--out": folder / "sweep.surgery"}


def import_with(options, **more):
    options = {**options, **more}
    return brainshift("import", *(word for option, value in options.items() if value is not None for word in (option, value)))


def assert_answered(folder, model, surgery, recorded):
    """The daemon with this model answers every observation of the surgery once, under the name of what was recorded."""
    with serve(folder, model=model) as daemon:
        good(brainshift("replay", surgery, "--endpoint", daemon.address, "--report", folder / "r.json"))
    report = json.loads((folder / "r.json").read_text())
    assert len(report) == 1
    for run in report:
        assert run["updates"] == 1
        assert run["scenario"] == os.path.splitext(recorded)[0]


def assert_refused(folder, options, says, **more):
    done = import_with(options, **more)
    refused(done, says)
    assert done.stdout == ""
    for suffix in ("", "-wal", "-shm"):
        assert not (folder / f"sweep.surgery{suffix}").exists()


def test_import_makes_a_surgery_that_the_daemon_answers(folder, options, model):
    imported = good(import_with(options, **{"--case": None, "--model": model}))
    assert "frames: 21 of 21 with a valid chain" in imported.stdout
    assert "sweep 1: frames 0 to 20, 21 contours" in imported.stdout
    assert_answered(folder, model, folder / "sweep.surgery", "sweep.igs.mha")


def test_landmarks_make_a_surgery_that_the_daemon_answers(folder, model):
    before = write(folder / "before.fcsv", "# CoordinateSystem = LPS\n1,-30,45,20,0,0,0,1,1,1,0,a,,\n"
                   "2,-50,40,30,0,0,0,1,1,1,0,b,,\n3,-45,60,0,0,0,0,1,1,1,0,c,,\n4,-40,20,10,0,0,0,1,1,1,0,d,,\n")
    points = {"d": [40, -20, 9], "c": [45, -60, -2], "b": [50, -41, 27], "a": [30, -45, 18]}
    during = write(folder / "during.mrk.json", json.dumps({"markups": [{
        "type": "Fiducial", "coordinateSystem": "RAS",
        "controlPoints": [{"label": label, "position": position} for label, position in points.items()]}]}))
    surgery = folder / "landmarks.surgery"
    imported = good(brainshift("import", "--landmarks", before, "--landmarks-moved", during, "--model", model, "--out",
                               surgery))
    assert "landmarks: 4 pairs, moved 2.04 mm on average" in imported.stdout
    assert "rigid part: rotation" in imported.stdout
    assert_answered(folder, model, surgery, "before.fcsv")


def test_a_registration_from_a_stylus_gives_the_same_sweep(folder, options, model):
    """The registration of a stylus that was held still on four fiducials is as good as the one that the scene was made with."""
    T_reference_ras = np.linalg.inv(matrix(options["--registration"].read_text()))
    frames, ras = [], "name,x,y,z\n"
    for at in ((0, 95, 0), (-70, 10, -20), (75, 5, -15), (10, 20, 90)):
        ras += "f,{},{},{}\n".format(*at)
        T_reference_tip = np.eye(4)
        T_reference_tip[:3, 3] = (T_reference_ras @ (*at, 1.0))[:3]
        for _ in range(30):
            frames.append({"Timestamp": f"{0.05 * len(frames):f}", "StylusTipToReferenceTransformStatus": "OK",
                           "StylusTipToReferenceTransform": matrix_text(T_reference_tip)})
    out = folder / "T_ras_reference.txt"
    registered = good(brainshift("register", "--recording", write(folder / "stylus.igs.mha", Sequence(frames=frames).text()),
                                 "--ras", write(folder / "ras.csv", ras), "--pair", "order", "--model", model, "--out", out))
    assert "held still 4: " in registered.stdout
    assert "expected error at the tumour 0.00 mm rms" in registered.stdout
    with_model = {**options, "--case": None, "--model": model}
    expected = good(import_with(with_model))
    again = good(import_with(with_model, **{"--registration": out, "--out": folder / "again.surgery"}))
    assert again.stdout.splitlines()[:-1] == expected.stdout.splitlines()[:-1]
    assert again.stdout.splitlines()[-1] == f"wrote {folder / 'again.surgery'}"


def test_bad_options_exit_two_with_one_line(folder, options):
    for option, value, says in (
            ("--recording", None, "--recording is required"),
            ("--recording", folder / "none.mha", "none.mha"),
            ("--recording", write(folder / "bad.mha", "nonsense"), "bad.mha"),
            ("--device", write(folder / "bad.xml", "<a>"), "bad.xml"),
            ("--device", None, "no chain from Image to Ras"),
            ("--contours", write(folder / "bad.csv", "1,2\n"), "bad.csv: line 1"),
            ("--seeds", write(folder / "s.csv", "1,2,3\n"), "exactly one of --contours and --seeds"),
            ("--registration", write(folder / "bad.txt", "1 2 3"), "T_ras_reference has 3 numbers"),
            ("--case", folder / "none.yaml", "none.yaml"),
            ("--sd-mm", "-1", "--sd-mm -1"),
            ("--latency-ms", "soon", "--latency-ms"),
            ("--orientation-of-mars", "MF", "--orientation-of-mars"),
            ("--image", "Picture", "no chain from Picture to Ras"),
    ):
        assert_refused(folder, options, says, **{option: value})


def test_bad_recordings_exit_two_naming_frame_and_field(folder, options):
    def lose_a_time(bad):
        del bad.frames[5]["Timestamp"]

    def turn_the_clock_back(bad):
        bad.frames[5]["Timestamp"] = "1.0"

    def damage_a_matrix(bad):
        bad.frames[7]["ProbeToTrackerTransform"] = "1 2 3"

    def lose_pixels(bad):
        bad.pixels = bad.pixels[:1000]

    def lose_the_orientation(bad):
        bad.fields.clear()

    def lose_the_probe(bad):
        for frame in bad.frames:
            frame["ProbeToTrackerTransformStatus"] = "INVALID"

    for change, says in (
            (lose_a_time, "frame 5: Seq_Frame0005_Timestamp is missing"),
            (turn_the_clock_back, "the clock runs backwards"),
            (damage_a_matrix, "frame 7: Seq_Frame0007_ProbeToTrackerTransform is not 16 numbers"),
            (lose_pixels, "pixels"),
            (lose_the_orientation, "UltrasoundImageOrientation is missing"),
            (lose_the_probe, "ProbeToTracker is invalid (21 frames, first 0)"),
    ):
        bad = Sequence.read(options["--recording"])
        change(bad)
        assert_refused(folder, options, says, **{"--recording": write(folder / "bad.mha", bad.text())})


def test_a_far_boundary_exits_two_with_the_distance(folder, options):
    far = matrix(options["--registration"].read_text())
    far[2, 3] += 300.0
    assert_refused(folder, options, "mm from the tumour of case colin27-coarse",
                   **{"--registration": write(folder / "far.txt", matrix_text(far))})


def test_a_registration_is_from_fiducials_or_from_ultrasound(folder):
    shared = ("register", "--target", "1", "2", "3", "--out", folder / "T.txt")
    ultrasound = (*shared, "--ultrasound", folder / "us.mha")
    for words, says in (
            ((*ultrasound, "--ras", "a.csv"), "--ras is for fiducials"),
            ((*ultrasound, "--still-s", "2"), "--still-s is for fiducials"),
            ((*shared, "--fiducials", "f.csv", "--mri", "t1.nii"), "--mri is for --ultrasound"),
            (ultrasound, "--mri is required with --ultrasound"),
            ((*ultrasound, "--mri", "t1.nii"), "--registration is required with --ultrasound"),
            ((*ultrasound, "--picture", folder / "no" / "T.png"), "--picture"),
    ):
        refused(brainshift(*words), says)
        assert not (folder / "T.txt").exists()
    shown = good(brainshift("register", "--help")).stdout
    for part in ("From fiducials", "From ultrasound, before the dura is opened", "--ultrasound", "brainshift import"):
        assert part in shown


def test_help_of_import_teaches():
    shown = good(brainshift("import", "--help")).stdout
    for part in ("Example:", "--recording", "--registration", "--seeds", "brainshift replay"):
        assert part in shown
