# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenIGTLink messages of versions 1 and 2 from a socket, with nothing but struct and numpy.

Written from the protocol's documents (Documents/Protocol of github.com/openigtlink/OpenIGTLink), apart from common/igtl: the
two check each other. It does as SlicerOpenIGTLink does where that matters: metadata become attributes `OpenIGTLink.<key>`,
and an image becomes voxels and IJK to RAS.
"""
import socket
import struct
import time
from dataclasses import dataclass, field

import numpy as np

HEADER = struct.Struct(">H12s20sQQQ")
EXTENDED = struct.Struct(">HHII")
IMAGE = struct.Struct(">HBBBB3H12f3H3H")
SCALARS = {2: "i1", 3: "u1", 4: "i2", 5: "u2", 6: "i4", 7: "u4", 10: "f4", 11: "f8"}
LARGEST = 1 << 28


class ProtocolError(ValueError):
    pass


def _table():
    table = []
    for byte in range(256):
        crc = byte << 56
        for _ in range(8):
            crc = (crc << 1) ^ (0x42F0E1EBA9EA3693 if crc >> 63 else 0)
            crc &= (1 << 64) - 1
        table.append(crc)
    return table


_CRC = _table()
_CRCS = np.array(_CRC, dtype=np.uint64)
_LANES = 4096


def crc64(data):
    """CRC-64 of ECMA-182: of "123456789" 0x6c40df5f0b497347."""
    if len(data) >= _LANES:
        return _crc64_in_lanes(data)
    crc = 0
    for byte in data:
        crc = ((crc << 8) & 0xFFFFFFFFFFFFFFFF) ^ _CRC[(crc >> 56) ^ byte]
    return crc


def _crc64_in_lanes(data):
    """The same for megabytes. The checksum is linear: that of two parts is that of the first, with as many zeros behind it as
    the second is long, plus that of the second; and zeros in front change nothing. So all parts go side by side, and beside
    them what the zeros do to every byte of a checksum."""
    length = -(-len(data) // _LANES)
    padded = np.zeros(_LANES * length, dtype=np.uint8)
    padded[len(padded) - len(data):] = np.frombuffer(data, dtype=np.uint8)
    every_byte = np.arange(256, dtype=np.uint64) << (8 * np.arange(8, dtype=np.uint64))[:, np.newaxis]
    crc = np.concatenate([np.zeros(_LANES, dtype=np.uint64), every_byte.ravel()])
    for column in np.ascontiguousarray(padded.reshape(_LANES, length).T):
        crc[:_LANES] ^= column.astype(np.uint64) << np.uint64(56)
        crc = (crc << np.uint64(8)) ^ _CRCS[crc >> np.uint64(56)]
    parts, zeros = crc[:_LANES], crc[_LANES:].reshape(8, 256)
    while len(parts) > 1:
        parts = _with_zeros(parts[0::2], zeros) ^ parts[1::2]
        zeros = _with_zeros(zeros, zeros)  # as many again
    return int(parts[0])


def _with_zeros(crc, zeros):
    return np.bitwise_xor.reduce([zeros[i][(crc >> np.uint64(8 * i)) & np.uint64(255)] for i in range(8)])


@dataclass
class Message:
    version: int
    type: str
    device: str
    content: bytes
    metadata: dict = field(default_factory=dict)

    def attribute(self, name):
        """As GetAttribute of the node that SlicerOpenIGTLink makes."""
        return self.metadata.get(name[len("OpenIGTLink."):]) if name.startswith("OpenIGTLink.") else None


def decode(data):
    """Bytes of one whole message."""
    version, kind, device, _, size, crc = HEADER.unpack_from(data)
    body = data[HEADER.size:]
    if version not in (1, 2) or size != len(body):
        raise ProtocolError(f"version {version}, {size} bytes stated, {len(body)} there")
    if crc64(body) != crc:
        raise ProtocolError("checksum")
    message = Message(version, _name(kind), _name(device), body)
    if version == 2:
        extended, index_size, metadata_size, _ = EXTENDED.unpack_from(body)
        end = len(body) - index_size - metadata_size
        if extended < EXTENDED.size or end < extended:
            raise ProtocolError("extended header")
        message.content = body[extended:end]
        message.metadata = _metadata(body[end:end + index_size], body[end + index_size:])
    return message


def _name(text):
    return text.split(b"\0")[0].decode("ascii")


def _metadata(index, data):
    (count,) = struct.unpack_from(">H", index)
    if len(index) != 2 + 8 * count:
        raise ProtocolError("metadata index")
    found, at = {}, 0
    for entry in range(count):
        key_size, _, value_size = struct.unpack_from(">HHI", index, 2 + 8 * entry)
        key, value = data[at:at + key_size], data[at + key_size:at + key_size + value_size]
        at += key_size + value_size
        found[key.decode()] = value.decode()
    if at != len(data):
        raise ProtocolError("metadata size")
    return found


def string_of(message):
    _, size = struct.unpack_from(">HH", message.content)
    text = message.content[4:]
    if size != len(text):
        raise ProtocolError("string")
    return text.decode()


def status_of(message):
    """Code and sentence."""
    (code,) = struct.unpack_from(">H", message.content)
    return code, message.content[30:].split(b"\0")[0].decode()


def image_of(message):
    """Voxels (nz, ny, nx, components) and IJK to RAS: the message names the place of the image's centre."""
    version, components, scalar, endian, coordinates, *rest = IMAGE.unpack_from(message.content)
    size, matrix, offset, part = rest[:3], np.array(rest[3:15]).reshape(4, 3), rest[15:18], rest[18:21]
    if version not in (1, 2) or coordinates != 1 or list(size) != list(part) or any(offset):
        raise ProtocolError("image: not a whole volume in RAS")
    kind = np.dtype(SCALARS[scalar]).newbyteorder(">" if endian == 1 else "<")
    voxels = np.frombuffer(message.content, kind, offset=IMAGE.size)
    ijk_to_ras = np.eye(4)
    ijk_to_ras[:3, :3] = matrix[:3].T
    ijk_to_ras[:3, 3] = matrix[3] - matrix[:3].T @ ((np.array(size) - 1.0) / 2.0)
    return voxels.reshape(size[2], size[1], size[0], components), ijk_to_ras


def points_of(message):
    """Points (n, 3) of a POLYDATA and its number of polygons."""
    counts = struct.unpack_from(">10I", message.content)
    points = np.frombuffer(message.content, ">f4", count=3 * counts[0], offset=40)
    return points.reshape(-1, 3).astype(float), counts[5]


def encode(version, kind, device, content, metadata=(), timestamp=0):
    body = content
    if version == 2:
        index = struct.pack(">H", len(metadata))
        data = b""
        for key, value in metadata:
            index += struct.pack(">HHI", len(key), 3, len(value))
            data += key.encode() + value.encode()
        body = EXTENDED.pack(EXTENDED.size, len(index), len(data), 1) + content + index + data
    return HEADER.pack(version, kind.encode(), device.encode(), timestamp, len(body), crc64(body)) + body


class Reader:
    """A client. Like Slicer it shows version 2 with a STATUS that carries metadata."""

    def __init__(self, address, version=2):
        self._socket = socket.create_connection(address, timeout=30)
        if version == 2:
            status = struct.pack(">HQ20s", 1, 0, b"") + b"\0"
            self._socket.sendall(encode(2, "STATUS", "", status, [("dummy", "dummy")]))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def next(self, timeout_s=30.0):
        """The next message; None where the other side has closed."""
        deadline = time.monotonic() + timeout_s
        header = self._read(HEADER.size, deadline)
        if header is None:
            return None
        size = HEADER.unpack(header)[4]
        if size > LARGEST:
            raise ProtocolError(f"{size} bytes")
        body = self._read(size, deadline)
        if body is None:
            raise ProtocolError("closed within a message")
        return decode(header + body)

    def _read(self, size, deadline):
        data = bytearray()
        while len(data) < size:
            self._socket.settimeout(max(0.01, deadline - time.monotonic()))
            more = self._socket.recv(min(size - len(data), 1 << 20))
            if not more:
                return None
            data += more
        return bytes(data)
