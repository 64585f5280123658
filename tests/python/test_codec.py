# SPDX-License-Identifier: GPL-3.0-or-later
import dataclasses

import numpy as np
import pytest
from conftest import golden

import brainshift
from brainshift import codec, frame
from brainshift.v1 import brainshift_pb2 as pb


def payload(name):
    message, described = golden(name)
    return frame.decode(message).payload, described["value"]


@pytest.mark.parametrize("name", ["observation_tumour", "observation_cortex", "observation_landmarks",
                                  "observation_pose"])
def test_observations_are_read_and_written_to_the_byte(name):
    bytes_read, described = payload(name)
    observation = codec.recorded_observation(bytes_read)
    assert observation.source == described["source"]
    assert observation.sequence == described["sequence"]
    if "daemon_ns" not in described:  # the daemon's, which no client writes
        assert codec.observation(observation) == bytes_read


@pytest.mark.parametrize("name", ["update", "update_unusable"])
def test_an_update_has_the_numbers_that_were_sent(name):
    bytes_read, described = payload(name)
    update = codec.update(bytes_read)
    expected = np.asarray(described["displacement"]["xyz_mm"], np.float32).reshape(-1, 3)
    assert update.displacement_mm.dtype == np.float32 and np.array_equal(update.displacement_mm, expected)
    assert np.array_equal(update.sd_mm, np.asarray(described["sd_mm"], np.float32))
    known = bytes.fromhex(described.get("known", ""))
    assert (update.known is None) == (known == b"")
    assert known == b"" or np.array_equal(update.known, np.frombuffer(known, np.uint8) / np.float32(255.0))
    assert update.region_known == described.get("region_known")
    assert update.session == brainshift.SessionKey(described["boot_id"], described["session_id"], described["model_id"])
    assert update.quality == described.get("quality", 0)
    assert list(update.quality_flags) == described.get("quality_flags", [])
    assert update.min_volume_ratio == described.get("min_volume_ratio")
    assert update.contact.decrement == described["contact"].get("decrement")
    assert update.misfit == brainshift.MeanStd(described["misfit"]["mean_mm"], described["misfit"]["std_mm"])
    assert update.nodes is None


def test_a_part_names_its_nodes():
    bytes_read, described = payload("update_changes")
    update = codec.update(bytes_read)
    assert np.array_equal(update.nodes, np.cumsum(described["part"]["node_steps"]))
    assert update.mesh_nodes == 18475
    assert update.sd_mm is None and update.known is None


def test_only_final_fields_that_were_judged_usable_are_usable():
    good = codec.update(payload("update_changes")[0])
    assert good.usable
    assert not dataclasses.replace(good, final=False).usable
    assert not codec.update(payload("update")[0]).usable, "not judged"
    assert not codec.update(payload("update_unusable")[0]).usable
    failed = codec.update(payload("update_failed")[0])
    assert failed.failed and not failed.usable and failed.error_code == "empty_set"
    assert failed.displacement_mm is None


def test_a_model_has_the_arrays_that_were_sent():
    bytes_read, described = payload("model_reply")
    model = codec.model(bytes_read)
    assert np.array_equal(model.nodes.ravel(), described["nodes"]["xyz_mm"])
    assert model.tets.tolist() == [described["tet_indices"]]
    assert model.tumour.triangles.shape == (1, 3)
    assert np.array_equal(model.gravity_direction, described["gravity_direction"])
    assert model.tet_labels.tolist() == described["tet_labels"]
    assert model.septa.ravel().tolist() == described["septa_indices"]
    assert model.ventricles.ravel().tolist() == described["ventricle_indices"]


def test_session_states_and_other_replies_are_read():
    bytes_read, described = payload("session_state")
    state = codec.session_state(bytes_read)
    assert (state.newest_usable, state.valid_ms, state.phase) == (9, 1000, brainshift.Phase.DEGRADED)
    assert state.session.boot_id == described["session"]["boot_id"]
    assert codec.receipt(payload("observation_reply")[0]) == brainshift.Receipt(2, True)
    assert codec.error(payload("error_reply")[0]).code == "model_not_ready"
    assert codec.status(payload("status_reply")[0]).version == payload("status_reply")[1]["version"]
    assert codec.session(payload("start_session_reply")[0]).nodes == payload("start_session_reply")[1]["nodes"]


def test_subscriptions_are_written_to_the_byte():
    whole, ball, tumour = (payload(f"subscribe_{name}")[0] for name in ("request", "ball", "tumour"))
    assert codec.subscribe(5, 1, 70000, brainshift.Choice()) == whole
    near = brainshift.Choice(brainshift.NearTumour(0.0), spacing_mm=10.0, without_sd=True)
    assert codec.subscribe(2, 256, 1, near) == tumour
    message = pb.SubscribeRequest.FromString(ball)
    message.choice.tolerance_mm = 0.0  # this client takes whole choices only
    around = brainshift.Choice(brainshift.Ball([-30.5, 1 / 3, 42.0], 40.0))
    assert codec.subscribe(1, 1, 0, around) == message.SerializeToString()


@pytest.mark.parametrize("body, named", [
    (brainshift.TumourBoundary(np.zeros((3, 2)), 0.5), r"points: must be an array \(n, 3\), is \(3, 2\)"),
    (brainshift.TumourBoundary(np.zeros(3), 0.5), "points"),
    (brainshift.TumourBoundary([[0.0, float("nan"), 0.0]], 0.5), "points: has numbers that are not finite"),
    (brainshift.LandmarkPairs(np.zeros((2, 3)), np.zeros((3, 3)), 0.5), "as many rows"),
    (brainshift.CorticalSurface(np.zeros((3, 3)), 0.5, [[0, 1]]), "triangles"),
    (brainshift.PatientPose([0.0, 1.0]), "gravity_direction"),
    ("points", "str is no observation"),
])
def test_arrays_that_no_daemon_takes_are_named(body, named):
    with pytest.raises(ValueError, match=named):
        codec.observation(brainshift.Observation("case", "ius", 1, body))


@pytest.mark.parametrize("change, named", [
    (lambda m: m.displacement.xyz_mm.append(1.0), "multiple of 3"),
    (lambda m: m.sd_mm.append(1.0), "sd_mm"),
    (lambda m: setattr(m, "known", b"\xff"), "known"),
    (lambda m: m.part.node_steps.append(1), "part"),
    (lambda m: m.quality_flags.append(9), "flag"),
])
def test_updates_that_contradict_themselves_are_refused(change, named):
    message = pb.Update.FromString(payload("update_unusable")[0])
    change(message)
    with pytest.raises(brainshift.ProtocolError, match=named):
        codec.update(message.SerializeToString())


def test_a_part_of_nodes_that_there_are_not_is_refused():
    message = pb.Update.FromString(payload("update_changes")[0])
    message.part.mesh_nodes = 18474
    with pytest.raises(brainshift.ProtocolError, match="part.node_steps: names what there is not"):
        codec.update(message.SerializeToString())


def test_a_model_whose_elements_name_no_node_is_refused():
    message = pb.ModelReply.FromString(payload("model_reply")[0])
    message.tet_indices[3] = 4
    with pytest.raises(brainshift.ProtocolError, match="tet_indices"):
        codec.model(message.SerializeToString())


def test_a_damaged_payload_is_a_protocol_error():
    with pytest.raises(brainshift.ProtocolError, match="Update"):
        codec.update(payload("update")[0][:-3])
