#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the vectors of OpenIGTLink messages: NAME.bin and its description NAME.json.

A second implementation of the messages, by hand from the protocol's description (Documents/Protocol of
github.com/openigtlink/OpenIGTLink) with the Python standard library alone; it shares no code with common/igtl.
Header version 2 has metadata; header version 1 has none. The values are made up here (VECTORS). 32-bit floats
hold values that are exact in them. "decode_only": a message that brainshift reads but never writes.
Run it only when a message that is sent changes:  python3 tests/data/igtl/make_vectors.py
"""
import json
import pathlib
import struct

POLYNOMIAL = 0x42F0E1EBA9EA3693  # ECMA-182


def crc64(data):
    crc = 0
    for byte in data:
        crc ^= byte << 56
        for _ in range(8):
            crc = (crc << 1) ^ (POLYNOMIAL if crc >> 63 else 0)
            crc &= (1 << 64) - 1
    return crc


def padded(text, width):
    raw = text.encode()
    assert len(raw) <= width
    return raw.ljust(width, b"\0")


def floats(values):
    return struct.pack(f">{len(values)}f", *values)


# ---------- contents ----------

SCALARS = {"int8": (2, "b"), "uint8": (3, "B"), "int16": (4, "h"), "uint16": (5, "H"), "int32": (6, "i"),
           "uint32": (7, "I"), "float32": (10, "f"), "float64": (11, "d")}


def image(v):
    number, letter = SCALARS[v["scalar"]]
    big = v.get("big_endian", False)
    header = struct.pack(">HBBBB3H", 1, v["components"], number, 1 if big else 2, v["coordinates"], *v["dims"])
    steps = [number for step in v["steps"] for number in step]
    header += floats(steps) + floats(v["centre"]) + struct.pack(">3H3H", *v["offset"], *v["part"])
    return header + struct.pack(f"{'>' if big else '<'}{len(v['voxels'])}{letter}", *v["voxels"])


def columns(rows):
    """[R | t], given as three rows, as twelve floats column by column."""
    return floats([rows[i][j] for j in range(4) for i in range(3)])


def transform(v):
    return columns(v["rows"])


def tracking_data(v):
    return b"".join(padded(tool["name"], 20) + bytes([tool["type"], 0]) + columns(tool["rows"]) for tool in v["tools"])


def poly_data(v):
    arrays = [v[name] for name in ("vertices", "lines", "polygons", "triangle_strips")]
    content = struct.pack(">I", len(v["points"]))
    for cells in arrays:
        content += struct.pack(">II", len(cells), sum(4 * (1 + len(cell)) for cell in cells))
    content += struct.pack(">I", len(v["attributes"]))
    for point in v["points"]:
        content += floats(point)
    for cells in arrays:
        for cell in cells:
            content += struct.pack(f">{1 + len(cell)}I", len(cell), *cell)
    for attribute in v["attributes"]:
        tuples = attribute["tuples"]
        content += struct.pack(">BBI", attribute["kind"], len(tuples[0]), len(tuples))
    names = b"".join(attribute["name"].encode() + b"\0" for attribute in v["attributes"])
    content += names + b"\0" * (len(names) % 2)
    for attribute in v["attributes"]:
        for numbers in attribute["tuples"]:
            content += floats(numbers)
    return content


def point_list(v):
    return b"".join(padded(p["name"], 64) + padded(p["group"], 32) + bytes(p["rgba"]) + floats(p["position"])
                    + floats([p["diameter"]]) + padded(p["owner"], 20) for p in v["points"])


def text(v):
    raw = v["text"].encode()
    return struct.pack(">HH", v["encoding"], len(raw)) + raw


def status(v):
    return struct.pack(">Hq", v["code"], v["subcode"]) + padded(v["error_name"], 20) + v["text"].encode() + b"\0"


def capability(v):
    return b"".join(padded(name, 12) for name in v["types"])


CONTENTS = {"IMAGE": image, "TRANSFORM": transform, "TDATA": tracking_data, "POLYDATA": poly_data,
            "POINT": point_list, "STRING": text, "STATUS": status, "GET_STATUS": lambda v: b"",
            "CAPABILITY": capability, "GET_CAPABIL": lambda v: b""}


# ---------- the message around a content ----------

def message(m):
    body = CONTENTS[m["type"]](m["content"])
    if m["version"] == 2:
        extra = bytes(m.get("extended_header_extra", 0))
        entries = [(key.encode(), value.encode(), encoding) for key, value, encoding in m["metadata"]]
        index = struct.pack(">H", len(entries))
        for key, value, encoding in entries:
            index += struct.pack(">HHI", len(key), encoding, len(value))
        data = b"".join(key + value for key, value, _ in entries)
        body = struct.pack(">HHII", 12 + len(extra), len(index), len(data), m["message_id"]) + extra + body
        body += index + data
    header = struct.pack(">H", m["version"]) + padded(m["type"], 12) + padded(m["device"], 20)
    return header + struct.pack(">QQQ", m["timestamp"], len(body), crc64(body)) + body


# ---------- the vectors ----------

METADATA = [["sequence", "42", 3], ["session_id", "3", 3], ["model_id", "4f1b90aa", 3], ["quality", "caution", 3],
            ["flags", "few_data+near_boundary", 3], ["currency", "current", 3], ["reason", "", 3],
            ["age_ms", "12.5", 3], ["direction", "modeling", 3], ["case_id", "Müller", 106]]
STATE = '{"sequence": 42, "quality": "caution", "currency": "current", "direction": "modeling"}'
TIMESTAMP = (1700000000 << 32) | 0x80000001
GRID = {"coordinates": 1, "dims": [3, 2, 2], "steps": [[2, 0, 0], [0, 2, 0], [0, 0, 2]],
        "centre": [-30.5, 12.25, 41], "offset": [0, 0, 0], "part": [3, 2, 2]}
FIELD = [0, 0, 0, 0.5, -1.25, 2, 0, 0, 0, -3.5, 0.125, 0, 1, 2, 3, 4.75, -5, 6,
         0, 0, 0, 0, -0.0625, 0, 7, 8, -9, 0, 0, 0, 10, 11, 12.5, -1, -1, -1]
ROWS = [[0, -1, 0, 12.5], [1, 0, 0, -7.75], [0, 0, 1, 0.001953125]]
TETRAHEDRON = {
    "points": [[0, 0, 0], [10.5, 0, 0], [0, 20, 0], [-5, 2.5, 30]], "vertices": [], "lines": [],
    "polygons": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], "triangle_strips": [],
    "attributes": [
        {"name": "displacement_mm", "kind": 1, "tuples": [[0, 0, -1], [0.5, 0, -2], [0, 0.25, -3], [0, 0, -4.5]]},
        {"name": "sd_mm", "kind": 0, "tuples": [[0.5], [0.75], [1], [1.5]]}]}
EVERY_CELL = {
    "points": TETRAHEDRON["points"], "vertices": [[3], [0, 1]], "lines": [[0, 1, 2, 0]], "polygons": [[0, 1, 2, 3]],
    "triangle_strips": [[0, 1, 2, 3]],
    "attributes": [
        {"name": "table", "kind": 4, "tuples": [[0, 0.5, 1, 1], [1, 0.5, 0, 1]]},
        {"name": "normal", "kind": 2, "tuples": [[0, 0, 1]] * 4},
        {"name": "tensor", "kind": 3, "tuples": [[1, 0, 0, 0, 2, 0, 0, 0, 3]] * 4},
        {"name": "of five cells", "kind": 16, "tuples": [[1], [2], [3], [4], [5]]}]}


def vector(kind, device, content, **more):
    m = {"version": 2, "type": kind, "device": device, "timestamp": TIMESTAMP, "message_id": 7, "metadata": METADATA}
    m.update(more)
    if m["version"] == 1:
        del m["message_id"], m["metadata"]
    m["content"] = content
    return m


STATUS_STALE = {"code": 13, "subcode": -3, "error_name": "stale", "text": "no update for 2.5 s"}
VECTORS = {
    "image_field": vector("IMAGE", "brainshift_u", {**GRID, "components": 3, "scalar": "float32", "voxels": FIELD}),
    "image_sd": vector("IMAGE", "brainshift_sd",
                       {**GRID, "components": 1, "scalar": "float32", "voxels": [0.25 * i for i in range(12)]}),
    "image_part": vector("IMAGE", "Image_Reference",
                         {"coordinates": 2, "dims": [4, 3, 1], "steps": [[0.5, 0.25, 0], [-0.25, 0.5, 0], [0, 0, 1]],
                          "centre": [1, 2, 3], "offset": [1, 1, 0], "part": [3, 2, 1], "components": 1,
                          "scalar": "uint8", "voxels": [0, 1, 127, 128, 254, 255]}),
    "image_big_endian": vector("IMAGE", "ct", {**GRID, "components": 1, "scalar": "int16", "big_endian": True,
                                               "voxels": [-1024, -1, 0, 1, 2, 255, 256, 3071, 4, 5, 6, 7]},
                               decode_only=True),
    "transform": vector("TRANSFORM", "ProbeToReference", {"rows": ROWS},
                        metadata=[["TransformStatus", "OK", 3]]),
    "tracking_data": vector("TDATA", "tracker", {"tools": [
        {"name": "StylusToReference", "type": 2, "rows": ROWS},
        {"name": "twenty bytes of name", "type": 3, "rows": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}]}),
    "poly_data_surface": vector("POLYDATA", "brainshift_tumour", TETRAHEDRON),
    "poly_data_cells": vector("POLYDATA", "every kind", EVERY_CELL),
    "point_list": vector("POINT", "markups", {"points": [
        {"name": "Nasion", "group": "Fiducial", "rgba": [255, 0, 127, 254], "position": [1.5, -2.5, 3.25],
         "diameter": 4, "owner": "image"},
        {"name": "n" * 64, "group": "g" * 32, "rgba": [0, 0, 0, 0], "position": [0, 0, 0], "diameter": 0,
         "owner": "o" * 20}]}),
    "text_state": vector("STRING", "brainshift_state", {"encoding": 3, "text": STATE}),
    "status_current": vector("STATUS", "brainshift", {"code": 1, "subcode": 0, "error_name": "", "text": ""}),
    "status_stale": vector("STATUS", "brainshift", STATUS_STALE),
    "status_request": vector("GET_STATUS", "", {}, metadata=[], message_id=0, timestamp=0),
    "capability": vector("CAPABILITY", "brainshift", {"types": ["IMAGE", "POLYDATA", "TWELVE_BYTES"]}),
    "capability_request": vector("GET_CAPABIL", "brainshift", {}, metadata=[]),
    "longer_extended_header": vector("STATUS", "from a later version", STATUS_STALE, extended_header_extra=4,
                                     decode_only=True),
    "version_1_field": vector("IMAGE", "brainshift_u",
                              {**GRID, "components": 3, "scalar": "float32", "voxels": FIELD}, version=1),
    "version_1_status": vector("STATUS", "brainshift", STATUS_STALE, version=1),
    "version_1_request": vector("GET_STATUS", "brainshift", {}, version=1),
}


def main():
    assert crc64(b"123456789") == 0x6C40DF5F0B497347  # the check value of CRC-64/ECMA-182
    folder = pathlib.Path(__file__).parent
    for name, m in VECTORS.items():
        (folder / f"{name}.bin").write_bytes(message(m))
        (folder / f"{name}.json").write_text(json.dumps(m, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
