#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes malformed.txt: frames, and whether a client must take them. Both clients' tests read it.

A row is `ok|refused NAME HEX`. The rows are the golden messages (make_golden.py), each damaged in one
way; a few are sound, so that refusing everything fails too. Run it when the protocol changes:
    python3 tests/data/wire/make_malformed.py
"""
import copy
import math
import pathlib
import struct
import zlib

import make_golden as golden

golden.SCHEMA |= {
    "SourceSummary": {
        "source": (1, "text"), "observation_sequence": (2, "int"), "age_s": (3, "double"), "data": (4, "int"),
        "outliers": (5, "int"), "chi_square": (6, "?double"), "degrees_of_freedom": (7, "?double"),
        "p_value": (8, "?double"), "consistent": (9, "int")},
    "PriorStrength": {"part": (1, "text"), "mean": (2, "double"), "absent": (3, "double"), "at_bound": (4, "int")},
    "Hypothesis": {"scales": (1, "*double"), "weight": (2, "double")}}
golden.SCHEMA["Update"] |= {
    "sources": (21, "*SourceSummary"), "prior_strengths": (25, "*PriorStrength"), "hypotheses": (26, "*Hypothesis")}

PARTS = ("along_gravity", "across_gravity", "tumour_volume", "brain_volume", "resection", "opening", "fine", "medium",
         "coarse")
UPDATE = {key: value for key, value in golden.MESSAGES["update_changes"][3].items() if key != "part"} | {
    "contact": golden.MESSAGES["update_unusable"][3]["contact"], "sd_mm": [0.125, 2.0],
    "history": golden.MESSAGES["update"][3]["history"][:1],
    "answer_time": {"ms": 30.5, "usual_ms": 34.25, "late": 0, "age_ms": 35.5},
    "sources": [{"source": "ius", "observation_sequence": 2, "age_s": 0.5, "data": 9, "outliers": 1, "chi_square": 3.5,
                 "degrees_of_freedom": 4.5, "p_value": 0.5, "consistent": 1}],
    "prior_strengths": [{"part": part, "mean": 1.5, "absent": 0.25, "at_bound": 0} for part in PARTS],
    "hypotheses": [{"scales": [1.5] * 9, "weight": 0.75}]}
BASES = {name: golden.MESSAGES[name][:1] + golden.MESSAGES[name][2:] for name in (
    "status_reply", "start_session_reply", "model_reply", "session_state", "observation_reply", "error_reply",
    "update_changes", "update_failed", "observation_tumour", "observation_cortex", "observation_landmarks",
    "observation_pose")} | {"update": (12, "Update", UPDATE)}
rows = {}


def framed(kind, payload):
    start, end = b"BSFT" + struct.pack("<HHI", 2, kind, len(payload)), struct.pack("<Q", 1)
    return start + struct.pack("<I", zlib.crc32(start + end + payload)) + end + payload


def row(name, taken, frame):
    assert name not in rows, name
    rows[name] = f"{'ok' if taken else 'refused'} {name} {frame.hex()}"


def payload_row(base, what, payload, taken=False):
    row(f"{base}/{what}", taken, framed(BASES[base][0], payload))


def at(value, path):
    for step in path:
        value = value[step]
    return value


def changed(base, what, *changes, taken=False):
    """changes: (path, value); a value None takes the field away."""
    _, message, value = BASES[base]
    value = copy.deepcopy(value)
    for path, entry in changes:
        steps = [int(step) if step.isdigit() else step for step in path.split(".")]
        if entry is None:
            del at(value, steps[:-1])[steps[-1]]
        else:
            at(value, steps[:-1])[steps[-1]] = entry
    payload_row(base, what, golden.encode(message, value), taken)


def numbers(schema, value, path=()):
    """Paths of every floating-point number."""
    for name, entry in value.items():
        kind = golden.SCHEMA[schema][name][1].lstrip("?*")
        entries = list(enumerate(entry)) if isinstance(entry, list) else [(None, entry)]
        for index, one in entries[:2]:
            here = path + ((name,) if index is None else (name, str(index)))
            if kind in ("double", "float"):
                yield ".".join(here)
            elif isinstance(one, dict):
                yield from numbers(kind, one, here)


def frames():
    sound = framed(10, golden.encode(*BASES["observation_reply"][1:]))
    row("frame/sound", True, sound)
    for size in (0, 1, 4, 12, 23, len(sound) - 1):
        row(f"frame/cut_to_{size}", False, sound[:size])
    row("frame/longer", False, sound + b"\0")
    for name, offset, data in (("magic", 0, b"X"), ("version_1", 4, b"\1"), ("version_3", 4, b"\3"), ("type_0", 6, b"\0"),
                               ("type_8", 6, b"\x08"), ("type_16", 6, b"\x10"), ("size", 8, b"\1"), ("crc", 12, b"\0\0\0\0"),
                               ("request_id", 16, b"\7"), ("payload", 25, b"\x7f")):
        row(f"frame/{name}", False, sound[:offset] + data + sound[offset + len(data):])


def encodings():
    wire_of = {"int": 0, "fixed": 1, "double": 1, "float": 5}
    for base, (_, message, value) in BASES.items():
        payload = golden.encode(message, value)
        payload_row(base, "sound", payload, taken=True)
        payload_row(base, "cut", payload[:-1])
        payload_row(base, "twice", payload * 2)
        for name, extra, taken in (("unknown_number", golden.tag(500, 0) + b"\5", True),
                                   ("unknown_bytes", golden.block(501, b"abcd"), True),
                                   ("group", golden.tag(500, 3) + golden.tag(500, 4), False),
                                   ("wire_6", golden.tag(500, 6), False), ("field_0", b"\0\0", False),
                                   ("endless_varint", golden.tag(500, 0) + b"\xff" * 11, False)):
            payload_row(base, name, payload + extra, taken)
        payload_row(base, "unknown_in_front", golden.tag(500, 0) + b"\5" + payload, taken=True)
        for name, entry in value.items():
            number, kind = golden.SCHEMA[message][name]
            once = golden.encode_field(number, kind, entry)
            if kind.startswith("*") or not once:
                continue
            payload_row(base, f"{name}_twice", payload + once)
            kind = kind.lstrip("?")
            wrong = 0 if wire_of.get(kind, 2) == 5 else 5
            rest = {key: other for key, other in value.items() if key != name}
            payload_row(base, f"{name}_of_another_type",
                        golden.encode(message, rest) + golden.tag(number, wrong) + b"\1\0\0\0"[:1 if wrong == 0 else 4])
            if kind == "text":
                payload_row(base, f"{name}_not_utf8", golden.encode(message, rest) + golden.block(number, b"a\xff"))
        for path in numbers(message, value):
            for word, bad in (("nan", math.nan), ("inf", math.inf)):
                changed(base, f"{path}={word}", (path, bad))
    # Behind, and in front of, the numbers of a submessage that has them alone.
    for base, number, inner in (("update", 11, struct.pack("<6f", *UPDATE["displacement"]["xyz_mm"])),):
        _, message, value = BASES[base]
        rest = golden.encode(message, {key: other for key, other in value.items() if key != "displacement"})
        packed = golden.block(1, inner)
        unknown = golden.block(15, struct.pack("<3f", 9.0, 9.0, 9.0))
        payload_row(base, "displacement_then_unknown", rest + golden.block(number, packed + unknown), taken=True)
        payload_row(base, "unknown_then_displacement", rest + golden.block(number, unknown + packed), taken=True)
        payload_row(base, "displacement_torn", rest + golden.block(number, golden.block(1, inner[:-1])))


def verdicts():
    flag_sets = {"none": [], "1": [1], "1_7": [1, 7], "17": [17], "1_20": [1, 20], "0": [0], "9": [9], "16": [16], "21": [21],
                 "1_1": [1, 1], "-1": [-1]}
    known = set(range(1, 9)) | set(range(17, 21))
    for quality in range(-1, 5):
        for name, flags in flag_sets.items():
            sound = set(flags) <= known and len(set(flags)) == len(flags)
            due = (3 if max(flags) >= 17 else 2) if flags and sound else 1
            taken = sound and quality == due or quality == 0 and not flags
            changed("update", f"quality_{quality}_flags_{name}", ("quality", quality), ("quality_flags", flags), taken=taken)


def updates():
    def bad(what, *changes):
        changed("update", what, *changes)

    for path in ("history.0.elapsed_ms", "history.0.misfit.std_mm", "misfit.std_mm", "initial_misfit.std_mm",
                 "timings.register_ms", "timings.journal_ms", "answer_time.ms", "answer_time.usual_ms", "answer_time.age_ms", "misfit_ratio",
                 "contact.decrement", "sources.0.chi_square", "sources.0.degrees_of_freedom", "sources.0.p_value",
                 "prior_strengths.3.mean", "prior_strengths.3.absent", "hypotheses.0.weight", "hypotheses.0.scales.8"):
        bad(f"{path}=-1", (path, -1.0))
    for path in ("contact.active", "contact.penetrating", "contact.iterations", "inverted_elements", "data_outside_region",
                 "history.0.iteration", "history.0.penetrating", "sources.0.data", "sources.0.outliers"):
        bad(f"{path}=2^31", (path, 2**31))
        changed("update", f"{path}=2^31-1", (path, 2**31 - 1), taken=True)
    for path in ("method", "boundary", "status"):
        bad(f"{path}=other", (path, "other"))
        bad(f"{path}_absent", (path, None))
    bad("status=failed", ("status", "failed"))
    bad("error_code", ("error_code", "empty_set"))
    bad("displacement_of_5_numbers", ("displacement.xyz_mm", [1.0] * 5), ("sd_mm", []))
    bad("displacement_of_1_node", ("displacement.xyz_mm", [1.0] * 3))
    bad("displacement_absent", ("displacement", None))
    bad("sd_of_3", ("sd_mm", [1.0] * 3))
    changed("update", "sd_absent", ("sd_mm", []), taken=True)
    for slave in (-1, 2, 2**31 - 1):
        bad(f"slave_{slave}", ("contact.active_slaves", [slave]))
    bad("more_forces_than_slaves", ("contact.force_n", [1.0, 1.0]))
    bad("late_and_is_not", ("answer_time.late", 1))
    bad("not_late_and_is", ("answer_time.ms", 70.0))
    bad("part_unknown", ("prior_strengths.0.part", "other"))
    bad("part_twice", ("prior_strengths.0.part", "coarse"))
    bad("part_missing", ("prior_strengths.8", None))
    bad("no_strengths_for_hypotheses", ("prior_strengths", []))
    changed("update", "no_prior", ("prior_strengths", []), ("hypotheses", []), taken=True)
    bad("absent_above_1", ("prior_strengths.0.absent", 1.001))
    bad("weight_above_1", ("hypotheses.0.weight", 1.001))
    bad("scales_of_8", ("hypotheses.0.scales", [1.0] * 8))
    pose = "t_undeformed_deformed."
    bad("rotation_of_8", (pose + "rotation_row_major", [1.0] * 8))
    bad("translation_of_2", (pose + "translation_mm", [1.0] * 2))
    bad("reflection", (pose + "rotation_row_major", [1.0, 0, 0, 0, 1.0, 0, 0, 0, -1.0]))
    bad("shear", (pose + "rotation_row_major", [1.0, 1e-3, 0, 0, 1.0, 0, 0, 0, 1.0]))


def parts():
    def part(what, taken=False, more=(), **values):
        changed("update_changes", what, ("part", BASES["update_changes"][2]["part"] | values), *more, taken=taken)

    part("no_base", base_sequence=0, taken=True)
    part("mesh_of_0", mesh_nodes=0)
    part("mesh_of_too_many", mesh_nodes=2_000_001)
    part("node_beyond_the_mesh", mesh_nodes=18474)
    part("node_twice", node_steps=[5, 0])
    part("node_that_wraps", node_steps=[1, 2**32 - 1])
    part("one_node_for_two", node_steps=[5])
    part("no_node_and_no_base", node_steps=[], base_sequence=0,
         more=[("displacement.xyz_mm", [])])
    part("no_node", node_steps=[], more=[("displacement.xyz_mm", [])], taken=True)
    part("base_is_itself", base_sequence=8)
    part("base_later", base_sequence=9)
    part("base_of_an_iterate", more=[("final", 0)])
    part("base_of_unusable", more=[("quality", 3), ("quality_flags", [17])])
    part("base_not_judged", more=[("quality", 0)])
    changed("update_failed", "error_code_absent", ("error_code", None))
    for name, value in (("displacement", {"xyz_mm": [1.0] * 3}), ("quality", 1), ("part", {"mesh_nodes": 3, "node_steps": [1]})):
        changed("update_failed", f"with_{name}", (name, value))
    changed("update_failed", "with_contact", ("contact", {"active": 1, "active_slaves": [-1]}), taken=True)


def others():
    for phase in (0, 7, -1):
        changed("session_state", f"phase_{phase}", ("phase", phase))
    for valid in (10_001, 2**32 - 1):
        changed("session_state", f"valid_ms_{valid}", ("valid_ms", valid))
    changed("session_state", "valid_ms_10000", ("valid_ms", 10_000), taken=True)
    changed("session_state", "age_negative", ("age_ms", -1.0))
    changed("session_state", "usable_above_update", ("newest_usable", 13))
    for path in ("nodes", "tets", "slaves"):
        changed("start_session_reply", f"{path}=2^31", (path, 2**31))
    changed("start_session_reply", "prepare_s=-1", ("prepare_s", -1.0))
    for path in ("tet_indices", "boundary_indices", "septa_indices", "ventricle_indices", "skull.triangle_indices",
                 "tumour.triangle_indices"):
        indices = at(BASES["model_reply"][2], path.split("."))
        limit = 3 if path.startswith("tumour") else 4
        for name, entry in (("negative", -1), ("beyond", limit)):
            changed("model_reply", f"{path}_{name}", (path, indices[:-1] + [entry]))
        changed("model_reply", f"{path}_short", (path, indices[:-1]))
    for path in ("craniotomy", "brainstem", "slaves", "fixed"):
        for name, entry in (("negative", -1), ("beyond", 4)):
            changed("model_reply", f"{path}_{name}", (path, [entry]))
    changed("model_reply", "two_labels", ("tet_labels", [1, 2]))
    changed("model_reply", "nodes_torn", ("nodes.xyz_mm", [1.0] * 11))
    for base, path in (("model_reply", "gravity_direction"), ("observation_pose", "patient_pose.gravity_direction")):
        changed(base, "gravity_of_2", (path, [0.6, 0.8]))
        changed(base, "gravity_of_length_2", (path, [0.0, 0.0, 2.0]))
        changed(base, "gravity_absent", (path, []))
    bodies = {"tumour": "tumour_boundary", "cortex": "cortical_surface", "landmarks": "landmark_pairs"}
    for base, body in bodies.items():
        changed(f"observation_{base}", "sd_negative", (f"{body}.sd_mm", -0.5))
        changed(f"observation_{base}", "no_body", (body, None))
        changed(f"observation_{base}", "two_bodies",
                ("patient_pose", BASES["observation_pose"][2]["patient_pose"]))
    changed("observation_landmarks", "more_before", ("landmark_pairs.undeformed.xyz_mm", [1.0] * 6))
    changed("observation_tumour", "points_torn", ("tumour_boundary.points.xyz_mm", [1.0] * 4))
    changed("observation_cortex", "triangle_beyond", ("cortical_surface.surface.triangle_indices", [0, 1, 4]))


def main():
    for part in (frames, encodings, verdicts, updates, parts, others):
        part()
    path = pathlib.Path(__file__).with_name("malformed.txt")
    path.write_text("\n".join(rows.values()) + "\n")
    print(f"{path.name}: {len(rows)} rows, {sum(r.startswith('refused') for r in rows.values())} refused")


if __name__ == "__main__":
    main()
