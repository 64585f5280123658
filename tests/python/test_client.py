# SPDX-License-Identifier: GPL-3.0-or-later
import os
import time

import numpy as np
import pytest
from fake_daemon import FakeDaemon, Script, state, update

import brainshift
from brainshift import Currency
from brainshift.frame import MessageType
from brainshift.v1 import brainshift_pb2 as pb

LONG_S = 20.0  # what never passes in a test that holds


@pytest.fixture
def script():
    return Script()


@pytest.fixture
def daemon(script):
    with FakeDaemon(script) as daemon:
        yield daemon


@pytest.fixture
def client(daemon):
    with brainshift.connect(daemon.endpoint, timeout_s=LONG_S) as client:
        yield client


def subscriptions(daemon):
    while not daemon.requests.empty():
        request = daemon.requests.get_nowait()
        if request.type == MessageType.SUBSCRIBE_REQUEST:
            yield pb.SubscribeRequest.FromString(request.payload)


def test_updates_arrive_in_order_and_the_usable_one_stays(daemon, script, client):
    client.subscribe(window=8)
    script.state = state(3, 1)
    daemon.push(MessageType.UPDATE, update(1))
    daemon.push(MessageType.UPDATE, update(2, quality=3))
    daemon.push(MessageType.UPDATE, update(3, status="failed", quality=0))
    assert [client.next_update(LONG_S).sequence for _ in range(3)] == [1, 2, 3]
    assert client.latest_usable.sequence == 1
    assert client.latest_usable.displacement_mm.tolist() == [[1.0, 0.0, 0.0]]


def test_what_was_received_is_told_to_the_daemon(daemon, client):
    client.subscribe(window=1)
    daemon.push(MessageType.UPDATE, update(1))
    client.next_update(LONG_S)
    with pytest.raises(brainshift.Unavailable):
        client.next_update(0.05)
    told = list(subscriptions(daemon))
    assert (told[0].received, told[0].window) == (0, 1)
    assert told[-1].received == 1 and told[-1].subscription == told[0].subscription


def test_a_viewer_that_comes_late_gets_the_newest(daemon, script, client):
    client.subscribe(window=1)
    daemon.push(MessageType.UPDATE, update(1))
    script.state = state(2, 2)  # meanwhile
    daemon.push(MessageType.UPDATE, update(2))
    wait_until(lambda: client._socket.poll(10))
    assert client.next_update(LONG_S).sequence == 2
    assert client.field_status().currency == Currency.CURRENT


def wait_until(condition):
    deadline = time.monotonic() + LONG_S
    while not condition():
        assert time.monotonic() < deadline


def test_updates_of_another_session_are_dropped(daemon, script, client):
    client.subscribe(window=8)
    daemon.push(MessageType.UPDATE, update(5, session_id=0))
    daemon.push(MessageType.UPDATE, update(6, boot_id=99))
    daemon.push(MessageType.UPDATE, update(1))
    assert client.next_update(LONG_S).sequence == 1


def test_another_session_takes_the_field_away(daemon, script, client):
    client.subscribe(window=8)
    script.state = state(1, 1)
    daemon.push(MessageType.UPDATE, update(1))
    client.next_update(LONG_S)
    script.state = state(key=dict(boot_id=8))  # restarted
    with pytest.raises(brainshift.Unavailable):
        client.next_update(0.6)
    assert client.latest_usable is None
    assert client.field_status().currency == Currency.NONE


def test_updates_that_wait_end_with_their_session(daemon, script, client):
    client.subscribe(window=16)
    daemon.push(MessageType.UPDATE, update(1))
    script.replies[MessageType.START_SESSION_REQUEST] = (
        MessageType.START_SESSION_REPLY, pb.StartSessionReply(boot_id=7, session_id=2, model_id="model").SerializeToString())
    wait_until(lambda: client._socket.poll(0))
    client.start_session("case", takeover=True)
    daemon.push(MessageType.UPDATE, update(1, session_id=2))
    assert client.next_update(LONG_S).session.session_id == 2
    assert client.latest_usable.session.session_id == 2


def test_who_started_a_session_observes_for_no_other(daemon, script, client):
    script.replies[MessageType.START_SESSION_REQUEST] = (
        MessageType.START_SESSION_REPLY, pb.StartSessionReply(boot_id=7, session_id=1, model_id="model").SerializeToString())
    script.replies[MessageType.OBSERVATION] = (MessageType.OBSERVATION_REPLY, pb.ObservationReply().SerializeToString())
    pairs = brainshift.LandmarkPairs(np.ones((3, 3)), np.ones((3, 3)), 0.1)
    client.start_session("case")
    client.submit(pairs, "ius")
    client._latest.follow(brainshift.SessionKey(7, 2, "model"))
    with pytest.raises(brainshift.Error, match="session 1 has ended: another client has started session 2") as caught:
        client.submit(pairs, "ius")
    assert caught.value.code == "unavailable"


def test_a_field_of_another_mesh_is_refused_by_next_update_alone(daemon, script, client):
    script.replies[MessageType.START_SESSION_REQUEST] = (
        MessageType.START_SESSION_REPLY,
        pb.StartSessionReply(boot_id=7, session_id=1, model_id="model", nodes=10).SerializeToString())
    script.replies[MessageType.STATUS_REQUEST] = (MessageType.STATUS_REPLY, pb.StatusReply(version="v").SerializeToString())
    client.start_session("case")
    client.subscribe(window=16)
    daemon.push(MessageType.UPDATE, update(1))
    wait_until(lambda: client._socket.poll(0))
    assert client.status().version == "v"
    with pytest.raises(brainshift.ProtocolError, match="1 nodes, the mesh has 10"):
        client.next_update(LONG_S)
    assert client.latest_usable is None


def test_a_silent_daemon_makes_the_field_stale(daemon, script, client):
    script.state = state(1, 1, valid_ms=50)
    client.subscribe(window=8)
    daemon.push(MessageType.UPDATE, update(1))
    client.next_update(LONG_S)
    wait_until(lambda: client.field_status().currency == Currency.STALE)
    assert "no word from" in client.field_status().reason


def test_a_late_answer_is_not_taken_for_the_next_one(daemon, script, client):
    script.replies[MessageType.STATUS_REQUEST] = (None, None)
    with pytest.raises(brainshift.Unavailable, match="no answer"):
        client._ask(MessageType.STATUS_REQUEST, b"", MessageType.STATUS_REPLY, lambda payload: payload, 0.05)
    late = pb.StatusReply(version="late").SerializeToString()
    now = pb.StatusReply(version="now").SerializeToString()
    script_answers = [[(MessageType.STATUS_REPLY, 1, late), (MessageType.STATUS_REPLY, 2, now)]]
    daemon.answers = lambda request: script_answers.pop(0)
    assert client.status().version == "now"


def test_the_daemons_no_has_its_code_and_sentence(script, client):
    script.replies[MessageType.MODEL_REQUEST] = (
        MessageType.ERROR_REPLY, pb.ErrorReply(code="model_not_ready", message="no model").SerializeToString())
    with pytest.raises(brainshift.Error) as caught:
        client.model()
    assert (caught.value.code, caught.value.message) == ("model_not_ready", "no model")
    assert str(caught.value) == "no model (model_not_ready)"


def test_a_reply_of_another_type_is_a_protocol_error(script, client):
    script.replies[MessageType.STATUS_REQUEST] = (MessageType.OBSERVATION_REPLY, b"")
    with pytest.raises(brainshift.ProtocolError, match="OBSERVATION_REPLY"):
        client.status()


def test_multipart_messages_are_refused(daemon, client):
    client.subscribe()
    daemon.push_bytes(b"one", b"two")
    with pytest.raises(brainshift.ProtocolError, match="multipart"):
        client.next_update(LONG_S)


def test_a_refused_choice_leaves_the_subscription_before(daemon, script, client):
    client.subscribe(window=8)
    refusal = (MessageType.ERROR_REPLY, pb.ErrorReply(code="empty_set", message="no node").SerializeToString())
    daemon.answers = lambda request: [(refusal[0], request.request_id, refusal[1])]
    with pytest.raises(brainshift.Error, match="no node"):
        client.subscribe(choice=brainshift.Choice(brainshift.Ball([0, 0, 0], 1.0)))
    daemon.answers = script
    daemon.push(MessageType.UPDATE, update(1))
    assert client.next_update(LONG_S).sequence == 1
    assert client._subscription.window == 8


def test_sequences_count_up_per_source(daemon, script, client):
    script.replies[MessageType.STATUS_REQUEST] = (MessageType.STATUS_REPLY,
                                                  pb.StatusReply(case_id="case").SerializeToString())
    script.replies[MessageType.OBSERVATION] = (MessageType.OBSERVATION_REPLY, b"")
    points = brainshift.TumourBoundary(np.zeros((4, 3)), 0.5)
    for source in ("ius", "ius", "pointer"):
        client.submit(points, source)
    client.submit(points, "ius", sequence=9)
    client.submit(points, "ius")
    sent = []
    while not daemon.requests.empty():
        request = daemon.requests.get_nowait()
        if request.type == MessageType.OBSERVATION:
            sent.append(pb.Observation.FromString(request.payload))
    assert [(o.source, o.sequence) for o in sent] == [("ius", 1), ("ius", 2), ("pointer", 1), ("ius", 9), ("ius", 10)]
    assert all(o.frame == "ras" and o.case_id == "case" and o.sent_ns >= o.acquired_ns > 0 for o in sent)


def test_updates_end_when_none_arrives(daemon, client):
    client.subscribe(window=8)
    daemon.push(MessageType.UPDATE, update(1))
    assert [u.sequence for u in client.updates(timeout_s=0.3)] == [1]


def test_nobody_there_is_said_in_time():
    with brainshift.connect("tcp://127.0.0.1:1", timeout_s=0.1) as client:
        with pytest.raises(brainshift.Unavailable, match="no daemon at tcp://127.0.0.1:1"):
            client.status()


@pytest.mark.parametrize("endpoint", ["", "nonsense", "tcp://", "ftp://127.0.0.1:5555"])
def test_endpoints_that_are_none_are_named(endpoint):
    with pytest.raises(ValueError, match="endpoint"):
        brainshift.connect(endpoint)


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, float("nan"), float("inf")])
def test_timeouts_that_are_none_are_refused(timeout_s):
    with pytest.raises(ValueError, match="timeout_s"):
        brainshift.connect("tcp://127.0.0.1:1", timeout_s=timeout_s)


@pytest.mark.parametrize("window", [0, 257])
def test_windows_outside_the_range_are_refused(client, window):
    with pytest.raises(ValueError, match="window"):
        client.subscribe(window=window)


def write(path, text, mode=0o600):
    path.write_text(text)
    os.chmod(path, mode)
    return path


def test_key_files_are_read_and_what_is_wrong_is_named(tmp_path):
    key = "x" * 40
    public = write(tmp_path / "d.public", f"name: d\npublic: {key}\n", 0o644)
    secret = write(tmp_path / "me.secret", f"name: me\npublic: {'y' * 40}\nsecret: {'z' * 40}\n")
    keys = brainshift.read_keys(public, secret)
    assert (keys.server_public_key, keys.public_key, keys.secret_key) == (key, "y" * 40, "z" * 40)
    assert "z" * 40 not in repr(keys)
    os.chmod(secret, 0o640)
    with pytest.raises(ValueError, match="others may read it"):
        brainshift.read_keys(public, secret)
    os.chmod(secret, 0o600)
    short = write(tmp_path / "short.secret", f"public: {'y' * 40}\nsecret: {'z' * 39}\n")
    with pytest.raises(ValueError, match="secret must be a key of 40 characters") as caught:
        brainshift.read_keys(public, short)
    assert "zzz" not in str(caught.value)
    with pytest.raises(ValueError, match='no line "secret'):
        brainshift.read_keys(public, write(tmp_path / "none.secret", f"public: {'y' * 40}\n"))
    with pytest.raises(FileNotFoundError):
        brainshift.read_keys(tmp_path / "missing", secret)
