# SPDX-License-Identifier: GPL-3.0-or-later
"""The core of the Slicer module: from a vector volume to a VTK transform, and what may be shown."""
import ast
import dataclasses
import itertools
import json
import math
import subprocess
import sys

import numpy as np
import pytest
import slicer_paths
import vtk
from slicer_fields import image_of, label_values, metadata, ras_grid, sampled, smooth

from BrainshiftLib.colours import known_colours, sd_colours
from BrainshiftLib.grid import FieldError, VectorField, check_field, field_from_image, grid_transform
from BrainshiftLib.label import (ATTRIBUTE_PREFIX, KEYS, Label, LabelError, Light, belongs, may_be_shown, parse_metadata,
                                 parse_state)

RANDOM = np.random.default_rng(5)


def points_inside(count=400, radius=36.0):
    points = RANDOM.uniform(-radius, radius, (4 * count, 3))
    return points[np.linalg.norm(points, axis=1) < radius][:count]


def moved(transform, points):
    return np.array([transform.TransformPoint(*point) for point in points])


@pytest.fixture(scope="module")
def field():
    matrix, dims = ras_grid()
    return field_from_image(image_of(sampled(matrix, dims)), matrix)


def trilinear(field, points):
    """Written without VTK: the same interpolation."""
    at = (points - field.origin) / field.spacing
    low = np.floor(at).astype(int)
    part = at - low
    result = np.zeros((len(points), 3))
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.prod(np.where(corner, part, 1.0 - part), axis=1)
        x, y, z = (low + corner).T
        result += weight[:, None] * field.vectors[z, y, x]
    return result


# ---- the transform

def test_points_land_at_x_plus_u_of_the_grid(field):
    points = points_inside()
    difference = moved(grid_transform(field), points) - (points + trilinear(field, points))
    assert np.abs(difference).max() < 1e-4  # vectors are float32


def test_points_land_at_x_plus_u_within_what_the_grid_adds(field):
    """As the bridge states it: the largest difference between the grid's interpolation and u, over the points."""
    points = points_inside()
    stated = np.linalg.norm(trilinear(field, points) - smooth(points), axis=1).max()
    assert 0.001 < stated < 0.2, "the grid is an approximation, and a good one"
    error = np.linalg.norm(moved(grid_transform(field), points) - (points + smooth(points)), axis=1)
    assert error.max() <= stated + 1e-4


def test_the_direction_is_to_parent(field):
    """Turns red when the sign flips, and when the transform is used from parent."""
    transform = grid_transform(field)
    point = np.array([4.0, -8.0, 12.0])
    u = smooth(point)
    assert np.linalg.norm(u) > 5.0
    assert np.linalg.norm(moved(transform, [point])[0] - (point + u)) < 0.05
    assert np.linalg.norm(moved(transform.GetInverse(), [point])[0] - (point + u)) > 9.0
    wrong = grid_transform(dataclasses.replace(field, vectors=-field.vectors))
    assert np.linalg.norm(moved(wrong, [point])[0] - (point + u)) > 9.0


def test_there_and_back_is_within_a_fiftieth_of_a_millimetre(field):
    transform, points = grid_transform(field), points_inside()
    there = moved(transform, points)
    assert np.linalg.norm(moved(transform.GetInverse(), there) - points, axis=1).max() <= 0.02
    assert np.linalg.norm(moved(transform, moved(transform.GetInverse(), points)) - points, axis=1).max() <= 0.02


def test_nothing_moves_outside(field):
    transform = grid_transform(field)
    far = np.array([[48.0, 0.0, 0.0], [60.0, 5.0, 0.0], [0.0, -300.0, 0.0], [1e4, 1e4, 1e4], [0.0, 0.0, 48.001]])
    assert np.array_equal(moved(transform, far), far)


def test_the_transform_keeps_a_copy():
    matrix, dims = ras_grid()
    image = image_of(sampled(matrix, dims))
    transform = grid_transform(field_from_image(image, matrix))
    before = moved(transform, [[0.0, 0.0, 0.0]])
    image.GetPointData().GetScalars().Fill(0.0)  # the connector writes the next message into the same memory
    image.Modified()
    assert np.array_equal(moved(transform, [[0.0, 0.0, 0.0]]), before)


AXES = [(order, signs) for order in itertools.permutations(range(3)) for signs in itertools.product((1.0, -1.0), repeat=3)]


@pytest.mark.parametrize("order,signs", AXES)
def test_any_order_and_sign_of_the_axes_is_the_same_field(order, signs):
    dims, spacing = (29, 33, 41), (3.5, 3.0, 2.5)  # of i, j, k: 49, 48, 50 mm to each side
    matrix = np.eye(4)
    matrix[:3, :3] = 0.0
    for axis in range(3):
        matrix[order[axis], axis] = signs[axis] * spacing[axis]
    matrix[:3, 3] = -matrix[:3, :3] @ ((np.array(dims) - 1) / 2.0)
    vectors = sampled(matrix, dims)
    image = image_of(vectors)
    image.SetOrigin(99.0, 99.0, 99.0)  # counts for nothing
    field = field_from_image(image, matrix)
    assert (field.spacing > 0.0).all()
    points = points_inside(50)
    error = np.linalg.norm(moved(grid_transform(field), points) - (points + smooth(points)), axis=1)
    assert error.max() < 0.15
    voxel = np.array([12, 15, 18])
    place = matrix[:3, :3] @ voxel + matrix[:3, 3]
    assert moved(grid_transform(field), [place])[0] == pytest.approx(place + vectors[18, 15, 12], abs=1e-4)


def test_axes_in_single_precision_are_straight_enough():
    matrix, dims = ras_grid(spacing=4.0)
    wire = matrix.astype(np.float32).astype(np.float64)
    wire[0, 1] = 1e-7
    assert np.allclose(field_from_image(image_of(sampled(matrix, dims)), wire).spacing, 4.0)


@pytest.mark.parametrize("change,words", [
    (lambda m: m[:3, :3].__imul__(np.nan), "finite"),
    (lambda m: m[:3, 1].__imul__(0.0), "without length"),
    (lambda m: m.__setitem__((0, 1), 0.01), "oblique"),
    (lambda m: m.__setitem__((slice(0, 3), 1), m[:3, 0]), "oblique"),
])
def test_places_that_make_no_grid_are_refused(change, words):
    matrix, dims = ras_grid()
    image = image_of(sampled(matrix, dims))
    change(matrix)
    with pytest.raises(FieldError, match=words):
        field_from_image(image, matrix)


def test_what_is_no_vector_volume_is_refused():
    matrix, dims = ras_grid()
    with pytest.raises(FieldError, match="no voxels"):
        field_from_image(None, matrix)
    with pytest.raises(FieldError, match="no voxels"):
        field_from_image(vtk.vtkImageData(), matrix)
    with pytest.raises(FieldError, match="1 components"):
        field_from_image(image_of(np.zeros((4, 4, 4, 1), np.float32)), matrix)
    with pytest.raises(FieldError, match="4 x 4 x 2"):
        field_from_image(image_of(np.zeros((2, 4, 4, 3), np.float32)), matrix)
    with pytest.raises(FieldError, match="4 x 4 matrix"):
        field_from_image(image_of(np.zeros((4, 4, 4, 3), np.float32)), np.eye(3))


@pytest.mark.parametrize("place", [(0, 5, 5), (-1, 5, 5), (5, 0, 5), (5, -1, 5), (5, 5, 0), (5, 5, -1)])
def test_a_border_that_is_not_zero_is_refused(field, place):
    vectors = field.vectors.copy()
    vectors[place] = 0.01
    with pytest.raises(FieldError, match="outermost layer"):
        grid_transform(dataclasses.replace(field, vectors=vectors))


def test_a_field_that_is_not_finite_or_blank_is_refused(field):
    for value in (np.nan, np.inf):
        vectors = field.vectors.copy()
        vectors[8, 8, 8, 1] = value
        with pytest.raises(FieldError, match="finite"):
            check_field(dataclasses.replace(field, vectors=vectors))
    nothing = VectorField(np.zeros_like(field.vectors), field.origin, field.spacing)
    assert nothing.blank and not field.blank
    with pytest.raises(FieldError, match="blank"):
        check_field(nothing)


def test_magnitudes_are_lengths(field):
    assert field.magnitudes_mm.shape == field.vectors.shape[:3]
    assert field.magnitudes_mm[12, 12, 12] == pytest.approx(np.linalg.norm([3.0, -5.0, 7.0]), rel=1e-6)


# ---- what the bridge says

def label(**changes):
    return parse_state(json.dumps(label_values(**changes)))


def attributes(**changes):
    return {ATTRIBUTE_PREFIX + key: value for key, value in metadata(**changes).items()}


def test_json_and_metadata_say_the_same():
    assert parse_metadata(attributes().get) == label()
    assert isinstance(label(), Label) and label().sequence == 7 and label().age_ms == 40.0
    assert parse_metadata({}.get) is None
    assert label(age_ms=None, grid_error_mm=None).age_ms is None
    assert parse_metadata(attributes(age_ms=None).get).age_ms is None
    for truth in (True, False):
        assert parse_metadata(attributes(blank=truth).get).blank == label(blank=truth).blank == truth


@pytest.mark.parametrize("key", KEYS)
def test_a_missing_key_is_named(key):
    values, found = label_values(), attributes()
    del values[key], found[ATTRIBUTE_PREFIX + key]
    with pytest.raises(LabelError, match=f"{key}: missing"):
        parse_state(json.dumps(values))
    with pytest.raises(LabelError, match=f"{key}: missing"):
        parse_metadata(found.get)


def test_a_bridge_from_before_says_nothing_of_what_is_known():
    values, found = label_values(), attributes()
    del values["has_known"], found[ATTRIBUTE_PREFIX + "has_known"]
    assert not parse_state(json.dumps(values)).has_known and not parse_metadata(found.get).has_known
    assert label().has_known


@pytest.mark.parametrize("key,value", [
    ("sequence", -1), ("sequence", 1.5), ("sequence", True), ("sequence", "x"), ("sequence", None), ("sequence", []),
    ("session_id", 1.5), ("model_id", None), ("case_id", {}), ("quality", "fine"), ("quality", 3), ("currency", "Current"),
    ("currency", []), ("age_ms", -1.0), ("age_ms", "soon"), ("age_ms", False), ("age_ms", float("nan")),
    ("grid_error_mm", float("inf")), ("spacing_mm", []), ("direction", 1.0), ("blank", "yes"), ("blank", None), ("has_sd", 1),
    ("has_known", None), ("flags", ["a"]), ("reason", None)])
def test_a_value_without_sense_is_named(key, value):
    with pytest.raises(LabelError, match=f"^{key}: "):
        parse_state(json.dumps(label_values(**{key: value})))


@pytest.mark.parametrize("text", ["", "{", "[]", "7", "null", "\"s\"", "[" * 60000, " " * 70000, "\x00"])
def test_what_is_no_state_is_refused_in_one_line(text):
    with pytest.raises(LabelError) as caught:
        parse_state(text)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


# ---- the rule

def judge(field=None, state=None, pinned="m1", heard_s=0.1, lease_s=3.0, behind_s=0.6):
    return may_be_shown(field or label(), state or label(), pinned, heard_s, lease_s, behind_s)


def test_a_current_usable_field_of_this_patient_is_shown():
    assert judge().light is Light.GREEN and judge().show and judge().reason == ""
    assert judge(heard_s=3.0).show


@pytest.mark.parametrize("change", [dict(quality="unusable"), dict(quality="none"), dict(currency="stale"),
                                    dict(currency="none"), dict(model_id="m2"), dict(model_id=""), dict(session_id=12), dict(session_id=0),
                                    dict(session_id=""), dict(blank=True), dict(currency="degraded"), dict(sequence=6), dict(sequence=8), dict(direction="resampling"),
                                    dict(direction="")])
@pytest.mark.parametrize("who", ["field", "state"])
def test_one_word_against_it_suffices(who, change):
    verdict = judge(**{who: label(**change)})
    assert verdict.light is Light.RED and not verdict.show and verdict.reason


@pytest.mark.parametrize("change", [dict(quality="unusable"), dict(currency="stale"), dict(currency="none"),
                                    dict(model_id="m2"), dict(session_id=""), dict(session_id=0), dict(blank=True),
                                    dict(direction="resampling")])
def test_agreeing_on_what_is_wrong_makes_it_no_better(change):
    assert not judge(label(**change), label(**change)).show


def test_every_combination_is_shown_only_where_every_part_allows_it():
    shown = 0
    for quality, currency, model, session, heard in itertools.product(
            ("good", "caution", "unusable", "none"), ("current", "superseded", "aged", "expired", "degraded", "stale", "none"), ("m1", "m2"),
            (11, 12), (0.0, 2.9, 3.1, math.inf, math.nan)):
        one = label(quality=quality, currency=currency, model_id=model)
        verdict = judge(one, dataclasses.replace(one, session_id=str(session)), heard_s=heard)
        allowed = (quality in ("good", "caution") and currency in ("current", "superseded", "aged") and model == "m1"
                   and session == 11 and heard <= 3.0)
        assert verdict.show == allowed
        assert bool(verdict.reason) == (verdict.light is not Light.GREEN)
        shown += allowed
    assert shown == 12


def test_before_the_user_has_confirmed_the_model_nothing_is_shown():
    verdict = judge(pinned="")
    assert not verdict.show and "m1" in verdict.reason


def test_another_patients_model_is_named():
    assert "m2" in judge(state=label(model_id="m2")).reason and "m1" in judge(state=label(model_id="m2")).reason


def test_silence_and_absence_are_refused():
    assert "3.5 s" in judge(heard_s=3.5).reason
    assert not may_be_shown(None, label(), "m1", 0.1, 3.0, 0.0).show
    assert "version 2" in may_be_shown(None, label(), "m1", 0.1, 3.0, 0.0).reason
    assert not may_be_shown(label(), None, "m1", 0.1, 3.0, 0.0).show
    assert not may_be_shown(None, None, "", 0.1, 3.0, 0.0).show


def test_a_late_answer_is_amber():
    late = label(flags="late")
    assert judge(late, late).light is Light.AMBER
    assert "late" in judge(late, late).reason
    both = label(quality="caution", flags="deadline+late", reason="time ran out")
    assert judge(both, both).light is Light.AMBER
    assert "late" in judge(both, both).reason and "time ran out" in judge(both, both).reason
    unrelated = label(flags="latent")
    assert judge(unrelated, unrelated).light is Light.GREEN


def test_a_reservation_is_amber_with_its_reason():
    assert judge(label(quality="caution"), label(quality="caution", reason="few data")).reason == "few data"
    assert judge(label(quality="caution", flags="a+b"), label(quality="caution", flags="a+b")).light is Light.AMBER
    assert judge(state=label(currency="superseded", reason="a newer one comes")).reason == "superseded: a newer one comes"
    assert judge(state=label(currency="superseded")).light is Light.AMBER
    aged = judge(state=label(currency="aged", reason="35 s old"))
    assert (aged.light, aged.reason) == (Light.AMBER, "aged: 35 s old")
    assert judge(state=label(currency="expired", reason="too old")).light is Light.RED
    recorded = judge(field=label(recorded=True), state=label(recorded=True))
    assert (recorded.light, recorded.reason) == (Light.AMBER, "RECORDED, not the patient now")


def test_a_field_may_lag_behind_its_state_for_half_a_second():
    for sequence in (6, 8):
        assert judge(label(sequence=sequence), behind_s=0.5).light is Light.AMBER
        for too_long in (0.51, math.inf, math.nan):
            assert not judge(label(sequence=sequence), behind_s=too_long).show
        assert not judge(label(sequence=sequence, session_id=12), behind_s=0.0).show


def test_other_data_belong_by_model_session_and_update():
    assert belongs(label(), label(), 9.0) and not belongs(None, label(), 0.0)
    for change in (dict(session_id=12), dict(model_id="m2"), dict(blank=True)):
        assert not belongs(label(**change), label(), 0.0)
    assert belongs(label(sequence=6), label(), 0.5) and not belongs(label(sequence=6), label(), 0.6)


# ---- colours, and the core itself

def test_colours_grow_lighter_with_the_value():
    colours = sd_colours(64)
    assert colours.shape == (64, 3) and colours.min() >= 0.0 and colours.max() <= 1.0
    assert (np.diff(colours @ [0.2126, 0.7152, 0.0722]) > 0.0).all()
    assert np.array_equal(known_colours(64)[-1], colours[0]), "sure is dark in both"
    with pytest.raises(ValueError, match="count"):
        sd_colours(1)


CORE = ["label", "grid", "colours"]


@pytest.mark.parametrize("name", CORE)
def test_the_core_imports_nothing_of_slicer(name):
    tree = ast.parse((slicer_paths.MODULE / "BrainshiftLib" / f"{name}.py").read_text())
    roots = {alias.name.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    roots |= {node.module.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert not roots & {"slicer", "qt", "ctk"}
    assert roots <= {"__future__", "dataclasses", "enum", "json", "math", "numpy", "time", "typing", "vtk"}


def test_every_name_of_the_core_is_typed(tmp_path):
    files = [slicer_paths.MODULE / "BrainshiftLib" / f"{name}.py" for name in CORE]
    done = subprocess.run(["mypy", "--strict", "--ignore-missing-imports", "--python-executable", sys.executable, "--cache-dir",
                           tmp_path, *files], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stdout + done.stderr
