# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of tracked ultrasound as PLUS and 3D Slicer write them (.igs.mha), and surgery files; with numpy and sqlite3
alone, apart from common/io/recording."""
import contextlib
import re
import sqlite3
import struct
import zlib
from collections import deque

import numpy as np

FIELD = re.compile(r"Seq_Frame(\d{4})_(\w+)$")


class Sequence:
    """fields: of the whole file; frames: name to value, without Seq_Frame0000_; pixels: bytes, frame after frame."""

    def __init__(self, size=(0, 0), fields=(), frames=(), pixels=b""):
        self.size, self.fields, self.frames, self.pixels = size, dict(fields), [dict(frame) for frame in frames], pixels

    @classmethod
    def read(cls, path):
        header, pixels = path.read_bytes().split(b"ElementDataFile = LOCAL\n", 1)
        values = dict(map(str.strip, line.split("=", 1)) for line in header.decode().splitlines())
        assert values["ElementType"] == "MET_UCHAR"
        width, height, count = map(int, values["DimSize"].split())
        frames = [{} for _ in range(count)]
        for name, value in values.items():
            if field := FIELD.match(name):
                frames[int(field[1])][field[2]] = value
        if values.get("CompressedData") == "True":
            pixels = zlib.decompress(pixels)
        kept = {name: value for name, value in values.items() if name.startswith("UltrasoundImage")}
        return cls((width, height), kept, frames, pixels)

    def text(self):
        """A file: compressed, where there are pixels."""
        data = zlib.compress(self.pixels) if self.pixels else b""
        lines = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False",
                 f"CompressedData = {bool(data)}", *([f"CompressedDataSize = {len(data)}"] if data else []),
                 f"DimSize = {self.size[0]} {self.size[1]} {len(self.frames)}", "ElementType = MET_UCHAR"]
        lines += [f"{name} = {value}" for name, value in self.fields.items()]
        lines += [f"Seq_Frame{i:04d}_{name} = {value}" for i, frame in enumerate(self.frames) for name, value in frame.items()]
        return "\n".join(lines).encode() + b"\nElementDataFile = LOCAL\n" + data

    def image(self, frame):
        """Its bytes, row after row."""
        size = self.size[0] * self.size[1]
        return self.pixels[frame * size:(frame + 1) * size]

    def links(self, frame):
        """Every transform of a frame: its name, as ProbeToTracker, to a matrix and whether it is valid."""
        found = {}
        for name, value in self.frames[frame].items():
            if name.endswith("Transform"):
                found[name[:-len("Transform")]] = matrix(value), self.frames[frame].get(name + "Status", "OK") == "OK"
        return found


def matrix(text):
    return np.array(text.split(), dtype=float).reshape(4, 4)


def matrix_text(values):
    return " ".join(repr(float(value)) for value in np.ravel(values))


def motion(axis, angle, translation=(0.0, 0.0, 0.0)):
    """A rigid motion, by Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    T[:3, 3] = translation
    return T


def chain(links, start, end):
    """The product of links, name to matrix, on the shortest way from one frame to another; each may be walked backwards."""
    steps = {}
    for name, T in links.items():
        tail, head = name.split("To", 1)
        steps.setdefault(tail, []).append((head, T))
        steps.setdefault(head, []).append((tail, np.linalg.inv(T)))
    reached, todo = {start: np.eye(4)}, deque([start])
    while todo:
        here = todo.popleft()
        for there, T in steps.get(here, ()):
            if there not in reached:
                reached[there] = T @ reached[here]
                todo.append(there)
    return reached[end]


# ---------- surgery files ----------


def _link(before, kind, sequence, recorded_ns, payload):
    head = struct.pack("<I", before) + kind.encode() + b"\0" + struct.pack("<QqQ", sequence, recorded_ns, len(payload))
    return zlib.crc32(payload, zlib.crc32(head))


def _chain_start(meta):
    texts = b""
    for key, value in sorted(meta.items()):
        for text in (key.encode(), value.encode()):
            texts += struct.pack("<Q", len(text)) + text
    return zlib.crc32(texts)


class SurgeryFile:
    """meta, and records as (id, kind, sequence, recorded_ns, payload), of a file that was closed. Every checksum is compared
    (common/io/recording/record_chain.hpp)."""

    def __init__(self, path):
        with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
            self.meta = dict(database.execute("SELECT key, value FROM meta"))
            seals = {name: (count, crc) for name, count, crc in database.execute("SELECT name, records, crc FROM seal")}
            rows = database.execute("SELECT id, kind, sequence, recorded_ns, payload, crc FROM record ORDER BY id").fetchall()
        self.records = [row[:-1] for row in rows]
        assert seals["meta"][1] == _chain_start(self.meta)
        assert [row[-1] for row in rows] == self._checksums()
        assert seals["closed"] == (len(rows), self._end())

    def payloads(self, kind):
        return [payload for _, this, _, _, payload in self.records if this == kind]

    def _checksums(self):
        checksums, crc = [], _chain_start(self.meta)
        for _, kind, sequence, recorded_ns, payload in self.records:
            crc = _link(crc, kind, sequence, recorded_ns, payload)
            checksums.append(crc)
        return checksums

    def _end(self):
        return _link(([_chain_start(self.meta)] + self._checksums())[-1], "closed", len(self.records), 0, b"")

    def write_into(self, path):
        """Into a copy of the file that it was read from: other payloads, with checksums that fit."""
        with contextlib.closing(sqlite3.connect(path)) as database, database:
            for (number, *_, payload), crc in zip(self.records, self._checksums()):
                database.execute("UPDATE record SET payload = ?, crc = ? WHERE id = ?", (payload, crc, number))
            database.execute("UPDATE seal SET crc = ? WHERE name = 'closed'", (self._end(), ))
