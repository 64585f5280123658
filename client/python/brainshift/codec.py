# SPDX-License-Identifier: Apache-2.0
"""Values to Protobuf messages and back. Nothing else knows the generated modules.

What is received is held to checked.py: whatever the C++ client refuses is a ProtocolError here.
"""
from __future__ import annotations

from typing import Any, Callable, Optional, TypeVar

import numpy as np
from google.protobuf.message import DecodeError

from . import checked, values as v
from .errors import Error, ProtocolError
from .v1 import brainshift_pb2 as pb

Message = TypeVar("Message")


def parse(message: Message, payload: bytes) -> Message:
    """The message with the payload's content; ProtocolError when it is not one."""
    checked.scan(message.DESCRIPTOR, payload)  # type: ignore[attr-defined]
    try:
        message.ParseFromString(payload)  # type: ignore[attr-defined]
    except DecodeError:
        raise ProtocolError(f"{type(message).__name__}: the payload is damaged") from None
    return message


def _bytes_of_numbers(message: Any, kind: str) -> Any:
    """The numbers of a message whose only field is packed xyz_mm: the end of its bytes, ten times
    faster than one number after the other."""
    count = len(message.xyz_mm)
    message.DiscardUnknownFields()  # of a newer minor version: they would stand behind the numbers
    raw = message.SerializeToString()
    return np.frombuffer(raw, np.dtype(kind), count, len(raw) - count * np.dtype(kind).itemsize)


def _points(message: Any, name: str) -> v.Floats:
    points: v.Floats = _threes(_bytes_of_numbers(message, "<f8").astype(np.float64), name)
    return points


def _threes(numbers: Any, name: str) -> Any:
    checked.require(numbers.size % 3 == 0, name, f"{numbers.size} numbers, must be a multiple of 3")
    return checked.finite(numbers.reshape(-1, 3), name)


def _rows(packed: Any, columns: int, limit: int, name: str) -> v.Indices:
    rows = np.asarray(packed, dtype=np.int32)
    checked.require(rows.size % columns == 0, name, f"{rows.size} numbers, must be a multiple of {columns}")
    return checked.indices(rows.reshape(-1, columns), limit, name, checked.MOST_CELLS)


def _indices(packed: Any, limit: int, name: str) -> v.Indices:
    return checked.indices(np.asarray(packed, dtype=np.int32), limit, name)


def _surface(surface: Any, name: str) -> v.Surface:
    vertices = _points(surface.vertices, f"{name}.vertices")
    return v.Surface(vertices, _rows(surface.triangle_indices, 3, len(vertices), f"{name}.triangle_indices"))


def _optional(message: Any, name: str, check: Callable[[float, str], float] = checked.number) -> Optional[float]:
    return check(float(getattr(message, name)), name) if message.HasField(name) else None


def _times(message: Any, *names: str) -> list[float]:
    return [checked.non_negative(getattr(message, name), name) for name in names]


def _key(message: Any) -> v.SessionKey:
    return v.SessionKey(message.boot_id, message.session_id, message.model_id)


# ---------- requests ----------


def start_session(case_id: str, method: str, boundary: str, publish_iterates: bool,
                  takeover: bool, recorded_clock: bool) -> bytes:
    return bytes(pb.StartSessionRequest(
        case_id=case_id, method=method, boundary=boundary, publish_iterates=publish_iterates,
        takeover=takeover,
        recorded_clock=recorded_clock).SerializeToString())


def subscribe(subscription: int, window: int, received: int, choice: v.Choice) -> bytes:
    message = pb.SubscribeRequest(subscription=subscription, window=window, received=received)
    if choice != v.Choice():
        message.choice.SetInParent()
        message.choice.spacing_mm = choice.spacing_mm
        message.choice.without_sd = choice.without_sd
        if isinstance(choice.region, v.Ball):
            message.choice.ball.centre_mm.extend(_vector(choice.region.centre_mm, "centre_mm"))
            message.choice.ball.radius_mm = choice.region.radius_mm
        elif isinstance(choice.region, v.NearTumour):
            message.choice.tumour.SetInParent()
            message.choice.tumour.margin_mm = choice.region.margin_mm
    return bytes(message.SerializeToString())


def _vector(value: Any, name: str) -> Any:
    vector = np.asarray(value, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError(f"{name}: must be 3 finite numbers")
    return vector.tolist()


def _packed_points(value: Any, name: str) -> Any:
    points = np.asarray(value, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{name}: must be an array (n, 3), is {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError(f"{name}: has numbers that are not finite")
    return points.ravel().tolist()


def observation(value: v.Observation) -> bytes:
    """ValueError names the array that has a wrong shape or numbers that are not finite."""
    message = pb.Observation(
        case_id=value.case_id, frame="ras", source=value.source, sequence=value.sequence,
        acquired_ns=value.acquired_ns, acquired_wall_ns=value.acquired_wall_ns, sent_ns=value.sent_ns)
    if value.session != v.SessionKey():
        message.session.boot_id = value.session.boot_id
        message.session.session_id = value.session.session_id
        message.session.model_id = value.session.model_id
    body = value.body
    if isinstance(body, v.TumourBoundary):
        message.tumour_boundary.points.xyz_mm.extend(_packed_points(body.points, "points"))
        message.tumour_boundary.sd_mm = body.sd_mm
    elif isinstance(body, v.CorticalSurface):
        surface = message.cortical_surface.surface
        surface.vertices.xyz_mm.extend(_packed_points(body.vertices, "vertices"))
        if body.triangles is not None:
            triangles = np.asarray(body.triangles, dtype=np.int64)
            if triangles.ndim != 2 or triangles.shape[1] != 3:
                raise ValueError(f"triangles: must be an array (m, 3), is {triangles.shape}")
            surface.triangle_indices.extend(triangles.ravel().tolist())
        message.cortical_surface.sd_mm = body.sd_mm
    elif isinstance(body, v.LandmarkPairs):
        undeformed = _packed_points(body.undeformed, "undeformed")
        deformed = _packed_points(body.deformed, "deformed")
        if len(undeformed) != len(deformed):
            raise ValueError("undeformed and deformed: must have as many rows")
        message.landmark_pairs.undeformed.xyz_mm.extend(undeformed)
        message.landmark_pairs.deformed.xyz_mm.extend(deformed)
        message.landmark_pairs.sd_mm = body.sd_mm
    elif isinstance(body, v.PatientPose):
        message.patient_pose.gravity_direction.extend(_vector(body.gravity_direction, "gravity_direction"))
        if body.fluid_level_mm is not None:
            message.patient_pose.fluid_level_mm = body.fluid_level_mm
    else:
        raise ValueError(f"body: {type(body).__name__} is no observation")
    return bytes(message.SerializeToString())


# ---------- replies ----------


def error(payload: bytes) -> Error:
    message = parse(pb.ErrorReply(), payload)
    return Error(message.code, message.message)


def status(payload: bytes) -> v.Status:
    m = parse(pb.StatusReply(), payload)
    return v.Status(m.version, m.model_ready, m.case_id, m.model_id, m.busy, m.updates, m.uptime_ms, m.build,
                    m.machine, m.blas_kernel)


def session(payload: bytes) -> v.Session:
    m = parse(pb.StartSessionReply(), payload)
    nodes, tets, slaves = (checked.count(getattr(m, name), name) for name in ("nodes", "tets", "slaves"))
    return v.Session(_key(m), nodes, tets, slaves, checked.non_negative(m.prepare_s, "prepare_s"), m.model_bytes)


def session_state(payload: bytes) -> v.SessionState:
    m = parse(pb.SessionState(), payload)
    try:
        phase = v.Phase(m.phase)
    except ValueError:
        raise ProtocolError(f"SessionState: phase {m.phase} is not known") from None
    checked.require(m.newest_usable <= m.newest_update, "newest_usable", "is above newest_update")
    checked.require(m.valid_ms <= v.SessionState.MOST_VALID_MS, "valid_ms",
                    f"{m.valid_ms}, must be at most {v.SessionState.MOST_VALID_MS}")
    checked.non_negative(m.age_ms, "age_ms")
    return v.SessionState(_key(m.session), phase, m.newest_update, m.newest_usable, m.age_ms, m.valid_ms, m.reason,
                          m.preparing, m.aged_after_ms, m.expired_after_ms, m.recorded, m.method, m.boundary)


def receipt(payload: bytes) -> v.Receipt:
    m = parse(pb.ObservationReply(), payload)
    return v.Receipt(m.observation_sequence, m.replaced_pending)


def model(payload: bytes) -> v.Model:
    m = parse(pb.ModelReply(), payload)
    nodes = _points(m.nodes, "nodes")
    count = len(nodes)
    tets = _rows(m.tet_indices, 4, count, "tet_indices")
    labels = np.asarray(m.tet_labels, dtype=np.int32)
    checked.require(len(labels) in (0, len(tets)), "tet_labels", f"{len(labels)} for {len(tets)} tetrahedra")
    craniotomy, brainstem, slaves, fixed = (
        _indices(getattr(m, name), count, name) for name in ("craniotomy", "brainstem", "slaves", "fixed"))
    return v.Model(
        m.case_id, m.model_id, nodes, tets, _rows(m.boundary_indices, 3, count, "boundary_indices"),
        _surface(m.skull, "skull"), _surface(m.tumour, "tumour"), craniotomy, brainstem, slaves, fixed,
        checked.unit_vector(m.gravity_direction, "gravity_direction"),
        checked.number(m.fluid_plane_depth_mm, "fluid_plane_depth_mm"),
        checked.number(m.slave_plane_depth_mm, "slave_plane_depth_mm"), labels if len(labels) > 0 else None,
        _rows(m.septa_indices, 3, count, "septa_indices"), _rows(m.ventricle_indices, 3, count, "ventricle_indices"))


# ---------- updates ----------


_STATUSES = ("not_run", "iterating", "converged", "iteration_limit", "deadline")
_METHODS = ("condensed", "paper", "paper-woodbury", "pcg")
_BOUNDARIES = ("contact", "fixed")
_PRIOR_PARTS = {"along_gravity", "across_gravity", "gravity_sides", "gravity_ends", "tumour_volume", "brain_volume",
                "resection", "opening", "ventricles", "tract", "fine", "medium", "coarse", "far"}
_MOST_HYPOTHESES = 4096
_UNUSABLE_FROM = 17  # flags


def _contact(m: Any, nodes: int) -> v.Contact:
    slaves = _indices(m.active_slaves, nodes, "contact.active_slaves")
    forces = checked.finite(np.asarray(m.force_n, dtype=np.float32), "contact.force_n")
    checked.require(len(slaves) == len(forces), "contact.force_n", f"{len(forces)} for {len(slaves)} active slaves")
    active, penetrating, iterations = (
        checked.count(getattr(m, name), f"contact.{name}") for name in ("active", "penetrating", "iterations"))
    return v.Contact(active, penetrating, checked.number(m.max_penetration_mm, "contact.max_penetration_mm"), iterations,
                     slaves, forces, _optional(m, "decrement", checked.non_negative),
                     _optional(m, "max_violation_mm"))


def _source(m: Any) -> v.SourceSummary:
    tested = m.HasField("p_value")
    if tested:
        _times(m, "chi_square", "degrees_of_freedom", "p_value")
    return v.SourceSummary(m.source, m.observation_sequence, checked.number(m.age_s, "sources.age_s"),
                           checked.count(m.data, "sources.data"), checked.count(m.outliers, "sources.outliers"),
                           m.consistent, *((m.chi_square, m.degrees_of_freedom, m.p_value) if tested else (None,) * 3))


def _quality(m: Any) -> tuple[v.Quality, tuple[v.QualityFlag, ...]]:
    """The quality must be that of the flags, each of which is known and stands once."""
    try:
        quality, flags = v.Quality(m.quality), tuple(v.QualityFlag(flag) for flag in m.quality_flags)
    except ValueError:
        raise ProtocolError("Update: a quality or a flag is not known") from None
    checked.require(len(set(flags)) == len(flags), "quality_flags", "a flag occurs more than once")
    due = quality
    if flags:
        due = v.Quality.UNUSABLE if max(flags) >= _UNUSABLE_FROM else v.Quality.CAUTION
    elif quality is not v.Quality.UNSPECIFIED:
        due = v.Quality.GOOD
    checked.require(quality is due, "quality", f"{quality.name}, must be that of its flags: {due.name}")
    return quality, flags


def _prior(m: Any) -> tuple[v.PriorStrength, ...]:
    parts = [strength.part for strength in m.prior_strengths]
    # An older prior has fewer parts.
    checked.require(_PRIOR_PARTS.issuperset(parts), "prior_strengths.part", f"must be one of {sorted(_PRIOR_PARTS)}")
    checked.require(len(set(parts)) == len(parts), "prior_strengths.part", "occurs more than once")
    checked.require(len(m.hypotheses) <= _MOST_HYPOTHESES, "hypotheses", f"must be at most {_MOST_HYPOTHESES}")
    checked.require(bool(parts) or not m.hypotheses, "hypotheses", "are present without prior_strengths")
    for hypothesis in m.hypotheses:
        checked.require(len(hypothesis.scales) == len(parts), "hypotheses.scales", "must be one for each strength")
        checked.probability(hypothesis.weight, "hypotheses.weight")
        for scale in hypothesis.scales:
            checked.non_negative(scale, "hypotheses.scales")
    return tuple(
        v.PriorStrength(s.part, checked.non_negative(s.mean, "prior_strengths.mean"),
                        checked.probability(s.absent, "prior_strengths.absent"), s.at_bound) for s in m.prior_strengths)


def _part(m: Any) -> Optional[v.Indices]:
    """The nodes that the rows are of; None: all."""
    if not m.HasField("part"):
        return None
    part = m.part
    checked.require(1 <= part.mesh_nodes <= checked.MOST_POINTS, "part.mesh_nodes", f"{part.mesh_nodes}")
    if part.base_sequence != 0:
        checked.require(m.final and part.base_sequence < m.sequence, "part.base_sequence",
                        "must be below the sequence of a final update")
    steps = np.asarray(part.node_steps, dtype=np.int64)
    checked.require(part.base_sequence != 0 or steps.size > 0, "part.node_steps", "no node, although there is no base")
    checked.require(bool((steps[1:] != 0).all()), "part.node_steps", "a node twice")
    return checked.indices(np.cumsum(steps), part.mesh_nodes, "part.node_steps").astype(np.int32)


def _history(m: Any) -> None:
    for record in m.history:
        checked.count(record.iteration, "history.iteration")
        checked.count(record.penetrating, "history.penetrating")
        checked.number(record.max_penetration_mm, "history.max_penetration_mm")
        _times(record, "elapsed_ms")
        _mean_std(record.misfit, "history.misfit")


def _check_failure(m: Any) -> None:
    checked.require(m.error_code != "", "error_code", "is absent although status is \"failed\"")
    checked.require(len(m.displacement.xyz_mm) == 0 and not m.HasField("part") and m.quality == 0, "status",
                    "\"failed\" although there is a field, a part or a quality")


def update(payload: bytes) -> v.Update:
    m = parse(pb.Update(), payload)
    checked.require(m.method in _METHODS, "method", f"{m.method!r} is unknown")
    checked.require(m.boundary in _BOUNDARIES, "boundary", f"{m.boundary!r} is unknown")
    timings = v.Timings(*_times(m.timings, "register_ms", "invert_ms", "rebuild_ms", "encode_ms", "journal_ms"))
    ms, usual_ms, age_ms = _times(m.answer_time, "ms", "usual_ms", "age_ms")
    answer = v.AnswerTime(ms, usual_ms, m.answer_time.late, age_ms)
    checked.require(answer.late == (answer.usual_ms > 0.0 and answer.ms > 2.0 * answer.usual_ms), "answer_time.late",
                    "does not follow from ms and usual_ms")
    if m.HasField("t_undeformed_deformed"):
        pose = m.t_undeformed_deformed
        checked.rigid(pose.rotation_row_major, pose.translation_mm, "t_undeformed_deformed")
    failed = m.status == "failed"
    if failed:
        _check_failure(m)
        m = _envelope(m)
    else:
        checked.require(m.error_code == "", "error_code", "is present although status is not \"failed\"")
        checked.require(m.status in _STATUSES, "status", f"{m.status!r} is unknown")
    has_field = m.HasField("displacement")  # before it is read, which may make one
    displacement: v.Singles = _threes(_bytes_of_numbers(m.displacement, "<f4").astype(np.float32), "displacement")
    nodes = _part(m)
    checked.require(nodes is None or len(nodes) == len(displacement), "part.node_steps",
                    f"part: {0 if nodes is None else len(nodes)} nodes for {len(displacement)} displacements")
    sd = checked.finite(np.fromiter(m.sd_mm, np.float32, len(m.sd_mm)), "sd_mm")
    checked.require(len(sd) in (0, len(displacement)), "sd_mm", f"{len(sd)} for {len(displacement)} displacements")
    known: Optional[v.Singles] = None
    if len(m.known) > 0:  # a byte per node
        known = np.frombuffer(m.known, np.uint8).astype(np.float32) / np.float32(255.0)
        checked.require(len(known) == len(displacement), "known", f"{len(known)} for {len(displacement)} displacements")
    _history(m)
    quality, flags = _quality(m)
    contact = _contact(m.contact, len(displacement) if nodes is None else m.part.mesh_nodes)
    value = v.Update(
        case_id=m.case_id, session=_key(m), sequence=m.sequence, observation_sequence=m.observation_sequence,
        method=m.method, boundary=m.boundary, final=m.final, status=m.status, reason=m.reason,
        error_code=m.error_code, displacement_mm=displacement if has_field else None,
        sd_mm=sd if len(sd) > 0 else None, known=known, nodes=nodes,
        mesh_nodes=m.part.mesh_nodes if nodes is not None else None, quality=quality, quality_flags=flags,
        quality_reason=m.quality_reason, contact=contact if m.HasField("contact") else None,
        initial_misfit=_mean_std_of(m, "initial_misfit"), misfit=_mean_std_of(m, "misfit"),
        timings=timings, answer_time=answer,
        left_out=tuple(v.Omission(o.part, o.reason, o.estimated_error) for o in m.left_out),
        sources=tuple(_source(s) for s in m.sources), prior_strengths=_prior(m),
        min_volume_ratio=_optional(m, "min_volume_ratio"),
        inverted_elements=checked.count(m.inverted_elements, "inverted_elements"),
        misfit_ratio=_optional(m, "misfit_ratio", checked.non_negative),
        data_outside_region=checked.count(m.data_outside_region, "data_outside_region"),
        region_known=_optional(m, "region_known", checked.probability),
        ventricle_change_mm3=_optional(m, "ventricle_change_mm3"))
    checked.require(nodes is None or m.part.base_sequence == 0 or value.usable, "part.base_sequence",
                    "is present although the update is not usable")
    return value


def check_mesh(value: v.Update, mesh_nodes: int) -> None:
    """ProtocolError when the field is not one of a mesh of so many nodes; 0: it is not known."""
    if mesh_nodes == 0 or value.failed:
        return
    if value.nodes is not None:
        checked.require(value.mesh_nodes == mesh_nodes, "part.mesh_nodes", f"{value.mesh_nodes}, the mesh has {mesh_nodes}")
        return
    rows = 0 if value.displacement_mm is None else len(value.displacement_mm)
    checked.require(rows == mesh_nodes or (rows == 0 and not value.usable), "displacement",
                    f"{rows} nodes, the mesh has {mesh_nodes}")


def _envelope(m: Any) -> Any:
    """Of a failed update: whatever speaks of a field counts for nothing, as in the C++ client."""
    only = pb.Update(case_id=m.case_id, model_id=m.model_id, boot_id=m.boot_id, session_id=m.session_id,
                     sequence=m.sequence, observation_sequence=m.observation_sequence, method=m.method,
                     boundary=m.boundary, final=m.final, status=m.status, reason=m.reason, error_code=m.error_code)
    only.left_out.MergeFrom(m.left_out)
    return only


def _mean_std(value: Any, name: str) -> v.MeanStd:
    return v.MeanStd(checked.number(value.mean_mm, f"{name}.mean_mm"),
                     checked.non_negative(value.std_mm, f"{name}.std_mm"))


def _mean_std_of(message: Any, name: str) -> Optional[v.MeanStd]:
    return _mean_std(getattr(message, name), name) if message.HasField(name) else None


def recorded_observation(payload: bytes) -> v.Observation:
    """An observation as a surgery file keeps it; ProtocolError when it has no body."""
    m = parse(pb.Observation(), payload)
    kind = m.WhichOneof("body")
    body: v.Body
    if kind == "tumour_boundary":
        body = v.TumourBoundary(_points(m.tumour_boundary.points, "points"), checked.non_negative(m.tumour_boundary.sd_mm, "sd_mm"))
    elif kind == "cortical_surface":
        surface = _surface(m.cortical_surface.surface, "surface")
        triangles = surface.triangles if len(surface.triangles) > 0 else None
        body = v.CorticalSurface(surface.vertices, checked.non_negative(m.cortical_surface.sd_mm, "sd_mm"), triangles)
    elif kind == "landmark_pairs":
        pairs = m.landmark_pairs
        body = v.LandmarkPairs(_points(pairs.undeformed, "undeformed"),
                               _points(pairs.deformed, "deformed"), checked.non_negative(pairs.sd_mm, "sd_mm"))
        checked.require(np.shape(body.undeformed) == np.shape(body.deformed), "landmark_pairs", "must be as many")
    elif kind == "patient_pose":
        body = v.PatientPose(checked.unit_vector(m.patient_pose.gravity_direction, "gravity_direction"),
                             _optional(m.patient_pose, "fluid_level_mm"))
    else:
        raise ProtocolError("Observation: it has no body")
    return v.Observation(m.case_id, m.source, m.sequence, body, m.acquired_ns, m.acquired_wall_ns, _key(m.session),
                         m.sent_ns)
