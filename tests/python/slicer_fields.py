# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields on grids, as a volume node of Slicer holds them: an image without origin and spacing, and IJK to RAS."""
import numpy as np
import vtk
from vtk.util import numpy_support


def smooth(points):
    """A displacement of some millimetres that is zero on and outside the sphere of 40 mm about the origin. (..., 3)"""
    inside = np.clip(1.0 - np.square(points / 40.0).sum(axis=-1, keepdims=True), 0.0, None) ** 2
    return inside * (np.array([3.0, -5.0, 7.0]) + 0.02 * points[..., [1, 2, 0]])


def image_of(vectors):
    """vectors (nz, ny, nx, components) -> vtkImageData with spacing 1 at 0."""
    vectors = np.ascontiguousarray(vectors)
    image = vtk.vtkImageData()
    image.SetDimensions(vectors.shape[2], vectors.shape[1], vectors.shape[0])
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(vectors.reshape(-1, vectors.shape[-1]), deep=True))
    return image


def sampled(ijk_to_ras, dims, u=smooth):
    """Vectors (nz, ny, nx, 3) float32 of u at the voxels' centres."""
    k, j, i = np.meshgrid(*(np.arange(n) for n in reversed(dims)), indexing="ij")
    ijk = np.stack([i, j, k], axis=-1)
    return u(ijk @ ijk_to_ras[:3, :3].T + ijk_to_ras[:3, 3]).astype(np.float32)


def ras_grid(spacing=4.0, half=48.0):
    count = int(2 * half / spacing) + 1
    matrix = np.diag([spacing, spacing, spacing, 1.0])
    matrix[:3, 3] = -half
    return matrix, (count, count, count)


def label_values(**changes):
    values = dict(sequence=7, session_id=11, model_id="m1", case_id="c1", quality="good", flags="", currency="current",
                  reason="", age_ms=40.0, direction="modeling", recorded=False, method="condensed",
                  boundary="contact", blank=False, has_sd=True, has_known=True, grid_error_mm=0.1, spacing_mm=4.0,
                  fade_mm=10.0)
    values.update(changes)
    return values


def metadata(**changes):
    """The same as the bridge writes it in metadata: text, an unknown age as "unknown"."""
    words = {None: "unknown", True: "true", False: "false"}
    return {key: words[value] if value is None or isinstance(value, bool) else str(value)
            for key, value in label_values(**changes).items()}
