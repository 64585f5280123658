# SPDX-License-Identifier: GPL-3.0-or-later
"""The tumour of a case from label maps of 3D Slicer.

One tumour is written as NIfTI and as NRRD, on a grid that both formats hold without rounding: the
models prepared of both must be the same to the last bit. VTK, which has a reader of its own, must
find the same voxels in the NRRD.
"""
import gzip
import sqlite3
import struct

import numpy
import pytest
from conftest import SOURCE, run
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkNrrdReader

CASE = SOURCE / "config" / "cases" / "colin27-coarse.yaml"
CENTRE, SEMI_AXES = numpy.array([46.0, -47.0, 9.0]), numpy.array([16.0, 13.5, 12.146617])


def ellipsoid():
    """The coarse case's tumour as labels of a sheared, left-handed grid, and its affine to RAS."""
    affine = numpy.eye(4)
    affine[:3, :3] = [[-1.0, 0.25, 0.0], [0.5, 1.25, 0.0], [0.0, 0.125, 1.5]]
    affine[:3, 3] = CENTRE - affine[:3, :3] @ [24, 22, 13]
    index = numpy.stack(numpy.meshgrid(*map(numpy.arange, (49, 45, 27)), indexing="ij"), -1)
    ras = index @ affine[:3, :3].T + affine[:3, 3]
    return ((((ras - CENTRE) / SEMI_AXES) ** 2).sum(-1) < 1).astype(numpy.uint8), affine


def nifti(labels, affine):
    """Offsets of nifti1.h."""
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *labels.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 2, 8)  # uint8
    struct.pack_into("<8f", header, 76, 1, *numpy.linalg.norm(affine[:3, :3], axis=0), 1, 1, 1, 1)
    struct.pack_into("<2f", header, 108, 352, 1)  # vox_offset, scl_slope
    header[123] = 2  # mm
    struct.pack_into("<h", header, 254, 1)  # sform_code
    struct.pack_into("<12f", header, 280, *affine[:3].ravel())
    header[344:348] = b"n+1\0"
    return bytes(header) + labels.tobytes(order="F")


def vector(values):
    return "(" + ",".join(repr(float(value)) for value in values) + ")"


def nrrd(layers, affine, keys="", compressed=True):
    """As Slicer writes it: LPS, layers (where there are several) along the first axis."""
    lps = numpy.diag([-1.0, -1.0, 1.0, 1.0]) @ affine
    directions, kinds = [vector(lps[:3, axis]) for axis in range(3)], ["domain"] * 3
    values = layers[0]
    if len(layers) > 1:
        values, directions, kinds = numpy.stack(layers), ["none", *directions], ["list", *kinds]
    data = values.tobytes(order="F")
    header = (f"NRRD0004\n# made by a test\ntype: unsigned char\ndimension: {values.ndim}\n"
              f"space: left-posterior-superior\nsizes: {' '.join(map(str, values.shape))}\n"
              f"space directions: {' '.join(directions)}\nkinds: {' '.join(kinds)}\n"
              f"encoding: {'gzip' if compressed else 'raw'}\nspace origin: {vector(lps[:3, 3])}\n{keys}\n")
    return header.encode() + (gzip.compress(data) if compressed else data)


def model_of(folder, content, name, more=""):
    """The id of the model of the coarse case with this label map: a hash of mesh and surfaces."""
    (folder / name).write_bytes(content)
    text = CASE.read_text()
    start = text.index("tumour:\n")
    case = folder / "case.yaml"
    case.write_text(f"{text[:start]}tumour:\n  label_volume: {{file: {folder / name}{more}}}\n"
                    f"{text[text.index('craniotomy:', start):]}")
    (folder / "pairs.csv").write_text("46,-47,9,46,-47,8\n50,-47,9,50,-47,8\n46,-40,9,46,-40,8\n")
    run("brainshift", "import", "--landmarks", folder / "pairs.csv", "--case", case, "--out", folder / "x.surgery")
    with sqlite3.connect(folder / "x.surgery") as database:
        return dict(database.execute("SELECT key, value FROM meta"))["model_id"]


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    labels, affine = ellipsoid()
    return model_of(tmp_path_factory.mktemp("nifti"), nifti(labels, affine), "labels.nii")


def test_a_segmentation_gives_the_model_of_the_nifti(tmp_path, expected):
    labels, affine = ellipsoid()
    keys = "Segment0_Name:=Mass\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
    assert model_of(tmp_path, nrrd([labels], affine, keys), "one.seg.nrrd") == expected


def test_a_segment_that_overlaps_is_chosen_by_name(tmp_path, expected):
    labels, affine = ellipsoid()
    keys = ("Segment0_Name:=Head\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
            "Segment1_Name:=Mass\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n")
    content = nrrd([numpy.ones_like(labels), labels], affine, keys)
    assert model_of(tmp_path, content, "two.seg.nrrd", ", segment: Mass") == expected


def test_a_tumour_that_is_moved_gives_another_model(tmp_path, expected):
    labels, affine = ellipsoid()
    affine[0, 3] += 0.25
    assert model_of(tmp_path, nrrd([labels], affine), "moved.nrrd") != expected


def test_vtk_finds_the_same_voxels(tmp_path):
    labels, affine = ellipsoid()
    (tmp_path / "map.nrrd").write_bytes(nrrd([labels], affine, compressed=False))
    reader = vtkNrrdReader()
    reader.SetFileName(str(tmp_path / "map.nrrd"))
    reader.Update()
    image = reader.GetOutput()
    assert image.GetDimensions() == labels.shape
    assert numpy.allclose(image.GetSpacing(), numpy.linalg.norm(affine[:3, :3], axis=0))
    values = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(labels.shape, order="F")
    assert numpy.array_equal(values, labels)
