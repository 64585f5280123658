# SPDX-License-Identifier: GPL-3.0-or-later
"""A small BIDS dataset of made-up heads: an ellipsoid of 4 mm voxels with a tumour."""
import gzip
import json
import struct

import numpy as np

VOXEL_MM = 4.0
SIZE = (40, 48, 40)
MIDDLE = np.array([79.5, 95.5, 79.5])  # of the grid, mm from its corner


def grid():
    """(i, j, k, 3), mm RAS about the head's middle."""
    return np.stack(np.meshgrid(*(VOXEL_MM * np.arange(n) for n in SIZE), indexing="ij"), -1) - MIDDLE


def nifti(values, affine=None):
    """The bytes of a NIfTI-1 file."""
    affine = np.hstack([VOXEL_MM * np.eye(3), -MIDDLE[:, None]]) if affine is None else affine
    code = {"uint8": 2, "int16": 4, "float32": 16}[values.dtype.name]
    header = bytearray(348)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *values.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, code, 8 * values.itemsize)
    struct.pack_into("<8f", header, 76, 1, *np.linalg.norm(affine[:, :3], axis=0), 0, 0, 0, 0)
    struct.pack_into("<3f", header, 108, 352, 1, 0)
    struct.pack_into("<b", header, 123, 2)
    struct.pack_into("<2h", header, 252, 0, 1)
    struct.pack_into("<12f", header, 280, *affine.ravel())
    header[344:348] = b"n+1\0"
    return bytes(header) + bytes(4) + values.tobytes(order="F")


def put(path, values, affine=None):
    path.parent.mkdir(parents=True, exist_ok=True)
    raw = nifti(values, affine)
    path.write_bytes(gzip.compress(raw, mtime=0) if path.suffix == ".gz" else raw)
    return path


def head(scale=1.0):
    """True inside the brain."""
    return np.linalg.norm(grid() / (scale * np.array([65.0, 80.0, 60.0])), axis=-1) < 1.0


def tumour(centre=(32.0, -20.0, 26.0), radius=13.0):
    return np.linalg.norm(grid() - centre, axis=-1) < radius


def dataset(bids):
    bids.mkdir(parents=True, exist_ok=True)
    (bids / "dataset_description.json").write_text(json.dumps({"Name": "made-up heads", "BIDSVersion": "1.8.0"}))
    return bids


def subject(bids, label, scale=1.0, session=None, brain=True, lesion=True):
    """T1w in the dataset, masks in derivatives/masks."""
    where = f"sub-{label}" + (f"/ses-{session}" if session else "") + "/anat"
    name = f"sub-{label}" + (f"_ses-{session}" if session else "")
    inside = head(scale)
    put(bids / where / f"{name}_T1w.nii.gz", (100 * inside).astype("int16"))
    beside = bids / "derivatives" / "masks" / where
    if brain:
        put(beside / f"{name}_desc-brain_mask.nii.gz", inside.astype("uint8"))
    if lesion:
        put(beside / f"{name}_label-lesion_mask.nii.gz", tumour().astype("uint8"))
    return beside
