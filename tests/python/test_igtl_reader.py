# SPDX-License-Identifier: GPL-3.0-or-later
"""The reader of OpenIGTLink messages that the tests use: it has to be right, and strict, itself."""
import struct

import igtl_reader
import numpy as np
import pytest
from igtl_reader import IMAGE, ProtocolError, crc64, decode, encode


def test_the_checksum_is_that_of_the_standard():
    assert crc64(b"123456789") == 0x6C40DF5F0B497347
    assert crc64(b"") == 0


@pytest.mark.parametrize("size", [4095, 4096, 4097, 100_001])
def test_the_checksum_of_megabytes_is_that_of_their_bits(size):
    """Long division by the polynomial, bit after bit."""
    data = bytes(np.random.default_rng(size).integers(0, 256, size, dtype=np.uint8))
    crc = 0
    for byte in data:
        crc ^= byte << 56
        for _ in range(8):
            crc = ((crc << 1) & 0xFFFFFFFFFFFFFFFF) ^ (0x42F0E1EBA9EA3693 if crc >> 63 else 0)
    assert crc64(data) == crc


def test_a_string_has_the_bytes_that_the_protocol_lays_down():
    """58 bytes of header: version, type, name, time, size, checksum; all big-endian."""
    message = encode(1, "STRING", "name", b"\0\3\0\2ab")
    assert message[:2] == b"\0\1" and message[2:14] == b"STRING" + b"\0" * 6 and message[14:34] == b"name" + b"\0" * 16
    assert len(message) == 58 + 6 and message[42:50] == struct.pack(">Q", 6)
    assert igtl_reader.string_of(decode(message)) == "ab"


def test_metadata_come_back():
    message = decode(encode(2, "STRING", "d", b"\0\3\0\1x", [("key", "value"), ("empty", ""), ("z", "1")]))
    assert message.metadata == {"key": "value", "empty": "", "z": "1"}
    assert message.content == b"\0\3\0\1x"
    assert message.attribute("OpenIGTLink.key") == "value" and message.attribute("key") is None


@pytest.mark.parametrize("at", [0, 44, 50, 58, 60, 75, -1])
def test_a_changed_byte_is_noticed(at):
    data = bytearray(encode(2, "STRING", "d", b"\0\3\0\1x", [("key", "value")]))
    data[at] ^= 0x80
    with pytest.raises(ProtocolError):
        decode(bytes(data))


@pytest.mark.parametrize("size", [(4, 5, 6), (3, 3, 3), (2, 5, 4)])
def test_the_place_of_an_image_is_that_of_its_centre(size):
    spacing, first = np.array([2.0, 2.5, 3.0]), np.array([-10.0, 20.0, 5.0])
    centre = first + spacing * (np.array(size) - 1) / 2
    voxels = np.arange(np.prod(size) * 3, dtype="<f4")
    content = IMAGE.pack(1, 3, 10, 2, 1, *size, spacing[0], 0, 0, 0, spacing[1], 0, 0, 0, spacing[2], *centre, 0, 0, 0, *size)
    image, ijk_to_ras = igtl_reader.image_of(decode(encode(1, "IMAGE", "i", content + voxels.tobytes())))
    assert image.shape == (*reversed(size), 3) and image[0, 0, 1, 0] == 3.0  # x runs fastest, components before it
    assert ijk_to_ras[:3, 3] == pytest.approx(first) and np.diag(ijk_to_ras)[:3] == pytest.approx(spacing)
