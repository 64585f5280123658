# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift export` as a user runs it, on a journal of the toy patient: the files that it leaves, and every bad input refused
with one line and no folder."""
import gzip
import json
import re
import shutil
import struct

import meshio
import numpy as np
import pytest
from programs import brainshift, good, refused, write
from recordings import motion

# Oblique, anisotropic and flipped, 75 mm wide, around the patient.
DIMS = (60, 50, 38)
AXES = motion((1, 2, 3), 0.2)[:3, :3] @ np.diag((-1.25, 1.5, 2.0))
MRI_TO_RAS = np.column_stack([AXES, np.full(3, 30.0) - AXES @ (30, 25, 19)])


def mri_bytes():
    """A NIfTI-1 volume of single-precision values, 0 to 250 again and again."""
    header = bytearray(352)
    for at, form, numbers in ((0, "i", (348, )), (40, "8h", (3, *DIMS, 1, 1, 1, 1)), (70, "2h", (16, 32)),
                              (76, "4f", (1.0, *np.linalg.norm(AXES, axis=0))), (108, "2f", (352.0, 1.0)), (123, "b", (2, )),
                              (252, "2h", (0, 1)), (280, "12f", MRI_TO_RAS.ravel()), (344, "4s", (b"n+1\0", ))):
        struct.pack_into("<" + form, header, at, *numbers)
    return gzip.compress(bytes(header) + (np.arange(np.prod(DIMS)) % 251).astype("<f4").tobytes())


def read_grid(path):
    """Size of a NIfTI-1 volume, and the matrix (3, 4) from voxels to RAS."""
    header = gzip.decompress(path.read_bytes())[:348]
    assert header[344:347] == b"n+1" and struct.unpack_from("<h", header, 254)[0] > 0
    return struct.unpack_from("<3h", header, 42), np.array(struct.unpack_from("<12f", header, 280)).reshape(3, 4)


@pytest.fixture
def export(folder, inputs):
    """The command with more options, on a folder with a.surgery, m.h5 and mri.nii.gz."""
    for name in ("a.surgery", "m.h5"):
        shutil.copy(inputs / "toy" / name, folder)
    write(folder / "mri.nii.gz", mri_bytes())
    return lambda *more: brainshift("export", folder / "a.surgery", "--model", folder / "m.h5", "--out", folder / "out", *more)


def assert_refused(folder, done, says):
    refused(done, says)
    assert done.stdout == ""
    assert not (folder / "out").exists()
    assert not [path for path in folder.iterdir() if "partial" in path.name]


def test_export_warps_the_mri_onto_its_own_grid(folder, export):
    mri = folder / "mri.nii.gz"
    done = good(export("--direction", "resampling", "--like", mri, "--image", mri))
    assert done.stderr == ""
    for part in ("update 2, quality caution, direction resampling", "60 x 50 x 38 voxels of 1.25 x 1.5 x 2 mm",
                 "warped-mri.nii.gz"):
        assert part in done.stdout
    dims, to_ras = read_grid(folder / "out" / "warped-mri.nii.gz")
    assert dims == DIMS
    assert np.linalg.norm(to_ras - MRI_TO_RAS) <= 1e-6 * np.linalg.norm(MRI_TO_RAS)
    manifest = json.loads((folder / "out" / "export.json").read_text())
    assert len(manifest["files"]) == 10
    for file in manifest["files"]:
        assert (folder / "out" / file["file"]).exists(), file


def test_export_of_modeling_around_the_brain_with_the_series(folder, export):
    done = good(export("--direction", "modeling", "--sequence", "1", "--spacing-mm", "3", "--formats", "nrrd,series"))
    assert "update 1, quality good, direction modeling" in done.stdout
    assert (folder / "out" / "displacement.nrrd").exists()
    assert (folder / "out" / "series" / "a.pvd").exists()
    field = folder / "out" / "series" / "a-000002.vtu"
    # meshio 5 refuses strings in the field data, where our files say that their points are RAS.
    field.write_text(re.sub("<FieldData>.*</FieldData>", "", field.read_text(), flags=re.DOTALL))
    assert len(meshio.read(field).cells_dict["tetra"]) > 0
    assert not (folder / "out" / "displacement.h5").exists()


def test_export_of_an_unusable_update_only_when_it_is_allowed(folder, export):
    assert_refused(folder, export("--direction", "modeling", "--sequence", "3"), "update 3 is unusable")
    good(export("--direction", "modeling", "--sequence", "3", "--allow-unusable"))
    assert (folder / "out" / "unusable-displacement.h5").exists()


def test_bad_input_of_export_is_refused_with_one_line(folder, export):
    assert_refused(folder, export(), "--direction is missing and is never implied")
    assert_refused(folder, export("--direction", "both"), '"both": must be resampling or modeling')
    for more, says in (
            (("--sequence", "9"), "holds no update 9: has 1 to 3"),
            (("--allow-unusable", ), "needs --sequence N"),
            (("--spacing-mm", "0.2"), "--spacing-mm"),
            (("--spacing-mm", "nan"), "--spacing-mm"),
            (("--like", folder / "none.nii"), "none.nii"),
            (("--like", folder / "a.surgery"), "a.surgery"),
            (("--image", write(folder / "text.nii.gz", "text")), "text.nii.gz"),
            (("--model", folder / "a.surgery"), "--model"),
    ):
        assert_refused(folder, export("--direction", "resampling", *more), says)


def test_export_does_not_touch_what_exists(folder, export):
    (folder / "out").mkdir()
    mine = write(folder / "out" / "mine.txt", "mine")
    done = export("--direction", "modeling")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert f"--out: {folder / 'out'}: is not empty" in done.stderr
    assert mine.exists()
