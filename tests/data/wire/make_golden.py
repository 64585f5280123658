#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the golden frames of protocol version 2: NAME.bin and its description NAME.json.

A second implementation of the protocol, by hand from proto/brainshift/v1/brainshift.proto and
common/wire/frame.hpp with the Python standard library alone; it shares no code with common/wire. The
values are made up here (MESSAGES); they are chosen to exercise signs, large integers, non-ASCII text,
absent fields and numbers without a short decimal form. 32-bit floats hold values that are exact in them.
Run it only when the protocol changes:  python3 tests/data/wire/make_golden.py
"""
import json
import pathlib
import struct
import zlib

# message: field name -> (number, kind). "*kind" is repeated (numbers packed); "?kind" is sent even if zero; "hex" are bytes.
SCHEMA = {
    "PointSet": {"xyz_mm": (1, "*double")},
    "Displacements": {"xyz_mm": (1, "*float")},
    "Surface": {"vertices": (1, "PointSet"), "triangle_indices": (2, "*int")},
    "Rigid": {"rotation_row_major": (1, "*double"), "translation_mm": (2, "*double")},
    "TumourBoundary": {"points": (1, "PointSet"), "sd_mm": (2, "double")},
    "CorticalSurface": {"surface": (1, "Surface"), "sd_mm": (2, "double")},
    "LandmarkPairs": {"undeformed": (1, "PointSet"), "deformed": (2, "PointSet"), "sd_mm": (3, "double")},
    "PatientPose": {"gravity_direction": (1, "*double"), "fluid_level_mm": (2, "?double")},
    "SessionKey": {"boot_id": (1, "fixed"), "session_id": (2, "int"), "model_id": (3, "text")},
    "SessionState": {
        "session": (1, "SessionKey"), "phase": (2, "int"), "newest_update": (3, "int"),
        "newest_usable": (4, "int"), "age_ms": (5, "double"), "valid_ms": (6, "int"),
        "reason": (7, "text"), "preparing": (8, "int"), "recording": (9, "RecordingState"),
        "aged_after_ms": (10, "int"), "expired_after_ms": (11, "int"), "recorded": (12, "int"),
        "method": (13, "text"), "boundary": (14, "text")},
    "RecordingState": {"recording": (1, "int"), "reason": (2, "text"), "sources": (3, "*RecordedSource")},
    "RecordedSource": {"source": (1, "text"), "until": (2, "int"), "lost_until": (3, "int")},
    "SubscribeRequest": {
        "subscription": (1, "int"), "window": (2, "int"), "received": (3, "int"),
        "choice": (4, "FieldChoice")},
    "FieldChoice": {
        "ball": (1, "BallRegion"), "tumour": (2, "TumourRegion"), "spacing_mm": (3, "double"),
        "tolerance_mm": (4, "double"), "without_sd": (5, "int")},
    "BallRegion": {"centre_mm": (1, "*double"), "radius_mm": (2, "double")},
    "TumourRegion": {"margin_mm": (1, "double")},
    "FieldPart": {"mesh_nodes": (1, "int"), "node_steps": (2, "*int"), "base_sequence": (3, "int")},
    "Observation": {
        "case_id": (1, "text"), "frame": (2, "text"), "source": (3, "text"), "sequence": (4, "int"),
        "acquired_ns": (5, "int"), "acquired_wall_ns": (6, "int"), "session": (7, "SessionKey"),
        "sent_ns": (8, "int"), "daemon_ns": (9, "int"),
        "tumour_boundary": (10, "TumourBoundary"), "cortical_surface": (11, "CorticalSurface"),
        "landmark_pairs": (12, "LandmarkPairs"), "patient_pose": (13, "PatientPose")},
    "Empty": {},
    "StatusReply": {
        "version": (1, "text"), "model_ready": (2, "int"), "case_id": (3, "text"), "model_id": (4, "text"),
        "busy": (5, "int"), "updates": (6, "int"), "uptime_ms": (7, "int")},
    "StartSessionRequest": {
        "case_id": (1, "text"), "method": (2, "text"), "boundary": (3, "text"),
        "publish_iterates": (4, "int"), "takeover": (6, "int"), "recorded_clock": (7, "int")},
    "StartSessionReply": {
        "session_id": (1, "int"), "model_id": (2, "text"), "nodes": (3, "int"), "tets": (4, "int"),
        "slaves": (5, "int"), "prepare_s": (6, "double"), "model_bytes": (7, "int"), "boot_id": (10, "fixed")},
    "ModelReply": {
        "case_id": (1, "text"), "model_id": (2, "text"), "nodes": (3, "PointSet"),
        "tet_indices": (4, "*int"), "boundary_indices": (5, "*int"), "skull": (6, "Surface"),
        "tumour": (7, "Surface"), "craniotomy": (8, "*int"), "brainstem": (9, "*int"),
        "slaves": (10, "*int"), "fixed": (11, "*int"), "gravity_direction": (12, "*double"),
        "fluid_plane_depth_mm": (13, "double"), "slave_plane_depth_mm": (14, "double"),
        "tet_labels": (15, "*int"), "septa_indices": (16, "*int"), "ventricle_indices": (17, "*int")},
    "ObservationReply": {"observation_sequence": (1, "int"), "replaced_pending": (2, "int")},
    "ErrorReply": {"code": (1, "text"), "message": (2, "text")},
    "MeanStd": {"mean_mm": (1, "double"), "std_mm": (2, "double")},
    "Iteration": {
        "iteration": (1, "int"), "misfit": (2, "MeanStd"), "penetrating": (3, "int"),
        "max_penetration_mm": (4, "double"), "elapsed_ms": (5, "double")},
    "Contact": {
        "active": (1, "int"), "penetrating": (2, "int"), "max_penetration_mm": (3, "double"),
        "iterations": (4, "int"), "active_slaves": (5, "*int"), "force_n": (6, "*float"),
        "decrement": (7, "?double"), "max_violation_mm": (8, "?double")},
    "StageTimings": {
        "register_ms": (1, "double"), "invert_ms": (2, "double"), "rebuild_ms": (3, "double"),
        "encode_ms": (4, "double"), "journal_ms": (5, "double")},
    "Omission": {"part": (1, "text"), "reason": (2, "text"), "estimated_error": (3, "text")},
    "Update": {
        "case_id": (1, "text"), "model_id": (2, "text"), "session_id": (3, "int"), "sequence": (4, "int"),
        "observation_sequence": (5, "int"), "method": (6, "text"), "boundary": (7, "text"),
        "final": (8, "int"), "status": (9, "text"), "reason": (10, "text"),
        "displacement": (11, "Displacements"), "sd_mm": (12, "*float"), "contact": (13, "Contact"),
        "initial_misfit": (14, "MeanStd"), "misfit": (15, "MeanStd"), "history": (16, "*Iteration"),
        "timings": (17, "StageTimings"), "t_undeformed_deformed": (18, "Rigid"),
        "left_out": (19, "*Omission"), "error_code": (20, "text"), "quality": (22, "int"),
        "quality_flags": (23, "*int"), "quality_reason": (24, "text"),
        "min_volume_ratio": (27, "?double"), "inverted_elements": (28, "int"),
        "misfit_ratio": (29, "?double"), "data_outside_region": (30, "int"),
        "boot_id": (31, "fixed"), "part": (32, "FieldPart"), "answer_time": (33, "AnswerTime"),
        "known": (34, "hex"), "region_known": (35, "?double")},
    "AnswerTime": {"ms": (1, "double"), "usual_ms": (2, "double"), "late": (3, "int"), "age_ms": (4, "double")},
    "LatencyFigures": {
        "count": (1, "int"), "p50_ms": (2, "double"), "p95_ms": (3, "double"), "p99_ms": (4, "double"),
        "max_ms": (5, "double")},
    "StageLatency": {
        "stage": (1, "text"), "recent": (2, "LatencyFigures"), "all": (3, "LatencyFigures"),
        "sum_ms": (4, "double"), "bucket_counts": (5, "*int")},
    "SourceCounts": {
        "source": (1, "text"), "received": (2, "int"), "answered": (3, "int"), "failed": (4, "int"),
        "replaced": (5, "int"), "skipped": (6, "int"), "refused": (7, "int"), "repeated": (8, "int"),
        "waiting": (9, "int"), "age_ms": (10, "double")},
    "ViewerFigures": {
        "peer": (1, "text"), "window": (2, "int"), "sent": (3, "int"), "received": (4, "int"),
        "owed": (5, "int"), "replies_waiting": (6, "int")},
    "JournalFigures": {
        "recording": (1, "int"), "reason": (2, "text"), "file": (3, "text"), "bytes": (4, "int"),
        "records": (5, "int"), "lost": (6, "int")},
    "ProcessFigures": {
        "resident_bytes": (1, "int"), "peak_bytes": (2, "int"), "descriptors": (3, "int"),
        "descriptor_limit": (4, "int"), "threads": (5, "int")},
    "DaemonReport": {
        "version": (1, "text"), "build": (2, "text"), "machine": (3, "text"), "blas_kernel": (4, "text"),
        "uptime_ms": (5, "int"), "model_ready": (6, "int"), "case_id": (7, "text"),
        "session": (8, "SessionState"), "owner": (9, "text"), "max_age_s": (10, "double"),
        "working_ms": (11, "double"), "limit_ms": (12, "double"), "usable": (13, "int"),
        "unusable": (14, "int"), "failures": (15, "int"), "iterates": (16, "int"),
        "sources": (17, "*SourceCounts"), "clients": (18, "int"), "viewers": (19, "*ViewerFigures"),
        "recent_updates": (20, "int"), "bounds_ms": (21, "*double"), "stages": (22, "*StageLatency"),
        "journal": (23, "JournalFigures"), "log_lines_lost": (24, "int"),
        "process": (25, "ProcessFigures"), "late": (26, "int"), "door": (27, "DoorFigures")},
    "DoorFigures": {
        "accepted": (1, "int"), "closed_for_breach": (2, "int"), "closed_for_memory": (3, "int"),
        "closed_for_silence": (4, "int"), "closed_for_room": (5, "int"), "held_bytes": (6, "int"),
        "unknown_keys": (7, "int"), "refused_role": (8, "int"), "refused_connections": (9, "int"),
        "refused_observations": (10, "int"), "refused_starts": (11, "int")},
}

KEY = {"boot_id": 2**64 - 3, "session_id": 3, "model_id": "0123456789abcdef"}
OBSERVATION = {
    "case_id": "colin27", "frame": "ras", "source": "ius", "sequence": 1,
    "acquired_ns": 123456789012345, "acquired_wall_ns": 1257850000000000000}
TETRAHEDRON = {
    "vertices": {"xyz_mm": [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]},
    "triangle_indices": [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]}
UPDATE = {
    "case_id": "colin27", "model_id": "00ff00ff00ff00ff", "session_id": 3, "sequence": 8,
    "observation_sequence": 2, "method": "paper", "boundary": "fixed", "final": 1,
    "boot_id": 2**63 + 1}
TIMINGS = {
    "register_ms": 3.5, "invert_ms": 1234.5, "rebuild_ms": 0.0, "encode_ms": 0.7, "journal_ms": 0.1}

# name: (frame type, request id, message, value)
MESSAGES = {
    "status_request": (1, 1, "Empty", {}),
    "status_reply": (2, 1, "StatusReply", {
        "version": "0.1.0", "model_ready": 1, "case_id": "Fall Köln", "model_id": "0123456789abcdef",
        "busy": 1, "updates": 300, "uptime_ms": 86400000}),
    "start_session_request": (3, 2, "StartSessionRequest", {
        "case_id": "colin27", "method": "paper", "boundary": "fixed", "publish_iterates": 1,
        "takeover": 1, "recorded_clock": 1}),
    "start_session_reply": (4, 2, "StartSessionReply", {
        "session_id": 3, "model_id": "0123456789abcdef", "nodes": 18475, "tets": 101083, "slaves": 906,
        "prepare_s": 12.3, "model_bytes": 5000000000, "boot_id": 2**63 + 1}),
    "model_request": (5, 3, "Empty", {}),
    "model_reply": (6, 3, "ModelReply", {
        "case_id": "one-tetrahedron", "model_id": "fedcba9876543210", "nodes": TETRAHEDRON["vertices"],
        "tet_indices": [0, 1, 2, 3], "boundary_indices": TETRAHEDRON["triangle_indices"],
        "skull": {"vertices": {"xyz_mm": [v * 1.1 for v in TETRAHEDRON["vertices"]["xyz_mm"]]},
                  "triangle_indices": TETRAHEDRON["triangle_indices"]},
        "tumour": {"vertices": {"xyz_mm": [0.1, 0.1, 0.1, 0.2, 0.1, 0.1, 0.1, 0.2, 0.1]},
                   "triangle_indices": [0, 1, 2]},
        "craniotomy": [3], "brainstem": [], "slaves": [1, 2], "fixed": [0],
        "gravity_direction": [0.6, -0.8, 0.0], "fluid_plane_depth_mm": -1.5,
        "slave_plane_depth_mm": 18.5, "tet_labels": [2], "septa_indices": [0, 1, 3], "ventricle_indices": [1, 2, 3]}),
    "subscribe_request": (7, 4, "SubscribeRequest", {"subscription": 5, "window": 1, "received": 70000}),
    "subscribe_ball": (7, 5, "SubscribeRequest", {
        "subscription": 1, "window": 1, "received": 0, "choice": {
            "ball": {"centre_mm": [-30.5, 1 / 3, 42.0], "radius_mm": 40.0}, "spacing_mm": 0.0,
            "tolerance_mm": 0.1, "without_sd": 0}}),
    "subscribe_tumour": (7, 6, "SubscribeRequest", {
        "subscription": 2, "window": 256, "received": 1, "choice": {
            "tumour": {"margin_mm": 0.0}, "spacing_mm": 10.0, "tolerance_mm": 0.0, "without_sd": 1}}),
    "session_state": (13, 4, "SessionState", {
        "session": KEY, "phase": 5, "newest_update": 12, "newest_usable": 9, "age_ms": 1250.5,
        "valid_ms": 1000, "reason": "observation 12: no point is inside the brain", "preparing": 1,
        "recording": {"recording": 1, "reason": "", "sources": [
            {"source": "ius", "until": 12, "lost_until": 3}]},
        "aged_after_ms": 30000, "expired_after_ms": 2**32 - 1, "recorded": 1, "method": "condensed",
        "boundary": "fixed"}),
    "observation_tumour": (9, 2**63 + 5, "Observation", OBSERVATION | {
        "tumour_boundary": {"points": {"xyz_mm": [12.5, -40.1, 1 / 3, -0.1, 1e-300, 55.0]},
                            "sd_mm": 0.51}}),
    "observation_cortex": (9, 6, "Observation", OBSERVATION | {
        "source": "stereopsis", "sequence": 2**64 - 1, "acquired_ns": -5, "acquired_wall_ns": 0,
        "cortical_surface": {"surface": TETRAHEDRON, "sd_mm": 0.1}}),
    "observation_landmarks": (9, 7, "Observation", OBSERVATION | {
        "source": "pointer", "session": KEY, "sent_ns": 123456799012345, "daemon_ns": -7,
        "landmark_pairs": {"undeformed": {"xyz_mm": [1.0, 2.0, 3.0]},
                           "deformed": {"xyz_mm": [1.5, -2.0, 2.7]}, "sd_mm": 0.3}}),
    "observation_pose": (9, 8, "Observation", OBSERVATION | {
        "source": "tracker",
        "patient_pose": {"gravity_direction": [0.0, -0.6, -0.8], "fluid_level_mm": 0.0}}),
    "observation_reply": (10, 8, "ObservationReply", {"observation_sequence": 2, "replaced_pending": 1}),
    "error_reply": (11, 9, "ErrorReply", {
        "code": "model_not_ready", "message": "no model is loaded: start a session first"}),
    "update": (12, 0, "Update", UPDATE | {
        "status": "converged", "reason": "misfit changed by less than 0.1 %",
        "displacement": {"xyz_mm": [0.5, -0.25, 0.0, 1.75, 3.0, -8.125]}, "sd_mm": [0.125, 2.0],
        "contact": {"active": 1, "penetrating": 0, "max_penetration_mm": 0.0, "iterations": 4,
                    "active_slaves": [1], "force_n": [0.03125]},
        "initial_misfit": {"mean_mm": 3.1, "std_mm": 0.9}, "misfit": {"mean_mm": 0.09, "std_mm": 0.04},
        "history": [
            {"iteration": 1, "misfit": {"mean_mm": 1.2, "std_mm": 0.3}, "penetrating": 12,
             "max_penetration_mm": 0.4, "elapsed_ms": 101.5},
            {"iteration": 2, "misfit": {"mean_mm": 0.09, "std_mm": 0.04}, "penetrating": 0,
             "max_penetration_mm": 0.0, "elapsed_ms": 202.25}],
        "timings": TIMINGS,
        "t_undeformed_deformed": {
            "rotation_row_major": [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            "translation_mm": [0.5, -1.25, 3.3]},
        "left_out": [{"part": "pore pressure", "reason": "updates are at least 10 s apart",
                      "estimated_error": "0.02 % in energy"}]}),
    "update_unusable": (12, 0, "Update", UPDATE | {
        "status": "converged", "reason": "contact holds to 0.001 mm at iteration 4",
        "displacement": {"xyz_mm": [0.5, -0.25, 0.0, 1.75, 3.0, -8.125]}, "sd_mm": [0.125, 2.0],
        "contact": {"active": 1, "penetrating": 0, "max_penetration_mm": 0.0, "iterations": 4,
                    "active_slaves": [1], "force_n": [0.03125], "decrement": 0.0,
                    "max_violation_mm": -0.7},
        "initial_misfit": {"mean_mm": 3.1, "std_mm": 0.9}, "misfit": {"mean_mm": 0.09, "std_mm": 0.04},
        "history": [], "timings": TIMINGS,
        "t_undeformed_deformed": {
            "rotation_row_major": [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            "translation_mm": [0.5, -1.25, 3.3]},
        "left_out": [], "quality": 3, "quality_flags": [1, 17],
        "quality_reason": "elements are turned inside out (133)", "min_volume_ratio": -0.3,
        "inverted_elements": 133, "misfit_ratio": 2.25, "data_outside_region": 7,
        "answer_time": {"ms": 812.5, "usual_ms": 34.25, "late": 1, "age_ms": 118812.5}, "known": "ff80",
        "region_known": 0.0}),
    "update_changes": (12, 0, "Update", UPDATE | {
        "status": "converged", "reason": "contact holds", "quality": 1, "quality_flags": [],
        "quality_reason": "", "displacement": {"xyz_mm": [0.5, -0.25, 0.0, 1.75, 3.0, -8.125]},
        "sd_mm": [],
        "contact": {"active": 1, "penetrating": 0, "max_penetration_mm": 0.0, "iterations": 4,
                    "active_slaves": [18474], "force_n": [0.03125], "decrement": 0.0,
                    "max_violation_mm": -0.7},
        "initial_misfit": {"mean_mm": 3.1, "std_mm": 0.9}, "misfit": {"mean_mm": 0.09, "std_mm": 0.04},
        "history": [], "timings": TIMINGS,
        "t_undeformed_deformed": {
            "rotation_row_major": [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            "translation_mm": [0.5, -1.25, 3.3]},
        "left_out": [], "min_volume_ratio": 0.9, "inverted_elements": 0, "misfit_ratio": 1.25,
        "data_outside_region": 0,
        "part": {"mesh_nodes": 18475, "node_steps": [0, 18474], "base_sequence": 7}}),
    "update_failed": (12, 0, "Update", UPDATE | {
        "status": "failed", "reason": "observation 2: no point is inside the brain",
        "timings": TIMINGS, "error_code": "empty_set"}),
    "report_request": (14, 10, "Empty", {}),
    "report_reply": (15, 10, "DaemonReport", {
        "version": "0.1.0", "build": "0.1.0 1a2b3c", "machine": "Fall Köln", "blas_kernel": "Haswell",
        "uptime_ms": 86400001, "model_ready": 1, "case_id": "colin27",
        "session": {"session": KEY, "phase": 5, "newest_update": 12, "newest_usable": 9,
                    "age_ms": 1250.5, "valid_ms": 1000, "reason": "no point is inside the brain",
                    "preparing": 1, "recording": {"recording": 1, "reason": "", "sources": [
                        {"source": "ius", "until": 12, "lost_until": 3}]}},
        "owner": "00ab12cd34", "max_age_s": 600.0, "working_ms": 12.25, "limit_ms": 13000.0,
        "usable": 2**40, "unusable": 3, "failures": 2, "iterates": 7,
        "sources": [
            {"source": "", "received": 2, "answered": 0, "failed": 0, "replaced": 0, "skipped": 0,
             "refused": 2, "repeated": 0, "waiting": 0, "age_ms": 0.1},
            {"source": "ius", "received": 21, "answered": 6, "failed": 5, "replaced": 4, "skipped": 3,
             "refused": 1, "repeated": 1, "waiting": 1, "age_ms": 33.3}],
        "clients": 3, "viewers": [
            {"peer": "00ab12cd34", "window": 1, "sent": 70001, "received": 70000, "owed": 2,
             "replies_waiting": 4}],
        "recent_updates": 2048, "bounds_ms": [0.1, 10.0, 1000.0],
        "stages": [
            {"stage": "total",
             "recent": {"count": 2, "p50_ms": 1.5, "p95_ms": 2.9, "p99_ms": 3.0, "max_ms": 3.1},
             "all": {"count": 3, "p50_ms": 1.6, "p95_ms": 8.0, "p99_ms": 9.0, "max_ms": 10.5},
             "sum_ms": 15.1, "bucket_counts": [0, 2, 1, 0]}],
        "journal": {"recording": 1, "reason": "", "file": "/j/colin27-1.surgery", "bytes": 2**33,
                    "records": 41, "lost": 1},
        "log_lines_lost": 303,
        "process": {"resident_bytes": 2**32 + 1, "peak_bytes": 2**33 + 1, "descriptors": 31,
                    "descriptor_limit": 1024, "threads": 9},
        "late": 5,
        "door": {"accepted": 301, "closed_for_breach": 1, "closed_for_memory": 2,
                 "closed_for_silence": 3, "closed_for_room": 4, "held_bytes": 2**32 + 5,
                 "unknown_keys": 6, "refused_role": 7, "refused_connections": 8,
                 "refused_observations": 9, "refused_starts": 10}}),
}


def varint(value):
    value &= 2**64 - 1  # negative numbers travel as 64-bit two's complement
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def tag(number, wire_type):
    return varint(number << 3 | wire_type)


def block(number, data):
    return tag(number, 2) + varint(len(data)) + data


def scalar(kind, value):
    if kind == "int":
        return varint(value)
    if kind == "fixed":
        return struct.pack("<Q", value)
    return struct.pack("<d" if kind == "double" else "<f", value)


WIRE_TYPE = {"int": 0, "fixed": 1, "double": 1, "float": 5}


def encode_field(number, kind, value):
    if kind.startswith("*"):
        kind = kind[1:]
        if kind not in WIRE_TYPE:
            return b"".join(block(number, encode(kind, entry)) for entry in value)
        packed = b"".join(scalar(kind, entry) for entry in value)
        return block(number, packed) if packed else b""
    present = kind.startswith("?")
    kind = kind.lstrip("?")
    if kind == "hex":
        return block(number, bytes.fromhex(value))
    if kind == "text":
        return block(number, value.encode()) if value else b""
    if kind in WIRE_TYPE:
        return tag(number, WIRE_TYPE[kind]) + scalar(kind, value) if value or present else b""
    return block(number, encode(kind, value))


def encode(message, value):
    schema = SCHEMA[message]
    fields = sorted((schema[name], entry) for name, entry in value.items())
    return b"".join(encode_field(number, kind, entry) for (number, kind), entry in fields)


def main():
    folder = pathlib.Path(__file__).parent
    for name, (frame_type, request_id, message, value) in MESSAGES.items():
        payload = encode(message, value)
        start, end = b"BSFT" + struct.pack("<HHI", 2, frame_type, len(payload)), struct.pack("<Q", request_id)
        crc = struct.pack("<I", zlib.crc32(start + end + payload))
        (folder / f"{name}.bin").write_bytes(start + crc + end + payload)
        description = {"type": frame_type, "request_id": request_id, "message": message, "value": value}
        (folder / f"{name}.json").write_text(json.dumps(description, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
