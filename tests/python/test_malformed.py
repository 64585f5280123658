# SPDX-License-Identifier: GPL-3.0-or-later
"""Every row of tests/data/wire/malformed.txt; the C++ client's tests read the same."""
import json
import math

import pytest
from conftest import GOLDEN, record
from displays import Displays, Script, waited_for
from fake_daemon import FakeDaemon

import brainshift
from brainshift import codec, frame
from brainshift.frame import MessageType
from brainshift.v1 import brainshift_pb2 as pb
from BrainshiftLib.label import LabelError, Light, may_be_shown, parse_state

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
    record("malformed", "Python client: verdicts other than the table's", len(wrong), "= 0", not wrong)
    assert not wrong


def test_numbers_are_not_mixed_with_what_a_newer_version_sends():
    (data,) = (bytes.fromhex(data) for _, name, data in ROWS if name == "update/displacement_then_unknown")
    update = codec.update(frame.decode(data).payload)
    assert update.displacement_mm.tolist() == [[0.5, -0.25, 0.0], [1.75, 3.0, -8.125]]
    with pytest.raises(brainshift.ProtocolError, match="the mesh has 10"):
        codec.check_mesh(update, 10)


def test_behind_the_bridge_no_refused_frame_is_shown():
    """`brainshift bridge` (the C++ client) and the core of the Slicer module see every row, as a push, between two sound updates."""
    script = Script()
    with FakeDaemon(script) as daemon:
        script.daemon = daemon
        # Of the session whose updates the rows are; the next of its updates has their number.
        script.key.update(boot_id=(1 << 63) + 1, session_id=3, model_id="00ff00ff00ff00ff")
        script.newest = script.usable = 7
        script.state.session.CopyFrom(pb.SessionKey(**script.key))
        script.state.newest_update = script.state.newest_usable = 7
        displays = Displays(daemon.endpoint, programs=("bridge", ), model=script.key["model_id"])
        try:
            shown, _ = waited_for(displays.slicer, lambda green, _: green)
            assert shown
            for verdict, name, data in ROWS:
                kind, payload = data[12:16], bytes.fromhex(data)[frame.HEADER_BYTES:]
                if name.startswith("frame/") or kind not in ("0c00", "0d00"):
                    daemon.push_bytes(bytes.fromhex(data))
                elif verdict == "refused":
                    daemon.push(MessageType(int(kind[:2], 16)), payload)
            _, words = displays.bridge()
            assert '"sequence":7' in words and displays.programs["bridge"].process.poll() is None
            script.set("fresh", script.key)
            shown, words = waited_for(displays.slicer, lambda green, _: green and displays.field().sequence == 8)
            assert shown, words
            strange = [label.sequence for label in displays.fields if not label.blank and label.sequence not in (7, 8)]
            record("malformed", "bridge and Slicer core: fields of refused frames shown", len(strange), "= 0", not strange)
            assert not strange
        finally:
            displays.end()


def test_a_label_that_is_malformed_in_any_key_is_never_green():
    state = {"sequence": 7, "session_id": "3", "model_id": "m", "case_id": "c", "quality": "good", "flags": "", "currency": "current",
             "reason": "", "age_ms": 10.0, "direction": "modeling", "recorded": False, "method": "condensed", "boundary": "contact",
             "blank": False, "has_sd": True, "grid_error_mm": 0.1, "spacing_mm": 2.0, "fade_mm": 10.0}
    sound = parse_state(json.dumps(state))
    assert may_be_shown(sound, sound, "m", 0.0, 3.0, 0.0).light is Light.GREEN
    bad = (None, [], {}, [1], "", "x", -1, -1e300, 1e999, math.nan, "nan", "\n", "true ", 0.5, "0x10", "good\0", "\ud800", "CURRENT",
           {"a": 1}, "\u202e")
    rows, taken = 0, []
    for key in state:
        for value in bad:
            rows += 2
            for text in (json.dumps(state | {key: value}), json.dumps({k: v for k, v in state.items() if k != key})):
                try:
                    label = parse_state(text)
                except LabelError as error:
                    assert "\n" not in str(error)
                    continue
                # Free texts, lengths and what it says of uncertainty decide nothing.
                if (may_be_shown(sound, label, "m", 0.0, 3.0, 0.0).light is Light.GREEN
                        and key not in ("case_id", "flags", "reason", "method", "boundary", "age_ms", "grid_error_mm", "spacing_mm",
                                        "fade_mm")):
                    taken.append((key, value))
    record("malformed", "labels for the Slicer core that are malformed", rows, ">= 300", rows >= 300)
    record("malformed", "Slicer core: of them shown in green", len(taken), "= 0", not taken)
    assert rows >= 300 and not taken, taken
