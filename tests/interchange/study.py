#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported fields in the programs that they are for.

study.py --bin BIN --out OUT: OUT holds a.surgery and model.h5 (interchange_case) and the tables of
cmake/scripts/steps.sh. Images on an oblique, anisotropic, flipped grid, written by nibabel, are warped
by `brainshift export` and by every program through every format that it reads. Where images hold the
coordinates of their voxels, warped values are places in mm.
"""
import argparse
import itertools
import json
import shutil
import subprocess
from pathlib import Path

import nibabel
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

LPS_RAS = np.diag([-1.0, -1.0, 1.0])
MESH = ".vtu as VTK 9.1 reads it"
BLOB_MM = np.array([32.0, 27.0, 33.0])
MOST_MM = 0.01
MOST_INTENSITY = 1e-3  # of the image's range


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]}: {(done.stderr or done.stdout).strip()[-400:]}")
    return done.stdout


class Records:
    def __init__(self, folder):
        self.folder = folder

    def _append(self, table, *cells):
        assert not any(c in str(cell) for cell in cells for c in ',"\n'), cells
        with open(self.folder / table, "a") as out:
            out.write(",".join(str(cell) for cell in cells) + "\n")

    def check(self, name, value, most, source):
        self._append("checks.csv", "interchange", name, f"{value:.9g}", f"<= {most:g}", int(value <= most), source)

    def at_least(self, name, value, least, source):
        self._append("checks.csv", "interchange", name, f"{value:.9g}", f">= {least:g}", int(value >= least), source)

    def figure(self, name, value, source):
        self._append("checks.csv", "interchange", name, f"{value:.9g}", "shown", "", source)

    def left_out(self, reason):
        self._append("left_out.csv", "interchange", reason)


class Grid:
    """Oblique, anisotropic and flipped, around the 60 mm brain."""

    def __init__(self):
        self.dims = np.array([118, 84, 52])
        spacing = np.array([0.9, 1.2, 1.9])
        a, b, c = 0.35, -0.25, 0.6
        turn = (
            np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
            @ np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
            @ np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
        )
        turn[:, 0] *= -1.0
        self.affine = np.eye(4)
        self.affine[:3, :3] = turn * spacing
        self.affine[:3, 3] = 30.0 - self.affine[:3, :3] @ ((self.dims - 1) / 2)
        index = np.stack(np.meshgrid(*map(np.arange, self.dims), indexing="ij"), axis=-1)
        self.places = index @ self.affine[:3, :3].T + self.affine[:3, 3]

    def index_of(self, places):
        return (places - self.affine[:3, 3]) @ np.linalg.inv(self.affine[:3, :3]).T

    def trilinear(self, values, places):
        """values: dims (+ components); places whose eight voxels all exist."""
        index = self.index_of(places)
        low = np.clip(np.floor(index).astype(int), 0, self.dims - 2)
        part = index - low
        total = 0.0
        for corner in itertools.product((0, 1), repeat=3):
            weight = np.prod(np.where(corner, part, 1 - part), axis=-1)
            at = low + corner
            total = total + weight[..., None] * values[at[..., 0], at[..., 1], at[..., 2]]
        return total


def images_of(grid, out):
    """name -> path; written with nibabel."""
    x, y, z = np.moveaxis(grid.places, -1, 0)
    blob = 1000.0 * np.exp(-((grid.places - BLOB_MM) ** 2).sum(axis=-1) / (2 * 4.0**2))
    contents = {
        "x": x, "y": y, "z": z, "blob": blob,
        "texture": 500 + 220 * np.sin(x / 6) * np.cos(y / 7) + 180 * np.sin(z / 5 + x / 11),
    }
    paths = {}
    for name, values in contents.items():
        paths[name] = out / f"{name}.nii.gz"
        image = nibabel.Nifti1Image(values.astype(np.float32), grid.affine)
        image.set_qform(grid.affine, 1)
        image.set_sform(grid.affine, 1)
        image.header.set_xyzt_units("mm")
        nibabel.save(image, paths[name])
    return paths


def load(path):
    return np.asarray(nibabel.load(path).dataobj, dtype=np.float64)


def itk(arguments):
    program = arguments.bin / "interchange_itk"

    def warp(field, image, result, _grid):
        run(program, image, field, result)
        return result

    return warp


def transformix(_arguments):
    def numbers(values):
        return " ".join(f"{value:.17g}" for value in np.ravel(values))

    def warp(field, image, result, grid):
        folder = Path(str(result) + ".transformix")
        folder.mkdir()
        axes = LPS_RAS @ grid.affine[:3, :3]
        spacing = np.linalg.norm(axes, axis=0)
        (folder / "transform.txt").write_text(
            f"""(Transform "DeformationFieldTransform")
(NumberOfParameters 0)
(DeformationFieldFileName "{field}")
(DeformationFieldInterpolationOrder 1)
(InitialTransformParametersFileName "NoInitialTransform")
(HowToCombineTransforms "Compose")
(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(Size {numbers(grid.dims)})
(Index 0 0 0)
(Spacing {numbers(spacing)})
(Origin {numbers(LPS_RAS @ grid.affine[:3, 3])})
(Direction {numbers((axes / spacing).T)})
(UseDirectionCosines "true")
(ResampleInterpolator "FinalBSplineInterpolator")
(FinalBSplineInterpolationOrder 1)
(Resampler "DefaultResampler")
(DefaultPixelValue 0)
(ResultImageFormat "nii.gz")
(ResultImagePixelType "float")
(CompressResultImage "true")
"""
        )
        run("transformix", "-in", image, "-out", folder, "-tp", folder / "transform.txt")
        return folder / "result.nii.gz"

    return warp


def plastimatch(_arguments):
    def warp(field, image, result, _grid):
        run("plastimatch", "warp", "--input", image, "--output-img", result, "--xf", field,
            "--interpolation", "linear", "--default-value", "0", "--output-type", "float")
        return result

    return warp


def vtk_file(path):
    reader = vtk.vtkXMLUnstructuredGridReader() if path.suffix == ".vtu" else vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def says_ras(data):
    space = data.GetFieldData().GetAbstractArray("SPACE")
    return space is not None and space.GetNumberOfValues() == 1 and space.GetValue(0) == "RAS"


def mesh_field(mesh, grid):
    """The mesh's displacement on the grid, and which voxels lie in the mesh: tetrahedron by tetrahedron.

    Not vtkProbeFilter: it takes points up to a thousandth of a cell outside of it for points inside, which is worth
    0.0002 mm here.
    """
    nodes = vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
    u = vtk_to_numpy(mesh.GetPointData().GetArray("displacement")).astype(float)
    tets = vtk_to_numpy(mesh.GetCells().GetConnectivityArray()).reshape(-1, 4)
    index_of_node = grid.index_of(nodes)
    field, inside = np.zeros((*grid.dims, 3)), np.zeros(tuple(grid.dims), dtype=bool)
    for tet in tets:
        corners = index_of_node[tet]
        low = np.maximum(np.ceil(corners.min(axis=0)).astype(int), 0)
        high = np.minimum(np.floor(corners.max(axis=0)).astype(int) + 1, grid.dims)
        if (low >= high).any():
            continue
        box = np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), axis=-1).reshape(-1, 3)
        weights = (box - corners[0]) @ np.linalg.inv((corners[1:] - corners[0]))
        weights = np.c_[1 - weights.sum(axis=1), weights]
        held = (weights >= 0).all(axis=1)
        at = tuple(box[held].T)
        field[at], inside[at] = weights[held] @ u[tet], True
    return field, inside


def deformed(mesh):
    mesh.GetPointData().SetActiveVectors("displacement")
    warp = vtk.vtkWarpVector()
    warp.SetInputData(mesh)
    warp.Update()
    return warp.GetOutput()


def export(arguments, direction, *more):
    folder = arguments.out / direction
    run(arguments.bin / "brainshift", "export", arguments.out / "a.surgery", "--model", arguments.out / "model.h5",
        "--direction", direction, "--formats", "all", "--out", folder, *more)
    return folder


def field_ras(folder):
    """Five-dimensional NIfTI with intent 1006 -> dims x 3, RAS."""
    image = nibabel.load(folder / "displacement-1006.nii.gz")
    assert image.header.get_intent()[0] == "displacement vector" and image.shape[3:] == (1, 3)
    return image, np.asarray(image.dataobj, dtype=np.float64)[:, :, :, 0, :]


def check_files(records, grid, resampling, modeling):
    """The files themselves: nibabel, wb_command, VTK."""
    image, back = field_ras(resampling)
    records.check("1006: affine that nibabel reads - mm", np.abs(image.affine - grid.affine).max(), 1e-5, "nibabel")
    other = nibabel.load(resampling / "displacement-1007.nii.gz")
    assert other.header["intent_code"] == 1007
    lps = np.asarray(other.dataobj, dtype=np.float64)[:, :, :, 0, :]
    records.check("1006 against 1007 with x and y turned - mm", np.abs(lps @ LPS_RAS - back).max(), 0.0, "nibabel")

    converted = resampling / "workbench.nii.gz"
    run("wb_command", "-convert-warpfield", "-from-world", resampling / "displacement-1006.nii.gz", "-to-itk", converted)
    turned = np.asarray(nibabel.load(converted).dataobj, dtype=np.float64).reshape(lps.shape)
    records.check("1007 against wb_command -convert-warpfield of 1006 - mm", np.abs(turned - lps).max(), 0.0,
                  "Connectome Workbench 1.5.0")

    mesh = vtk_file(next((modeling / "series").glob("*.vtu")))
    files = [mesh] + [vtk_file(modeling / name) for name in ("tumour.vtp", "cortex.vtp")]
    records.at_least("VTK files with SPACE = RAS of three", sum(map(says_ras, files)), 3, "VTK 9.1")
    for surface in files[1:]:
        names = {surface.GetPointData().GetArrayName(i) for i in range(surface.GetPointData().GetNumberOfArrays())}
        assert names == {"displacement_mm", "sd_mm", "known"}, names

    for title, folder, of, sign in (("modeling", modeling, mesh, 1.0), ("resampling", resampling, deformed(mesh), -1.0)):
        _, field = field_ras(folder)
        u, inside = mesh_field(of, grid)
        records.at_least(f"{title}: voxels compared with the mesh", inside.sum(), 50000, MESH)
        error = np.linalg.norm(field[inside] - sign * u[inside], axis=1)
        records.check(f"1006 {title} against the mesh - mm", error.max(), 1e-4, MESH)
    return mesh, back


def check_there_and_back(records, grid, resampling, modeling):
    """Through the files alone: back by a voxel's vector, there by the other grid, trilinear."""
    _, back = field_ras(resampling)
    _, there = field_ras(modeling)
    inside = [load(folder / "sd_mm.nii.gz") > 0 for folder in (resampling, modeling)]
    origin = grid.places + back
    index = grid.index_of(origin)
    usable = inside[0] & ((index >= 0) & (index <= grid.dims - 1)).all(axis=-1)
    # All eight voxels around the origin lie in the brain.
    usable[usable] = grid.trilinear(inside[1][..., None].astype(float), origin[usable])[:, 0] > 1 - 1e-9
    ended = origin[usable] + grid.trilinear(there, origin[usable])
    error = np.linalg.norm(ended - grid.places[usable], axis=1)
    records.at_least("there and back: voxels", usable.sum(), 50000, "modeling.nii.gz of resampling.nii.gz")
    records.check("there and back inside the brain - mm", error.max(), 0.02, "modeling.nii.gz of resampling.nii.gz")
    records.figure("there and back inside the brain: mean - mm", error.mean(), "modeling.nii.gz of resampling.nii.gz")


def centroid(grid, values):
    weights = np.clip(values, 1.0, None) - 1.0
    return (weights[..., None] * grid.places).sum(axis=(0, 1, 2)) / weights.sum()


def check_programs(records, arguments, grid, images, resampling, mesh, back):
    programs = {"ITK": itk, "transformix": transformix, "plastimatch": plastimatch}
    if not (arguments.bin / "interchange_itk").exists():
        records.left_out("libinsighttoolkit5-dev is not installed")
        del programs["ITK"]
    files = {"h5": "displacement.h5", "1007": "displacement-1007.nii.gz", "nrrd": "displacement.nrrd"}
    # Voxels whose neighbours in the image all exist: at the border programs differ.
    index = grid.index_of(grid.places + back)
    whole = ((index >= 0.01) & (index <= grid.dims - 1.01)).all(axis=-1)
    ours = {name: load(resampling / f"warped-{name}.nii.gz") for name in images}
    u_blob = grid.trilinear(mesh_field(mesh, grid)[0], BLOB_MM)

    for program, make in programs.items():
        warp = make(arguments)
        for kind, file in files.items():
            if kind == "h5" and program != "ITK":
                continue  # neither reads ITK's transforms
            title = f"{kind} through {program}"
            made = {name: load(warp((resampling / file).resolve(), path.resolve(),
                                    (arguments.out / f"{program}-{kind}-{name}.nii.gz").resolve(), grid))
                    for name, path in images.items()}
            places = np.stack([made[axis] - ours[axis] for axis in "xyz"], axis=-1)[whole]
            records.check(f"{title}: place - mm", np.linalg.norm(places, axis=1).max(), MOST_MM, program)
            span = np.ptp(load(images["texture"]))
            records.check(f"{title}: intensity of its range", np.abs(made["texture"] - ours["texture"])[whole].max() / span,
                          MOST_INTENSITY, program)
            moved = centroid(grid, made["blob"]) - centroid(grid, load(images["blob"]))
            records.check(f"{title}: blob moves by u but for - mm", np.linalg.norm(moved - u_blob), 0.1, program)
    records.figure("motion of the blob - mm", np.linalg.norm(u_blob), MESH)
    moved = centroid(grid, ours["blob"]) - centroid(grid, load(images["blob"]))
    records.at_least("own: blob moves along u: cosine", moved @ u_blob / np.linalg.norm(moved) / np.linalg.norm(u_blob),
                     0.999, "--image")
    return whole


def show_mistakes(records, arguments, grid, images, resampling, modeling, whole):
    """How far off an image would be with the wrong file: the checks above can tell."""
    if not (arguments.bin / "interchange_itk").exists():
        return
    ours = load(resampling / "warped-texture.nii.gz")
    span = np.ptp(load(images["texture"]))
    for title, file in (("1006 through ITK 5.2.1", resampling / "displacement-1006.nii.gz"),
                        ("modeling through ITK", modeling / "displacement.h5")):
        result = itk(arguments)(file, images["texture"], arguments.out / "mistake.nii.gz", grid)
        records.figure(f"mistake: {title}: intensity of its range", np.abs(load(result) - ours)[whole].max() / span, "ITK")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    records = Records(arguments.out)
    for program in ("transformix", "plastimatch", "wb_command"):
        if shutil.which(program) is None:
            raise SystemExit(f"study.py: {program} is not installed (docker/packages-interchange.txt)")
    grid = Grid()
    images = images_of(grid, arguments.out)
    with_images = [word for path in images.values() for word in ("--image", path)]
    resampling = export(arguments, "resampling", "--like", images["x"], *with_images)
    modeling = export(arguments, "modeling", "--like", images["x"])
    manifest = json.loads((resampling / "export.json").read_text())
    assert all((resampling / file["file"]).exists() for file in manifest["files"])

    mesh, back = check_files(records, grid, resampling, modeling)
    check_there_and_back(records, grid, resampling, modeling)
    whole = check_programs(records, arguments, grid, images, resampling, mesh, back)
    show_mistakes(records, arguments, grid, images, resampling, modeling, whole)
    records.left_out("ANTs is not in Debian 12: it reads the 1007 file through ITK as checked here")
    records.left_out("3D Slicer is not in Debian 12: nothing was run inside it")


if __name__ == "__main__":
    main()
