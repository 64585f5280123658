# SPDX-License-Identifier: GPL-3.0-or-later
"""made_up_head.py OUT.nii.gz: a label map (FreeSurfer's numbers) of an ellipsoid, for the smoke test of `anatomy`: two
hemispheres with cortex along the midline, cerebellum, brainstem, and two lateral ventricles."""
import pathlib
import sys

import bids_tree
import numpy as np

VOXEL_MM = 2.0
HALF_MM = np.array([65.0, 80.0, 60.0])
SIZE = (72, 88, 68)


def labels():
    middle = 0.5 * VOXEL_MM * (np.array(SIZE) - 1)
    x, y, z = (np.stack(np.meshgrid(*(VOXEL_MM * np.arange(n) for n in SIZE), indexing="ij"), 0)
               - middle[:, None, None, None])
    radius = np.sqrt((x / HALF_MM[0]) ** 2 + (y / HALF_MM[1]) ** 2 + (z / HALF_MM[2]) ** 2)
    right = x > 0
    cortex = (radius > 0.93) | ((np.abs(x) < 5) & (z > 16))
    found = np.where(cortex, np.where(right, 42, 3), np.where(right, 41, 2))
    cerebellum = (y < -12) & (z < -18)
    found[cerebellum] = np.where(right, 47, 8)[cerebellum]
    found[(y >= -12) & (y < 14) & (np.abs(x) < 12) & (z < -22)] = 16
    for side, number in ((-1, 4), (1, 43)):
        found[((x - side * 17) / 11) ** 2 + (y / 34) ** 2 + (z / 13) ** 2 < 1] = number
    found[radius >= 1] = 0
    return found.astype("int16"), np.hstack([VOXEL_MM * np.eye(3), -middle[:, None]])


if __name__ == "__main__":
    bids_tree.put(pathlib.Path(sys.argv[1]), *labels())
