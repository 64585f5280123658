# SPDX-License-Identifier: Apache-2.0
"""Framing: one message is one ZeroMQ frame, a header of 24 bytes and a Protobuf payload.

Little-endian: "BSFT", version 2 (u16), type (u16), payload size (u32), CRC-32 of all other bytes
(u32, zlib's polynomial), request id (u64). See common/wire/frame.hpp.
"""
from __future__ import annotations

import enum
import struct
import zlib
from dataclasses import dataclass

from .errors import ProtocolError

MAGIC = b"BSFT"
VERSION = 2
MAX_PAYLOAD_BYTES = 64 << 20
_HEADER = struct.Struct("<4sHHIIQ")
HEADER_BYTES = _HEADER.size


class MessageType(enum.IntEnum):
    STATUS_REQUEST = 1
    STATUS_REPLY = 2
    START_SESSION_REQUEST = 3
    START_SESSION_REPLY = 4
    MODEL_REQUEST = 5
    MODEL_REPLY = 6
    SUBSCRIBE_REQUEST = 7
    OBSERVATION = 9
    OBSERVATION_REPLY = 10
    ERROR_REPLY = 11
    UPDATE = 12
    SESSION_STATE = 13
    REPORT_REQUEST = 14
    REPORT_REPLY = 15


@dataclass(frozen=True)
class Frame:
    type: MessageType
    request_id: int  # chosen by the client, echoed in the reply; 0 for what is pushed
    payload: bytes


def encode(message: MessageType, request_id: int, payload: bytes) -> bytes:
    """Header and payload. ValueError for a payload above MAX_PAYLOAD_BYTES."""
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise ValueError(f"payload of {len(payload)} bytes: must be at most {MAX_PAYLOAD_BYTES}")
    begin = struct.pack("<4sHHI", MAGIC, VERSION, message, len(payload))
    end = struct.pack("<Q", request_id)
    return begin + struct.pack("<I", _checksum(begin, end, payload)) + end + payload


def decode(message: bytes) -> Frame:
    """ProtocolError, with the name of the header's field, for anything but one whole frame."""
    if len(message) < HEADER_BYTES:
        raise ProtocolError(f"frame: {len(message)} bytes, the header alone has {HEADER_BYTES}")
    magic, version, kind, size, crc, request_id = _HEADER.unpack_from(message)
    if magic != MAGIC:
        raise ProtocolError("frame: magic is not BSFT")
    if version != VERSION:
        raise ProtocolError(f"frame: version {version}, must be {VERSION}")
    if size > MAX_PAYLOAD_BYTES or size != len(message) - HEADER_BYTES:
        raise ProtocolError(f"frame: payload size {size}, {len(message) - HEADER_BYTES} bytes follow the header")
    payload = message[HEADER_BYTES:]
    if crc != _checksum(message[:12], message[16:HEADER_BYTES], payload):
        raise ProtocolError("frame: crc does not match")
    try:
        return Frame(MessageType(kind), request_id, payload)
    except ValueError:
        raise ProtocolError(f"frame: type {kind} is not known") from None


def _checksum(begin: bytes, end: bytes, payload: bytes) -> int:
    return zlib.crc32(payload, zlib.crc32(end, zlib.crc32(begin)))
