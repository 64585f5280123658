# SPDX-License-Identifier: GPL-3.0-or-later
"""label_head.py LABELS CASE.yaml --programs BIN: a case of a label map (FreeSurfer's numbers) with falx, tentorium and
ventricles, by `brainshift init`.

Beside the case it writes a T1w image made of the labels, a grey value for each, and a map of a made-up tumour: a ball of
12 mm right of, behind and above the brain's middle, 60 % of the way to its surface, and never in a ventricle. The patient lies
on the left side, the head end raised by 15 degrees, so that the opening over the tumour is about uppermost. LABELS is only read.
"""
import argparse
import pathlib
import subprocess

import bids_tree
import numpy as np
from brainshift.cohort import nifti
from label_cohort import GREY

VENTRICLES = (4, 5, 14, 15, 43, 44)
TOWARDS = np.array([0.75, 0.4, 0.53]) / np.linalg.norm([0.75, 0.4, 0.53])
RADIUS_MM = 12.0
POSITION = "supine,left-30,raised-15"


def grey_of(labels):
    """int16, a grey value per label: 0 outside, 60 where GREY has none."""
    grey = np.full(labels.max() + 1, 60, "int16")
    grey[0] = 0
    for number, value in GREY.items():
        if number < len(grey):
            grey[number] = value
    return grey[labels]


def tumour_in(labels, affine):
    """uint8, 1 in the ball; labels above 500 and 24 are no brain."""
    brain = (labels > 0) & (labels < 500) & (labels != 24)
    centre = np.argwhere(brain).mean(axis=0) @ affine[:, :3].T + affine[:, 3]
    to_voxel = np.linalg.inv(affine[:, :3])
    ray = np.arange(0.0, 150.0, 0.5)
    places = np.rint((centre + ray[:, None] * TOWARDS - affine[:, 3]) @ to_voxel.T).astype(int)
    valid = np.all((places >= 0) & (places < labels.shape), axis=1)
    inside = np.zeros(len(ray), bool)
    inside[valid] = brain[tuple(places[valid].T)]
    middle = centre + 0.6 * ray[np.flatnonzero(inside)[-1]] * TOWARDS
    grid = np.stack(np.meshgrid(*map(np.arange, labels.shape), indexing="ij"), -1)
    distance = np.linalg.norm(grid @ affine[:, :3].T + affine[:, 3] - middle, axis=-1)
    return ((distance < RADIUS_MM) & ~np.isin(labels, VENTRICLES)).astype("uint8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("labels", type=pathlib.Path)
    parser.add_argument("case", type=pathlib.Path)
    parser.add_argument("--programs", type=pathlib.Path, required=True, help="folder of brainshift")
    options = parser.parse_args()
    image = nifti.read(options.labels)
    labels, affine = image.values.astype("int16"), image.affine[:3]
    beside = options.case.parent
    name = options.case.stem
    mri = bids_tree.put(beside / f"{name}-t1.nii.gz", grey_of(labels), affine)
    tumour = bids_tree.put(beside / f"{name}-tumour.nii.gz", tumour_in(labels, affine), affine)
    subprocess.run([options.programs / "brainshift", "init", "--mri", mri, "--labels", options.labels, "--tumour", tumour,
                    "--position", POSITION, "--out", options.case], check=True)
    with options.case.open("a", encoding="utf-8") as case:
        case.write(f"\nanatomy:\n  labels: {options.labels.resolve()}\n")


if __name__ == "__main__":
    main()
