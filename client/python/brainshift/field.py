# SPDX-License-Identifier: Apache-2.0
"""Where a point of the MRI is now, and where a point of the room was. Mirrors client/lib/field.hpp."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .values import Brief, Floats, Indices, Model, Update

_ROUNDING = 1e-9  # a weight so negative still counts as inside: no point falls between neighbours


def _rows(points: ArrayLike) -> Floats:
    rows = np.asarray(points, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"points: shape {rows.shape}, must be (m, 3)")
    return rows


@dataclass(frozen=True, repr=False)
class FieldValues(Brief):
    """Of m points. Where `inside` is false the numbers are NaN: outside the mesh, or of a part (Update.nodes) that
    leaves out a node there."""

    inside: NDArray[np.bool_]  # (m,)
    displacement_mm: Floats  # (m, 3): moves the undeformed point to its deformed place
    sd_mm: Optional[Floats]  # (m,); None when the update has none
    known: Optional[Floats]  # (m,), 0 to 1; None when the update has none


@dataclass(frozen=True, repr=False)
class Undeformed(Brief):
    points: Floats  # (m, 3), mm: where the deformed points were in the MRI; NaN outside the moved mesh
    field: FieldValues  # of these points


class _Locator:
    """Which tetrahedron holds a point: a uniform grid of cells, of each the tetrahedra whose box meets it.
    Flat and inverted ones, and those with a node without a place, are left out."""

    def __init__(self, nodes: Floats, tets: Indices) -> None:
        corners = nodes[tets]  # (t, 4, 3)
        edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        with np.errstate(invalid="ignore"):
            sound = np.flatnonzero(np.linalg.det(edges) > 0.0)
        self.tets = tets[sound]
        corners = corners[sound]
        self.origin = corners[:, 0]
        self.inverse = np.linalg.inv(edges[sound])
        self.dims = np.zeros(3, dtype=np.int64)
        if len(sound) == 0:
            return
        self.low = corners.min(axis=(0, 1))
        size = corners.max(axis=(0, 1)) - self.low
        self.cell_mm = np.cbrt(2.0 * size.prod() / len(sound))
        self.dims = np.maximum(np.ceil(size / self.cell_mm), 1).astype(np.int64)
        first, last = self._cell(corners.min(axis=1)), self._cell(corners.max(axis=1))
        extent = last - first + 1
        count = extent.prod(axis=1)
        member = np.repeat(np.arange(len(sound), dtype=np.int32), count)
        place = np.arange(len(member)) - np.repeat(np.cumsum(count) - count, count)
        nx, ny = extent[member, 0], extent[member, 1]
        cells = first[member] + np.stack([place % nx, place // nx % ny, place // (nx * ny)], axis=1)
        index = self._index(cells)
        self.members = member[np.argsort(index, kind="stable")]
        self.first = np.concatenate([[0], np.cumsum(np.bincount(index, minlength=int(self.dims.prod())))])

    def _cell(self, points: Floats) -> NDArray[np.int64]:
        cell: NDArray[np.int64] = np.clip(np.floor((points - self.low) / self.cell_mm), 0, self.dims - 1).astype(np.int64)
        return cell

    def _index(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        index: NDArray[np.int64] = cells[:, 0] + self.dims[0] * (cells[:, 1] + self.dims[1] * cells[:, 2])
        return index

    def find(self, points: Floats) -> tuple[NDArray[np.int64], Indices, Floats]:
        """The points that lie in a tetrahedron, its nodes (k, 4) and the weights of these (k, 4)."""
        found, nodes, weights = [np.zeros(0, dtype=np.int64)], [self.tets[:0]], [np.zeros((0, 4))]
        if self.dims[0] > 0:
            scaled = (points - self.low) / self.cell_mm
            open_ = np.flatnonzero(((scaled >= -_ROUNDING) & (scaled <= self.dims + _ROUNDING)).all(axis=1))
            cell = self._index(self._cell(points[open_]))
            at, end = self.first[cell], self.first[cell + 1]
            while len(open_) > 0:  # the next candidate of every point that has none yet
                left = at < end
                open_, at, end = open_[left], at[left], end[left]
                tet = self.members[at]
                w = np.einsum("pij,pj->pi", self.inverse[tet], points[open_] - self.origin[tet])
                w = np.concatenate([1.0 - w.sum(axis=1, keepdims=True), w], axis=1)
                hit = w.min(axis=1) >= -_ROUNDING
                inside = np.maximum(w[hit], 0.0)
                found.append(open_[hit])
                nodes.append(self.tets[tet[hit]])
                weights.append(inside / inside.sum(axis=1, keepdims=True))
                open_, at, end = open_[~hit], at[~hit] + 1, end[~hit]
        return np.concatenate(found), np.concatenate(nodes), np.concatenate(weights)


class FieldMesh:
    """The mesh of a model, ready to be asked: once per model, 1 to 2 s."""

    def __init__(self, model: Model) -> None:
        self.model_id = model.model_id
        self.nodes = model.nodes
        self.tets = model.tets
        self.locator = _Locator(model.nodes, model.tets)


class Field:
    """The field of one update.

    Linear in every tetrahedron of the mesh; undeformed() finds the moved tetrahedron that holds a point, and is
    exact but for rounding. Nothing is extrapolated. It does not age: whether it may be shown, field_status() says.
    ValueError when the update is of another model or mesh, or may not be shown (Update.usable).
    """

    def __init__(self, mesh: FieldMesh, update: Update) -> None:
        if not update.usable or update.displacement_mm is None:
            raise ValueError(f"update {update.sequence}: its field may not be shown: an iterate, failed or unusable")
        if update.session.model_id != mesh.model_id:
            raise ValueError(f"update {update.sequence}: it is of model {update.session.model_id}, "
                             f"the mesh of {mesh.model_id}")
        nodes = len(mesh.nodes)
        rows = nodes if update.nodes is None else len(update.nodes)
        parts = [update.displacement_mm, update.sd_mm, update.known]
        if update.mesh_nodes not in (None, nodes) or any(part is not None and len(part) != rows for part in parts):
            raise ValueError(f"update {update.sequence}: its field is not one of a mesh of {nodes} nodes")
        self._mesh = mesh
        self._nodal = np.full((nodes, 5), np.nan)  # displacement, sd, known of every node
        places = slice(None) if update.nodes is None else update.nodes
        self._nodal[places, :3] = update.displacement_mm
        self._has = [part is not None for part in parts[1:]]
        for column, part in enumerate(parts[1:], start=3):
            if part is not None:
                self._nodal[places, column] = part
        self._moved: Optional[_Locator] = None  # made when it is first asked

    def at(self, points: ArrayLike) -> FieldValues:
        """At undeformed places, (m, 3)."""
        return self._values(self._mesh.locator, _rows(points))

    def undeformed(self, points: ArrayLike) -> Undeformed:
        """Of deformed places, (m, 3)."""
        rows = _rows(points)
        if self._moved is None:
            self._moved = _Locator(self._mesh.nodes + self._nodal[:, :3], self._mesh.tets)
        field = self._values(self._moved, rows)
        return Undeformed(rows - field.displacement_mm, field)

    def _values(self, locator: _Locator, points: Floats) -> FieldValues:
        found, nodes, weights = locator.find(points)
        values = np.full((len(points), 5), np.nan)
        values[found] = np.einsum("pk,pkc->pc", weights, self._nodal[nodes])
        sd_mm, known = (values[:, 3 + i] if has else None for i, has in enumerate(self._has))
        return FieldValues(~np.isnan(values[:, 0]), values[:, :3], sd_mm, known)
