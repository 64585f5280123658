# SPDX-License-Identifier: Apache-2.0
"""Values to Protobuf messages and back. Nothing else knows the generated modules."""
from __future__ import annotations

from typing import Any, Optional, TypeVar

import numpy as np
from google.protobuf.message import DecodeError

from . import values as v
from .errors import Error, ProtocolError
from .v1 import brainshift_pb2 as pb

Message = TypeVar("Message")


def parse(message: Message, payload: bytes) -> Message:
    """The message with the payload's content; ProtocolError when it is not one."""
    try:
        message.ParseFromString(payload)  # type: ignore[attr-defined]
    except DecodeError:
        raise ProtocolError(f"{type(message).__name__}: the payload is damaged") from None
    return message


def _bytes_of_numbers(message: Any, kind: str) -> Any:
    """The numbers of a message whose only field is packed xyz_mm: the end of its bytes, ten times
    faster than one number after the other."""
    count = len(message.xyz_mm)
    raw = message.SerializeToString()
    return np.frombuffer(raw, np.dtype(kind), count, len(raw) - count * np.dtype(kind).itemsize)


def _points(message: Any, name: str) -> v.Floats:
    points: v.Floats = _bytes_of_numbers(message, "<f8").astype(np.float64)
    if points.size % 3 != 0:
        raise ProtocolError(f"{name}: {points.size} numbers, must be a multiple of 3")
    return points.reshape(-1, 3)


def _rows(packed: Any, columns: int, name: str) -> v.Indices:
    rows = np.asarray(packed, dtype=np.int32)
    if rows.size % columns != 0:
        raise ProtocolError(f"{name}: {rows.size} numbers, must be a multiple of {columns}")
    return rows.reshape(-1, columns)


def _indices(packed: Any) -> v.Indices:
    return np.asarray(packed, dtype=np.int32)


def _surface(surface: Any, name: str) -> v.Surface:
    return v.Surface(_points(surface.vertices, name), _rows(surface.triangle_indices, 3, name))


def _optional(message: Any, name: str) -> Optional[float]:
    return float(getattr(message, name)) if message.HasField(name) else None


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
    return v.Session(_key(m), m.nodes, m.tets, m.slaves, m.prepare_s, m.model_bytes)


def session_state(payload: bytes) -> v.SessionState:
    m = parse(pb.SessionState(), payload)
    try:
        phase = v.Phase(m.phase)
    except ValueError:
        raise ProtocolError(f"SessionState: phase {m.phase} is not known") from None
    return v.SessionState(_key(m.session), phase, m.newest_update, m.newest_usable, m.age_ms, m.valid_ms, m.reason,
                          m.preparing, m.aged_after_ms, m.expired_after_ms, m.recorded, m.method, m.boundary)


def receipt(payload: bytes) -> v.Receipt:
    m = parse(pb.ObservationReply(), payload)
    return v.Receipt(m.observation_sequence, m.replaced_pending)


def model(payload: bytes) -> v.Model:
    m = parse(pb.ModelReply(), payload)
    nodes, tets = _points(m.nodes, "nodes"), _rows(m.tet_indices, 4, "tet_indices")
    boundary = _rows(m.boundary_indices, 3, "boundary_indices")
    for name, indices in (("tet_indices", tets), ("boundary_indices", boundary)):
        if indices.size > 0 and (indices.min() < 0 or indices.max() >= len(nodes)):
            raise ProtocolError(f"ModelReply: {name} name nodes that there are not")
    labels = _indices(m.tet_labels)
    if len(labels) not in (0, len(tets)):
        raise ProtocolError(f"ModelReply: {len(labels)} tet_labels for {len(tets)} tetrahedra")
    return v.Model(
        m.case_id, m.model_id, nodes, tets, boundary, _surface(m.skull, "skull"), _surface(m.tumour, "tumour"),
        _indices(m.craniotomy), _indices(m.brainstem), _indices(m.slaves), _indices(m.fixed),
        np.asarray(m.gravity_direction, dtype=np.float64), m.fluid_plane_depth_mm, m.slave_plane_depth_mm,
        labels if len(labels) > 0 else None)


# ---------- updates ----------


def _contact(m: Any) -> v.Contact:
    return v.Contact(m.active, m.penetrating, m.max_penetration_mm, m.iterations, _indices(m.active_slaves),
                     np.asarray(m.force_n, dtype=np.float32), _optional(m, "decrement"),
                     _optional(m, "max_violation_mm"))


def _source(m: Any) -> v.SourceSummary:
    return v.SourceSummary(m.source, m.observation_sequence, m.age_s, m.data, m.outliers, m.consistent,
                           _optional(m, "chi_square"), _optional(m, "degrees_of_freedom"), _optional(m, "p_value"))


def _quality(m: Any) -> tuple[v.Quality, tuple[v.QualityFlag, ...]]:
    try:
        return v.Quality(m.quality), tuple(v.QualityFlag(flag) for flag in m.quality_flags)
    except ValueError:
        raise ProtocolError("Update: a quality or a flag is not known") from None


def update(payload: bytes) -> v.Update:
    m = parse(pb.Update(), payload)
    displacement: Optional[v.Singles] = None
    if m.HasField("displacement"):
        packed = _bytes_of_numbers(m.displacement, "<f4").astype(np.float32)
        if packed.size % 3 != 0:
            raise ProtocolError(f"Update: displacement has {packed.size} numbers, must be a multiple of 3")
        displacement = packed.reshape(-1, 3)
    sd = np.fromiter(m.sd_mm, np.float32, len(m.sd_mm)) if len(m.sd_mm) > 0 else None
    if sd is not None and (displacement is None or len(sd) != len(displacement)):
        raise ProtocolError("Update: sd_mm is not of the nodes of the displacement")
    nodes: Optional[v.Indices] = None
    if m.HasField("part"):
        nodes = np.cumsum(np.asarray(m.part.node_steps, dtype=np.int64)).astype(np.int32)
        if displacement is None or len(nodes) != len(displacement):
            raise ProtocolError("Update: part is not of the nodes of the displacement")
        if len(nodes) > 0 and (nodes[-1] >= m.part.mesh_nodes or (np.diff(nodes) <= 0).any() or nodes[0] < 0):
            raise ProtocolError("Update: part names nodes that there are not")
    quality, flags = _quality(m)
    timings = m.timings
    return v.Update(
        case_id=m.case_id, session=_key(m), sequence=m.sequence, observation_sequence=m.observation_sequence,
        method=m.method, boundary=m.boundary, final=m.final, status=m.status, reason=m.reason,
        error_code=m.error_code, displacement_mm=displacement, sd_mm=sd, nodes=nodes,
        mesh_nodes=m.part.mesh_nodes if nodes is not None else None, quality=quality, quality_flags=flags,
        quality_reason=m.quality_reason, contact=_contact(m.contact) if m.HasField("contact") else None,
        initial_misfit=_mean_std(m, "initial_misfit"), misfit=_mean_std(m, "misfit"),
        timings=v.Timings(timings.register_ms, timings.invert_ms, timings.rebuild_ms, timings.encode_ms,
                          timings.journal_ms),
        answer_time=v.AnswerTime(m.answer_time.ms, m.answer_time.usual_ms, m.answer_time.late),
        left_out=tuple(v.Omission(o.part, o.reason, o.estimated_error) for o in m.left_out),
        sources=tuple(_source(s) for s in m.sources),
        prior_strengths=tuple(v.PriorStrength(s.part, s.mean, s.absent, s.at_bound) for s in m.prior_strengths),
        min_volume_ratio=_optional(m, "min_volume_ratio"), inverted_elements=m.inverted_elements,
        misfit_ratio=_optional(m, "misfit_ratio"), data_outside_region=m.data_outside_region)


def _mean_std(message: Any, name: str) -> Optional[v.MeanStd]:
    if not message.HasField(name):
        return None
    value = getattr(message, name)
    return v.MeanStd(value.mean_mm, value.std_mm)


def recorded_observation(payload: bytes) -> v.Observation:
    """An observation as a surgery file keeps it; ProtocolError when it has no body."""
    m = parse(pb.Observation(), payload)
    kind = m.WhichOneof("body")
    body: v.Body
    if kind == "tumour_boundary":
        body = v.TumourBoundary(_points(m.tumour_boundary.points, "points"), m.tumour_boundary.sd_mm)
    elif kind == "cortical_surface":
        surface = _surface(m.cortical_surface.surface, "surface")
        triangles = surface.triangles if len(surface.triangles) > 0 else None
        body = v.CorticalSurface(surface.vertices, m.cortical_surface.sd_mm, triangles)
    elif kind == "landmark_pairs":
        pairs = m.landmark_pairs
        body = v.LandmarkPairs(_points(pairs.undeformed, "undeformed"),
                               _points(pairs.deformed, "deformed"), pairs.sd_mm)
    elif kind == "patient_pose":
        body = v.PatientPose(np.asarray(m.patient_pose.gravity_direction, dtype=np.float64),
                             _optional(m.patient_pose, "fluid_level_mm"))
    else:
        raise ProtocolError("Observation: it has no body")
    return v.Observation(m.case_id, m.source, m.sequence, body, m.acquired_ns, m.acquired_wall_ns, _key(m.session),
                         m.sent_ns)
