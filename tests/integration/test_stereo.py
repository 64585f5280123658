# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift stereo` as a user runs it: boards and a patch drawn by known cameras, over the toy patient's craniotomy; and
every bad input refused with one line."""
import re
import shutil

import meshio
import numpy as np
import pytest
from programs import brainshift, good, refused, write
from recordings import SurgeryFile

import brainshift as client

# The rig 250 mm above the middle of the toy patient's craniotomy, (30, 30, 60), looking down.
POSE = "1 0 0 30\n0 -1 0 30\n0 0 -1 310\n0 0 0 1\n"


def patch_depth(x, y):
    """z(x, y) of the patch in the left camera's frame: patch_depth of tests/support/stereo_scene.cpp."""
    cap = (x * x + y * y) / (2.0 * 80.0)
    gyri = np.sin(2.0 * np.pi * x / 14.0 + 0.5) * np.cos(2.0 * np.pi * y / 19.0)
    return 250.0 + 0.1 * x - 0.06 * y + cap + gyri


def place(folder, inputs):
    """left.pgm, right.pgm, calibration.yaml, pose.txt, the model, and an empty folder out."""
    for name in ("left.pgm", "right.pgm", "calibration.yaml", "model.h5"):
        shutil.copy(inputs / "stereo" / name, folder)
    write(folder / "pose.txt", POSE)
    (folder / "out").mkdir()


def reconstruct(folder, *more, calibration="calibration.yaml"):
    return brainshift("stereo", "reconstruct", "--left", folder / "left.pgm", "--right", folder / "right.pgm", "--calibration",
                      folder / calibration, "--pose", folder / "pose.txt", "--out", folder / "out" / "cortex.ply", *more)


def observe(folder, surface, *more, sd_mm="0.5"):
    return brainshift("stereo", "observe", "--surface", surface, "--model", folder / "model.h5", "--sd-mm", sd_mm, "--out",
                      folder / "out" / "case.surgery", *more)


def points_text(scale=1.0, shift=0.0, count=200):
    """A grid of points on the toy patient's craniotomy, 2.5 mm below it."""
    return "".join(f"{scale * (20 + i % 20):f} {scale * (20 + i // 10):f} {scale * (57.5 + shift):f}\n" for i in range(count))


def observations_of(path):
    records = [record for record in SurgeryFile(path).records if record[1] == "observation"]
    with client.Surgery(path) as surgery:
        observations = list(surgery.observations())
    assert [record[2:4] for record in records] == [(each.sequence, each.acquired_ns) for each in observations]
    return observations


def test_pictures_become_observations_of_a_surgery(folder, inputs):
    place(folder, inputs)
    made = good(reconstruct(folder, "--disparity-png", folder / "out" / "disparity.png"))
    assert "% of the pixels matched" in made.stdout
    assert (folder / "out" / "disparity.png").stat().st_size > 20000
    surface = meshio.read(folder / "out" / "cortex.ply")
    x, y, z = surface.points.T
    assert np.sqrt(np.mean((310.0 - z - patch_depth(x - 30.0, 30.0 - y))**2)) < 0.6

    # A new surgery, and one more observation, of points only, later.
    first = good(observe(folder, folder / "out" / "cortex.ply"))
    assert first.stdout.startswith("observation 1 at 0 s: ")
    points = write(folder / "points.xyz", points_text())
    second = good(observe(folder, points, "--time-s", "12.5", "--source", "scanner"))
    assert second.stdout.startswith("observation 2 at 12.5 s: 200 points, 0 triangles")

    cortex, later = observations_of(folder / "out" / "case.surgery")
    assert np.array_equal(cortex.body.vertices, surface.points)
    assert np.array_equal(cortex.body.triangles, surface.cells_dict["triangle"])
    assert cortex.body.sd_mm == 0.5
    assert cortex.source == "stereopsis"
    assert later.source == "scanner"
    assert later.acquired_ns == 12_500_000_000

    # Time goes forward, and a surgery belongs to one model.
    refused(observe(folder, points, "--time-s", "12.5"), "case.surgery: --time-s 12.5: must be above 12.5")
    shutil.copy(inputs / "stereo" / "other.h5", folder / "model.h5")
    refused(observe(folder, points), 'case.surgery: model_id is "')
    assert len(observations_of(folder / "out" / "case.surgery")) == 2
    # Only the sources that a surgery has can be played by themselves.
    refused(brainshift("replay", folder / "out" / "case.surgery", "--sources", "ius", "--report", folder / "r.json"),
            'holds no observation of source "ius"; it has: scanner, stereopsis')


def translation_mm(calibration):
    """Of T_right_left: as long as the way from one camera to the other."""
    return np.array(re.search(r"translation_mm: \[(.*)\]", calibration.read_text())[1].split(","), dtype=float)


def test_boards_become_a_calibration(folder, inputs):
    place(folder, inputs)
    boards = inputs / "stereo"

    def calibrate(left, right, board="9x6"):
        return brainshift("stereo", "calibrate", "--left", boards / left, "--right", boards / right, "--board", board,
                          "--square-mm", "8", "--out", folder / "c.yaml")

    refused(calibrate("r?.pgm", "l?.pgm"), "left and right are swapped")
    refused(calibrate("l?.pgm", "r[0-4].pgm"), "6 left and 5 right pictures: must be as many")
    refused(calibrate("l[0-3].pgm", "r[0-3].pgm"), "found in 4 pairs: at least 5 are needed")
    refused(calibrate("l?.pgm", "r?.pgm", "9by6"), "--board 9by6")
    refused(calibrate("x*.pgm", "r?.pgm"), "x*.pgm: no file of this name or pattern")
    assert not (folder / "c.yaml").exists()
    made = good(calibrate("l?.pgm", "r?.pgm"))
    assert "6 pairs used, 0 without a whole board" in made.stdout
    lengths = [np.linalg.norm(translation_mm(file)) for file in (folder / "c.yaml", folder / "calibration.yaml")]
    assert lengths[0] == pytest.approx(lengths[1], rel=0.0, abs=0.2)
    good(reconstruct(folder, calibration="c.yaml"))


# ---------- bad pairs ----------


def swap_pictures(folder):
    (folder / "left.pgm").rename(folder / "t.pgm")
    (folder / "right.pgm").rename(folder / "left.pgm")
    (folder / "t.pgm").rename(folder / "right.pgm")


def blank(width, height):
    return b"P5\n%d %d\n255\n" % (width, height) + bytes([128]) * (width * height)


def blank_pictures(folder):
    write(folder / "left.pgm", blank(640, 480))
    write(folder / "right.pgm", blank(640, 480))


def widen_calibration(folder):
    file = folder / "calibration.yaml"
    text = file.read_text()
    assert "width_px: 640" in text
    file.write_text(text.replace("width_px: 640", "width_px: 800"))


def invert_calibration(folder):
    """T_right_left becomes T_left_right."""
    file = folder / "calibration.yaml"
    text = file.read_text()
    found = re.search(r"rotation: \[(.*)\]", text)
    R, t = np.array(found[1].split(","), dtype=float).reshape(3, 3), translation_mm(file)
    text = text.replace(found[0], f"rotation: {R.T.ravel().tolist()}")
    file.write_text(re.sub(r"translation_mm: .*", f"translation_mm: {(-R.T @ t).tolist()}", text))


def writing(name, content):
    return lambda folder: write(folder / name, content)


def removing(name):
    return lambda folder: (folder / name).unlink()


BAD_PAIRS = {
    "Swapped": (swap_pictures, "left.pgm: left and right pictures are swapped"),
    "NoTexture": (blank_pictures, "0.0 % of the pixels have a consistent match"),
    "UnequalSizes": (writing("right.pgm", blank(320, 240)),
                     "the right picture has 320 x 240 px: the calibration is for 640 x 480 px"),
    "CalibrationOfAnotherSize": (widen_calibration, "the left picture has 640 x 480 px: the calibration is for 800 x 480 px"),
    "CalibrationSwapped": (invert_calibration, "left and right are swapped"),
    "PoseNotRigid": (writing("pose.txt", "1 0 0 0 0 1 0 0 0 0 2 0 0 0 0 1"), "pose.txt: T_ras_camera is no rigid motion"),
    "PoseEmpty": (writing("pose.txt", ""), "pose.txt: T_ras_camera has 0 numbers"),
    "PictureEmpty": (writing("left.pgm", ""), "left.pgm: is empty"),
    "PictureNone": (writing("right.pgm", "no picture"), "right.pgm: is no picture that can be read"),
    "PictureAbsent": (removing("left.pgm"), "left.pgm"),
    "CalibrationEmpty": (writing("calibration.yaml", ""), "calibration.yaml: is not a YAML mapping"),
    "CalibrationAbsent": (removing("calibration.yaml"), "calibration.yaml"),
}


@pytest.mark.parametrize("bad", BAD_PAIRS.values(), ids=BAD_PAIRS)
def test_a_bad_stereo_pair_exits_two_with_one_line_and_leaves_nothing_behind(folder, inputs, bad):
    spoil, says = bad
    place(folder, inputs)
    spoil(folder)
    refused(reconstruct(folder), says)
    assert not any((folder / "out").iterdir())


def test_a_bad_surface_exits_two_with_one_line_and_makes_no_surgery(folder, inputs):
    place(folder, inputs)

    def points(**how):
        return write(folder / "points.xyz", points_text(**how))

    for surface, says in (
            (lambda: points(scale=0.001), "metres?"),
            (lambda: points(shift=200.0), "from the craniotomy's centre"),
            (lambda: points(count=49), "has 49 points"),
            (lambda: write(folder / "empty.ply", ""), "empty.ply: is not a PLY file"),
            (lambda: folder / "absent.ply", "absent.ply"),
    ):
        refused(observe(folder, surface()), says)
        assert not any((folder / "out").iterdir()), says
    refused(observe(folder, points(), sd_mm="-1"), "--sd-mm -1: must be finite and > 0")
    refused(observe(folder, points(), "--time-s", "-2"), "--time-s -2: must be between 0 and 1e+06")


def test_help_of_stereo_teaches_and_missing_options_are_named():
    for part in ("calibrate", "reconstruct", "observe"):
        shown = good(brainshift("stereo", part, "--help")).stdout
        assert f"brainshift stereo {part}" in shown
        assert "Example" in shown
        refused(brainshift("stereo", part), "is required")
