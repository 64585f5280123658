# SPDX-License-Identifier: GPL-3.0-or-later
import struct

import pytest
from conftest import GOLDEN, golden

from brainshift import ProtocolError, frame
from brainshift.frame import MessageType

NAMES = sorted(path.stem for path in GOLDEN.glob("*.bin"))


@pytest.mark.parametrize("name", NAMES)
def test_golden_frames_are_read_and_written_to_the_byte(name):
    message, described = golden(name)
    read = frame.decode(message)
    assert (read.type, read.request_id) == (described["type"], described["request_id"])
    assert frame.encode(read.type, read.request_id, read.payload) == message


def test_no_byte_may_be_another():
    message, _ = golden("observation_reply")
    for place in range(len(message)):
        changed = bytearray(message)
        changed[place] ^= 0x41
        with pytest.raises(ProtocolError):
            frame.decode(bytes(changed))


def test_no_byte_may_be_missing_or_too_much():
    message, _ = golden("observation_reply")
    for end in range(len(message)):
        with pytest.raises(ProtocolError):
            frame.decode(message[:end])
    with pytest.raises(ProtocolError):
        frame.decode(message + b"\0")


def test_a_size_above_the_limit_is_refused_and_named():
    message = bytearray(golden("status_request")[0])
    struct.pack_into("<I", message, 8, frame.MAX_PAYLOAD_BYTES + 1)
    with pytest.raises(ProtocolError, match="payload size"):
        frame.decode(bytes(message))


def test_a_payload_above_the_limit_is_not_written():
    with pytest.raises(ValueError, match="payload of"):
        frame.encode(MessageType.OBSERVATION, 1, bytes(frame.MAX_PAYLOAD_BYTES + 1))
