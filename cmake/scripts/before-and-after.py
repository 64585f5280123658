#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""before-and-after.py RUN.json OUT.png: the picture of the README, from a run with contact of `make demo`.

RUN.json is of `brainshift replay`, its field beside it, of the default case and a simulated surgery (the demo: paper-icp,
seed 1). In a coronal slice through the tumour: where the MRI says the tumour is and where it is; where the update says it
is; and, along a line from the opening through the tumour, the true displacement with the update's own 90 % interval.
Needs Debian's python3-matplotlib and python3-vtk9.
"""
import gzip
import json
import pathlib
import re
import struct
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import vtk
from matplotlib import patheffects
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

ROOT = pathlib.Path(__file__).parents[2]
CASE = ROOT / "config" / "cases" / "colin27.yaml"
QUANTILE_90 = 1.645
BEFORE, TRUE, ESTIMATE = "#ffffff", "#56b4e9", "#e69f00"


def read_mesh(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def probe(mesh, points, names):
    """Fields of the mesh at points (n x 3), and which points lie in it."""
    cloud, at = vtk.vtkPolyData(), vtk.vtkPoints()
    at.SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    cloud.SetPoints(at)
    filter_ = vtk.vtkProbeFilter()
    filter_.SetInputData(cloud)
    filter_.SetSourceData(mesh)
    filter_.Update()
    data = filter_.GetOutput().GetPointData()
    return [vtk_to_numpy(data.GetArray(n)) for n in names], vtk_to_numpy(data.GetArray("vtkValidPointMask")) > 0


def moved(mesh, name):
    """The mesh with its nodes moved by a field."""
    result = vtk.vtkUnstructuredGrid()
    result.DeepCopy(mesh)
    nodes = vtk_to_numpy(mesh.GetPoints().GetData()) + vtk_to_numpy(mesh.GetPointData().GetArray(name))
    result.GetPoints().SetData(numpy_to_vtk(nodes, deep=True))
    return result


def read_nifti(path):
    """Values and the affine from voxel to RAS of a NIfTI-1 image, little-endian, with an sform."""
    data = gzip.open(path).read()
    shape = struct.unpack_from("<8h", data, 40)[1:4]
    dtype = {2: "<u1", 4: "<i2", 8: "<i4", 16: "<f4"}[struct.unpack_from("<h", data, 70)[0]]
    offset = int(struct.unpack_from("<f", data, 108)[0])
    affine = np.vstack([np.reshape(struct.unpack_from("<12f", data, 280), (3, 4)), [0, 0, 0, 1]])
    return np.frombuffer(data, dtype, int(np.prod(shape)), offset).reshape(shape, order="F").astype(float), affine


def sample_image(image, affine, points):
    """Linear interpolation at RAS points (n x 3)."""
    at = np.linalg.solve(affine, np.c_[points, np.ones(len(points))].T)[:3]
    at = np.clip(at, 0, np.array(image.shape)[:, None] - 1.001)
    low = at.astype(int)
    weight = at - low
    value = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        c = np.array(corner)[:, None]
        value += np.prod(np.where(c, weight, 1 - weight), axis=0) * image[tuple(low + c)]
    return value


def numbers(key):
    """The first list of numbers of a key of the case file."""
    return np.array(json.loads(re.search(rf"^ *{key}: (\[.*\])", CASE.read_text(), re.MULTILINE)[1]))


def outline(surface, y):
    """The closed curve in which a surface (vtkPolyData) cuts the coronal plane: x and z, mm."""
    plane, cutter, strips = vtk.vtkPlane(), vtk.vtkCutter(), vtk.vtkStripper()
    plane.SetOrigin(0, y, 0)
    plane.SetNormal(0, 1, 0)
    cutter.SetCutFunction(plane)
    cutter.SetInputData(surface)
    strips.SetInputConnection(cutter.GetOutputPort())
    strips.Update()
    points = vtk_to_numpy(strips.GetOutput().GetPoints().GetData())
    angle = np.arctan2(*(points - points.mean(axis=0))[:, [2, 0]].T)
    curve = points[np.argsort(angle)][:, [0, 2]]
    return np.vstack([curve, curve[:1]])


def tumour(mesh, name=None):
    """The tumour's surface, moved by a field."""
    sphere = vtk.vtkSphereSource()
    sphere.SetThetaResolution(90)
    sphere.SetPhiResolution(91)
    sphere.SetRadius(1.0)
    sphere.Update()
    surface = sphere.GetOutput()
    points = numbers("centre_mm") + vtk_to_numpy(surface.GetPoints().GetData()) * numbers("semi_axes_mm")
    if name:
        (field,), inside = probe(mesh, points, [name])
        assert inside.all()
        points = points + field
    surface.GetPoints().SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    return surface


def draw(mesh, result, out):
    centre, gravity = numbers("centre_mm"), numbers("direction")
    gravity = gravity / np.linalg.norm(gravity)
    y = centre[1]
    x, z = np.meshgrid(np.arange(4, 84, 0.25), np.arange(-36, 56, 0.25))
    places = np.c_[x.ravel(), np.full(x.size, y), z.ravel()]
    (true,), inside = probe(moved(mesh, "displacement_true"), places, ["displacement_true"])
    image, affine = read_nifti(re.search(r"^ *mri: (\S+)", CASE.read_text(), re.MULTILINE)[1])
    now = sample_image(image, affine, places - true * inside[:, None]).reshape(x.shape)
    curves = [outline(tumour(mesh, name), y) for name in (None, "displacement_true", "displacement_estimated")]
    errors = [result["error_mm"][key] for key in ("initial", "cross")]

    plt.rcParams.update({"font.size": 10, "font.family": "DejaVu Sans"})
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.7), layout="constrained", gridspec_kw={"width_ratios": [1, 1, 1.2]})
    edge = [patheffects.withStroke(linewidth=3, foreground="#222222")]
    titles = [f"by the MRI: {errors[0]['mean']:.1f} mm off", f"corrected: {errors[1]['mean']:.2f} mm off"]
    for axis, title, curve, colour, word in zip(axes, titles, (curves[0], curves[2]), (BEFORE, ESTIMATE), ("by the MRI", "corrected")):
        axis.imshow(now, cmap="gray", origin="lower", extent=(x.min(), x.max(), z.min(), z.max()), vmax=np.percentile(now, 99.8))
        axis.plot(*curves[1].T, color=TRUE, lw=4, label="tumour, true")
        axis.plot(*curve.T, color=colour, lw=2, ls="--", label=f"tumour, {word}", path_effects=edge)
        axis.set_xlim(x.max(), x.min())  # the patient's right on the left
        axis.set_title(title, fontsize=12, fontweight="bold")
        axis.plot([78, 58], [-32, -32], color="white", lw=2)
        axis.text(68, -30.5, "20 mm", color="white", ha="center", va="bottom", path_effects=edge)
        axis.legend(loc="upper right", facecolor="#333333", labelcolor="white", framealpha=0.9, fontsize=9)
        axis.set_axis_off()
    down = gravity[[0, 2]] / np.linalg.norm(gravity[[0, 2]])
    start = np.array([20, -18])
    axes[0].annotate("", xy=start + 12 * down, xytext=start, arrowprops={"color": "white", "width": 1.5, "headwidth": 7, "headlength": 7, "path_effects": edge})
    axes[0].text(*(start - 2 * down), "gravity", color="white", ha="center", va="bottom", path_effects=edge)

    opening = np.array(json.loads(re.search(r"^craniotomy:.*?centre_mm: (\[.*?\])", CASE.read_text(), re.MULTILINE | re.DOTALL)[1]))
    way = centre - opening
    way = way / np.linalg.norm(way)
    along = np.arange(-5, 160, 0.5)
    (true, estimate, sd), inside = probe(mesh, opening + along[:, None] * way, ["displacement_true", "displacement_estimated", "sd_mm"])
    depth, true, estimate, sd = along[inside], true[inside] @ gravity, estimate[inside] @ gravity, sd[inside]
    depth = depth - depth[0]
    axis = axes[2]
    axis.fill_between(depth, estimate - QUANTILE_90 * sd, estimate + QUANTILE_90 * sd, color=ESTIMATE, alpha=0.35, lw=0,
                      label="90 % interval of the update")
    axis.plot(depth, estimate, color=ESTIMATE, lw=2, label="estimate")
    axis.plot(depth, true, color="#0072b2", lw=2, ls="--", label="truth")
    middle = (centre - opening) @ way - along[inside][0]
    axis.axvspan(middle - 13, middle + 13, color="#999999", alpha=0.2, lw=0)
    axis.text(middle, 0.98, "tumour", transform=axis.get_xaxis_transform(), ha="center", va="top", color="#444444")
    axis.set_xlabel("distance from the opening, through the tumour (mm)")
    axis.set_ylabel("displacement along gravity (mm)")
    axis.set_title("how sure the update is", fontsize=12, fontweight="bold")
    axis.legend(frameon=False, fontsize=9, loc="lower right")
    axis.set_ylim(bottom=0)
    axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(out, dpi=110)
    share = np.mean(np.abs(true - estimate) <= QUANTILE_90 * sd)
    print(f"{out}: {errors[0]['mean']:.2f} mm before, {errors[1]['mean']:.3f} mm after; truth inside on {100 * share:.0f} % of the line")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    report, out = map(pathlib.Path, sys.argv[1:])
    result = next(run for run in json.loads(report.read_text()) if run["boundary"] == "contact")
    draw(read_mesh(report.parent / result["field_file"]), result, out)
    subprocess.run([sys.executable, ROOT / "cmake" / "scripts" / "palette-pictures.py", out], check=True)


if __name__ == "__main__":
    main()
