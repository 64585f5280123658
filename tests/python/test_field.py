# SPDX-License-Identifier: GPL-3.0-or-later
"""Look-ups in the field of an update: inside, outside, of a part, and back."""
import dataclasses
import itertools

import numpy as np
import pytest

import brainshift
from brainshift import Field, FieldMesh, Quality, codec
from fake_daemon import update as wire_update

CELLS = 4
RANDOM = np.random.default_rng(5)
REST = RANDOM.uniform(0.0, 10.0, (2000, 3))


class Cube:
    """[0, 10]^3 mm in tetrahedra (Kuhn): what Field asks of a Model."""

    model_id = "model"
    nodes = np.stack(np.meshgrid(*[np.linspace(0.0, 10.0, CELLS + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)

    def __init__(self):
        tets = []
        for axes in itertools.permutations(range(3)):
            corners = np.zeros((4, 3), dtype=int)
            for k, axis in enumerate(axes, start=1):
                corners[k] = corners[k - 1]
                corners[k, axis] += 1
            if np.linalg.det(corners[1:] - corners[0]) < 0:
                corners[[2, 3]] = corners[[3, 2]]
            for cell in itertools.product(range(CELLS), repeat=3):
                tets.append((corners + cell) @ [(CELLS + 1) ** 2, CELLS + 1, 1])
        self.tets = np.array(tets, dtype=np.int32)


MODEL = Cube()
MESH = FieldMesh(MODEL)


def bent(mm=1.0, **changes):
    """Bends the cube; sd is a tenth of x, known 1 - x / 10."""
    x = MODEL.nodes
    u = mm * np.stack([np.sin(0.3 * x[:, 1]), 1.0 + 0.1 * x[:, 0], np.cos(0.3 * x[:, 0])], axis=1)
    made = dataclasses.replace(codec.update(wire_update(3)), displacement_mm=u, sd_mm=0.1 * x[:, 0],
                               known=1.0 - 0.1 * x[:, 0])
    return dataclasses.replace(made, **changes)


def test_at_the_nodes_is_the_update_and_linear_between_them():
    field = Field(MESH, bent())
    assert np.abs(field.at(MODEL.nodes).displacement_mm - bent().displacement_mm).max() < 1e-12
    values = field.at(REST)
    assert values.inside.all()
    assert values.sd_mm == pytest.approx(0.1 * REST[:, 0], abs=1e-12)
    assert values.known == pytest.approx(1.0 - 0.1 * REST[:, 0], abs=1e-12)


@pytest.mark.parametrize("mm", [0.0, 0.1, 2.0])
def test_undeformed_takes_back_what_at_has_moved(mm):
    field = Field(MESH, bent(mm))
    was = field.undeformed(REST + field.at(REST).displacement_mm)
    assert np.abs(was.points - REST).max() < 1e-9  # NaN fails too
    assert was.field.inside.all() and was.field.sd_mm == pytest.approx(0.1 * REST[:, 0], abs=1e-9)


def test_outside_of_the_mesh_says_so_and_has_no_number():
    field = Field(MESH, bent(2.0))
    values = field.at([[10.001, 5, 5], [5, -1e-3, 5], [5, 1e9, 5], [np.inf, 5, 5], [np.nan, 5, 5]])
    assert not values.inside.any() and np.isnan(values.displacement_mm).all() and np.isnan(values.sd_mm).all()
    left = [[5.0, 0.5, 5.0]]  # the cube has moved up by 2 to 4 mm
    assert field.at(left).inside.all() and not field.undeformed(left).field.inside.any()
    assert np.isnan(field.undeformed(left).points).all()
    assert len(field.at(np.zeros((0, 3))).inside) == 0


def test_of_a_part_is_known_where_every_node_was_received():
    nodes = np.flatnonzero(MODEL.nodes[:, 0] <= 5.0).astype(np.int32)
    part = bent(displacement_mm=bent().displacement_mm[nodes], sd_mm=None, known=None, nodes=nodes,
                mesh_nodes=len(MODEL.nodes))
    values = Field(MESH, part).at(REST)
    assert values.sd_mm is None and values.known is None
    assert (values.inside == (REST[:, 0] <= 5.0)).all()
    assert np.nanmax(np.abs(values.displacement_mm - Field(MESH, bent()).at(REST).displacement_mm)) < 1e-12


@pytest.mark.parametrize("changes, says", [
    ({"quality": Quality.UNUSABLE}, "may not be shown"),
    ({"final": False}, "may not be shown"),
    ({"displacement_mm": None}, "may not be shown"),
    ({"sd_mm": np.zeros(3)}, "not one of a mesh of 125 nodes"),
    ({"displacement_mm": np.zeros((3, 3))}, "not one of a mesh of 125 nodes"),
    ({"mesh_nodes": 7}, "not one of a mesh of 125 nodes"),
])
def test_what_is_no_field_of_the_mesh_is_refused(changes, says):
    with pytest.raises(ValueError, match=f"update 3: .*{says}"):
        Field(MESH, bent(**changes))


def test_another_model_and_a_wrong_shape_are_refused():
    other = codec.update(wire_update(3, model_id="other"))
    with pytest.raises(ValueError, match="of model other, the mesh of model"):
        Field(MESH, dataclasses.replace(bent(), session=other.session))
    with pytest.raises(ValueError, match=r"shape \(3,\), must be \(m, 3\)"):
        Field(MESH, bent()).at([1.0, 2.0, 3.0])


def test_what_holds_arrays_is_shown_on_one_line():
    shown = repr(bent(quality=Quality.CAUTION, quality_reason="the data say little"))
    assert shown.startswith("Update(3 of observation 3, condensed, contact, caution, 125 nodes, up to ")
    assert shown.endswith("'the data say little')")
    values = repr(Field(MESH, bent()).at(REST))
    assert values == "FieldValues(inside=bool[2000], displacement_mm=float64[2000, 3], sd_mm=float64[2000], known=float64[2000])"
    assert "\n" not in repr(brainshift.Surface(REST, MODEL.tets)) and len(repr(brainshift.Surface(REST, MODEL.tets))) < 80
