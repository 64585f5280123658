# SPDX-License-Identifier: GPL-3.0-or-later
"""Every row of tests/data/wire/malformed.txt; the C++ client's tests read the same."""
import pytest
from conftest import GOLDEN

import brainshift
from brainshift import codec, frame
from brainshift.frame import MessageType

DECODERS = {
    MessageType.STATUS_REPLY: codec.status, MessageType.START_SESSION_REPLY: codec.session,
    MessageType.MODEL_REPLY: codec.model, MessageType.OBSERVATION: codec.recorded_observation,
    MessageType.OBSERVATION_REPLY: codec.receipt, MessageType.ERROR_REPLY: codec.error,
    MessageType.UPDATE: codec.update, MessageType.SESSION_STATE: codec.session_state}
ROWS = [line.split(" ") for line in (GOLDEN / "malformed.txt").read_text().splitlines()]


def refusal(data):
    try:
        received = frame.decode(data)
        DECODERS[received.type](received.payload)
        return ""
    except brainshift.ProtocolError as error:
        return error.message


def test_frames_are_refused_as_the_table_says():
    assert len(ROWS) >= 300
    wrong = [(name, verdict, why) for verdict, name, data in ROWS
             if (verdict == "ok") != ((why := refusal(bytes.fromhex(data))) == "") or "\n" in why]
    assert not wrong


def test_numbers_are_not_mixed_with_what_a_newer_version_sends():
    (data,) = (bytes.fromhex(data) for _, name, data in ROWS if name == "update/displacement_then_unknown")
    update = codec.update(frame.decode(data).payload)
    assert update.displacement_mm.tolist() == [[0.5, -0.25, 0.0], [1.75, 3.0, -8.125]]
    with pytest.raises(brainshift.ProtocolError, match="the mesh has 10"):
        codec.check_mesh(update, 10)
