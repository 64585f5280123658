# SPDX-License-Identifier: Apache-2.0
"""What every received message is held to, beyond Protobuf's own rules.

Refuses what the C++ client refuses (common/wire/payload_scan.cpp, checked_values.cpp and convert_*.cpp);
tests/data/wire/malformed.txt is read by the tests of both. Everything raises ProtocolError, which names the field.
"""
from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, Optional

import numpy as np
from google.protobuf.descriptor import FieldDescriptor as F
from numpy.typing import NDArray

from .errors import ProtocolError
from .frame import MAX_PAYLOAD_BYTES

MOST_FIELDS = 1 << 16
MOST_NUMBERS = 1 << 24
MOST_TEXT_BYTES = 1 << 16
MOST_DEPTH = 8
MOST_POINTS = 2_000_000
MOST_CELLS = 8 * MOST_POINTS
MOST_COUNT = 2**31 - 1
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5
_WIRE_TYPES = {F.TYPE_DOUBLE: _FIXED64, F.TYPE_FIXED64: _FIXED64, F.TYPE_SFIXED64: _FIXED64, F.TYPE_FLOAT: _FIXED32,
               F.TYPE_FIXED32: _FIXED32, F.TYPE_SFIXED32: _FIXED32, F.TYPE_STRING: _LENGTH, F.TYPE_BYTES: _LENGTH,
               F.TYPE_MESSAGE: _LENGTH}


class _Field(NamedTuple):
    name: str
    wire: int
    slot: Optional[str]  # of a singular field: its own, or that of its oneof; None: repeated
    is_text: bool
    message: Any  # descriptor of a submessage, else None


@lru_cache(maxsize=None)
def _fields(descriptor: Any) -> dict[int, _Field]:
    known = {}
    for field in descriptor.fields:
        oneof = field.containing_oneof
        real = oneof is not None and (len(oneof.fields) > 1 or not oneof.name.startswith("_"))
        slot = None if field.label == F.LABEL_REPEATED else (oneof.full_name if real else field.full_name)
        known[field.number] = _Field(field.full_name, _WIRE_TYPES.get(field.type, _VARINT), slot,
                                     field.type == F.TYPE_STRING, field.message_type)
    return known


def refuse(name: str, why: str) -> ProtocolError:
    return ProtocolError(f"{name}: {why}")


def scan(descriptor: Any, payload: bytes) -> None:
    """A walk over the wire format. Protobuf's parser takes the last of two values, and fields of a wrong type as
    unknown ones."""
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise refuse(descriptor.name, f"{len(payload)} bytes, must be at most {MAX_PAYLOAD_BYTES}")
    _Scanner(payload).message(descriptor, 0, len(payload), 0)


class _Scanner:
    def __init__(self, payload: bytes) -> None:
        self._bytes = payload
        self._fields = 0
        self._numbers = 0

    def _varint(self, at: int, end: int, name: str) -> tuple[int, int]:
        value = 0
        for shift in range(0, 64, 7):
            if at >= end:
                break
            byte = self._bytes[at]
            at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value & (2**64 - 1), at
        raise refuse(name, "truncated or malformed value")

    def message(self, descriptor: Any, at: int, end: int, depth: int) -> None:
        if depth > MOST_DEPTH:
            raise refuse(descriptor.name, "nested too deeply")
        known, seen = _fields(descriptor), set()
        while at < end:
            tag, at = self._varint(at, end, descriptor.name)
            if tag > 2**32 - 1 or tag >> 3 == 0:
                raise refuse(descriptor.name, "malformed field tag")
            self._fields += 1
            if self._fields > MOST_FIELDS:
                raise refuse(descriptor.name, f"more than {MOST_FIELDS} fields")
            wire, field = tag & 7, known.get(tag >> 3)
            name = descriptor.name if field is None else field.name
            begin, at = self._value(wire, at, end, name)
            if field is not None:  # else of a newer minor version
                if field.slot is not None and field.slot in seen:
                    raise refuse(name, "occurs more than once")
                seen.add(field.slot)
                self._known(field, wire, begin, at, depth)

    def _value(self, wire: int, at: int, end: int, name: str) -> tuple[int, int]:
        """Where the value begins and ends."""
        begin = at
        if wire == _VARINT:
            return begin, self._varint(at, end, name)[1]
        if wire == _LENGTH:
            size, begin = self._varint(at, end, name)
        elif wire in (_FIXED64, _FIXED32):
            size = 8 if wire == _FIXED64 else 4
        else:
            raise refuse(name, "truncated or malformed value")
        if size > end - begin:
            raise refuse(name, "truncated or malformed value")
        return begin, begin + size

    def _known(self, field: _Field, wire: int, begin: int, end: int, depth: int) -> None:
        packed = field.slot is None and wire == _LENGTH and field.wire != _LENGTH
        if wire != field.wire and not packed:
            raise refuse(field.name, "wrong wire type")
        if packed:
            size = {_FIXED64: 8, _FIXED32: 4}.get(field.wire)
            if size is None:
                numbers = np.frombuffer(self._bytes, np.uint8, end - begin, begin)
                self._numbers += int(np.count_nonzero(numbers < 0x80))
            elif (end - begin) % size != 0:
                raise refuse(field.name, "truncated")
            else:
                self._numbers += (end - begin) // size
            if self._numbers > MOST_NUMBERS:
                raise refuse(field.name, f"more than {MOST_NUMBERS} numbers in one payload")
        elif field.message is not None:
            self.message(field.message, begin, end, depth + 1)
        elif field.is_text:
            if end - begin > MOST_TEXT_BYTES:
                raise refuse(field.name, f"{end - begin} bytes, must be at most {MOST_TEXT_BYTES}")
            try:
                self._bytes[begin:end].decode("utf-8")
            except UnicodeDecodeError:
                raise refuse(field.name, "is not UTF-8") from None


# ---------- numbers ----------


def require(holds: bool, name: str, why: str) -> None:
    if not holds:
        raise refuse(name, why)


def finite(values: NDArray[Any], name: str, most: int = MOST_POINTS) -> NDArray[Any]:
    require(len(values) <= most, name, f"{len(values)} entries, must be at most {most}")
    require(bool(np.isfinite(values).all()), name, "has numbers that are not finite")
    return values


def number(value: float, name: str) -> float:
    require(bool(np.isfinite(value)), name, f"{value} is not finite")
    return value


def non_negative(value: float, name: str) -> float:
    require(number(value, name) >= 0.0, name, f"{value}, must not be negative")
    return value


def count(value: int, name: str) -> int:
    require(value <= MOST_COUNT, name, f"{value} is too large")
    return value


def probability(value: float, name: str) -> float:
    require(non_negative(value, name) <= 1.0 + 1e-9, name, f"{value}, must be at most 1")
    return value


def indices(values: NDArray[Any], limit: int, name: str, most: int = MOST_POINTS) -> NDArray[Any]:
    require(len(values) <= most, name, f"{len(values)} entries, must be at most {most}")
    require(values.size == 0 or bool(values.min() >= 0 and values.max() < limit), name,
            f"names what there is not: must be in [0, {limit})")
    return values


def unit_vector(values: Any, name: str) -> NDArray[np.float64]:
    vector = finite(np.asarray(values, dtype=np.float64), name)
    require(vector.shape == (3,), name, f"{vector.size} numbers, must be 3")
    length = float(np.linalg.norm(vector))
    require(abs(length - 1.0) <= 1e-3, name, f"length {length:.9g}, must be 1")
    return vector


def rigid(rotation: Any, translation: Any, name: str) -> None:
    require(len(rotation) == 9, name, f"rotation_row_major: {len(rotation)} numbers, must be 9")
    require(len(translation) == 3, name, f"translation_mm: {len(translation)} numbers, must be 3")
    r = finite(np.asarray(rotation, dtype=np.float64), name).reshape(3, 3)
    finite(np.asarray(translation, dtype=np.float64), name)
    require(bool(np.abs(r.T @ r - np.eye(3)).max() <= 1e-6) and float(np.linalg.det(r)) > 0.0, name,
            "rotation_row_major: must be a rotation")
