# SPDX-License-Identifier: Apache-2.0
"""A displacement field on a regular grid, and the VTK transform made from it.

    T(x) = x + u(x)      x in patient RAS, mm; u moves the undeformed brain to its deformed place (modeling)

vtkGridTransform (Slicer: vtkOrientedGridTransform) interpolates u linearly between the voxels' centres. Vectors are its
point scalars, x fastest. Outside the grid it repeats the value at the border, so the outermost layer has to be zero.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Optional

import numpy as np
import numpy.typing as npt
import vtk
from vtk.util import numpy_support

Array = npt.NDArray[np.float64]

# Of T(T^-1(x)) - x: VTK stops there. Half of the 0.02 mm that the module promises, since VTK's test is of its last step.
INVERSE_TOLERANCE_MM = 0.005
INVERSE_ITERATIONS = 500
# Axes come as float32 products with the spacing. A grid turned by more than this has moved half a micrometre per 10 mm.
AXIS_TOLERANCE = 5e-5


class FieldError(ValueError):
    """One line that says why the volume is no field to be shown."""


@dataclass(frozen=True)
class VectorField:
    vectors: npt.NDArray[np.float32]  # (nz, ny, nx, 3), mm, components along R, A, S; (nz, ny, nx, 1) of a scalar volume
    origin: Array   # (3,) RAS of the first voxel's centre
    spacing: Array  # (3,) mm, all positive

    @property
    def magnitudes_mm(self) -> Array:
        """(nz, ny, nx)"""
        return np.asarray(np.sqrt(np.square(self.vectors, dtype=np.float64).sum(axis=-1)))

    @property
    def blank(self) -> bool:
        return not bool(self.vectors.any())


def field_from_image(image: Any, ijk_to_ras: npt.ArrayLike, components: int = 3) -> VectorField:
    """A copy of a vector volume (vtkImageData with three components) whose voxels lie at ijk_to_ras (4 x 4); with
    components = 1 of a scalar volume.

    Axes may be permuted or flipped; the grid is turned so that x, y, z grow along R, A, S. Vectors are RAS as they are.
    Oblique grids are refused: `brainshift bridge` sends none. Origin, spacing and direction of the image itself count
    for nothing, as in a volume node of Slicer. Raises FieldError.
    """
    scalars = image.GetPointData().GetScalars() if image is not None else None
    if scalars is None:
        raise FieldError("the volume holds no voxels")
    if scalars.GetNumberOfComponents() != components:
        raise FieldError(f"the volume has {scalars.GetNumberOfComponents()} components, not {components}")
    dims = image.GetDimensions()
    if min(dims) < 3:
        raise FieldError(f"the grid has {dims[0]} x {dims[1]} x {dims[2]} voxels; each must be 3 or more")
    vectors = numpy_support.vtk_to_numpy(scalars).astype(np.float32).reshape(dims[2], dims[1], dims[0], components)
    return _turned(vectors, np.asarray(ijk_to_ras, dtype=np.float64))


def _turned(vectors: npt.NDArray[np.float32], ijk_to_ras: Array) -> VectorField:
    if ijk_to_ras.shape != (4, 4) or not np.isfinite(ijk_to_ras).all():
        raise FieldError("IJK to RAS is not a finite 4 x 4 matrix")
    spacing = np.linalg.norm(ijk_to_ras[:3, :3], axis=0)
    if not (spacing > 0.0).all():
        raise FieldError("IJK to RAS has an axis without length")
    direction = ijk_to_ras[:3, :3] / spacing
    axes = np.argmax(np.abs(direction), axis=0)  # of RAS, along which i, j, k run
    signs = np.where(direction[axes, range(3)] < 0.0, -1.0, 1.0)
    aligned = np.zeros((3, 3))
    aligned[axes, range(3)] = signs
    if sorted(axes) != [0, 1, 2] or np.abs(direction - aligned).max() > AXIS_TOLERANCE:
        raise FieldError("the grid is oblique; its axes must lie along R, A and S")
    origin = ijk_to_ras[:3, 3].copy()
    turned_spacing = np.empty(3)
    for voxel_axis, ras_axis in enumerate(axes):
        turned_spacing[ras_axis] = spacing[voxel_axis]
        if signs[voxel_axis] < 0.0:
            origin[ras_axis] -= spacing[voxel_axis] * (vectors.shape[2 - voxel_axis] - 1)
            vectors = np.flip(vectors, axis=2 - voxel_axis)
    order = np.argsort(axes)  # the voxel axis that runs along R, A, S
    vectors = np.transpose(vectors, (2 - order[2], 2 - order[1], 2 - order[0], 3))
    return VectorField(np.ascontiguousarray(vectors), origin, turned_spacing)


def check_field(field: VectorField) -> None:
    """Raises FieldError for a field that may not be shown whatever is said of it."""
    if not np.isfinite(field.vectors).all():
        raise FieldError("the field holds numbers that are not finite")
    for axis in range(3):
        if np.take(field.vectors, (0, -1), axis=axis).any():
            raise FieldError("the outermost layer of the field is not zero: it would go on without end outside the grid")
    if field.blank:
        raise FieldError("the field is blank")


def value_at(field: VectorField, point: npt.ArrayLike) -> Optional[Array]:
    """The field at a place (RAS, mm), linear between the voxels' centres. None outside of the grid."""
    at = (np.asarray(point, dtype=np.float64) - field.origin) / field.spacing
    low = np.floor(at).astype(int)
    nz, ny, nx, _ = field.vectors.shape
    if not np.isfinite(at).all() or (low < 0).any() or (low >= np.array([nx, ny, nz]) - 1).any():
        return None
    x, y, z = low
    corner = field.vectors[z:z + 2, y:y + 2, x:x + 2].astype(np.float64)
    for part in (at - low)[::-1]:  # z, y, x
        corner = corner[0] + part * (corner[1] - corner[0])
    return np.asarray(corner)


def grid_transform(field: VectorField, make: Callable[[], Any] = vtk.vtkGridTransform) -> Any:
    """T of a checked field. make: vtk.vtkGridTransform, or slicer.vtkOrientedGridTransform. The transform keeps a copy."""
    check_field(field)
    image = vtk.vtkImageData()
    image.SetDimensions(*reversed(field.vectors.shape[:3]))
    image.SetOrigin(*field.origin)
    image.SetSpacing(*field.spacing)
    scalars = numpy_support.numpy_to_vtk(field.vectors.reshape(-1, 3), deep=True)
    scalars.SetName("displacement_mm")
    image.GetPointData().SetScalars(scalars)
    transform = make()
    transform.SetDisplacementGridData(image)
    transform.SetInterpolationModeToLinear()
    transform.SetInverseTolerance(INVERSE_TOLERANCE_MM)
    transform.SetInverseIterations(INVERSE_ITERATIONS)
    transform.Update()
    return transform
