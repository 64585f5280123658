# SPDX-License-Identifier: GPL-3.0-or-later
"""Against the real daemon, on the coarse head."""
import re
import subprocess
import sys
import time

import meshio
import numpy as np
import pytest
from conftest import PROGRAMS, SOURCE, Daemon, run

import brainshift
from brainshift import Currency, Phase


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def daemon(place, head):
    (place / "journal").mkdir()
    with Daemon(place, head / "model.h5", f"journal_dir: {place / 'journal'}\n") as daemon:
        yield daemon


def observations(head):
    with brainshift.Surgery(head / "joint.surgery") as surgery:
        return list(surgery.observations())


def test_a_surgery_gives_fields_that_a_viewer_may_show(daemon, head):
    with brainshift.connect(daemon.endpoint) as client, brainshift.connect(daemon.endpoint) as viewer:
        assert client.status().model_ready
        session = client.start_session(takeover=True, recorded_clock=True)
        model = client.model()
        assert (len(model.nodes), len(model.tets)) == (session.nodes, session.tets)
        client.subscribe(window=16)
        assert viewer.subscribe().phase == Phase.READY
        for observation in observations(head):
            client.submit_observation(observation)
            update = client.next_update(timeout_s=60)
            assert update.final and update.usable and update.session == session.key
            assert update.displacement_mm.shape == model.nodes.shape
            assert update.sd_mm.shape == (session.nodes,) and (update.sd_mm > 0.0).all()
        shown = viewer.next_update(timeout_s=60)
        assert shown.sequence == update.sequence, "the newest, not the oldest"
        assert np.array_equal(shown.displacement_mm, update.displacement_mm)
        assert viewer.field_status().currency == Currency.CURRENT
        mesh = model.to_meshio(shown)
        assert np.array_equal(mesh.points, model.nodes)
        assert np.array_equal(mesh.point_data["displacement_mm"], shown.displacement_mm)


def test_a_viewer_may_choose_a_region(daemon, head):
    with brainshift.connect(daemon.endpoint) as client:
        client.start_session(takeover=True, recorded_clock=True)
        model = client.model()
        near = brainshift.Choice(brainshift.NearTumour(10.0), without_sd=True)
        client.subscribe(window=16, choice=near)
        client.submit_observation(observations(head)[0])
        update = client.next_update(timeout_s=60)
        assert 0 < len(update.nodes) < len(model.nodes) and update.mesh_nodes == len(model.nodes)
        assert update.sd_mm is None and len(update.displacement_mm) == len(update.nodes)
        with pytest.raises(ValueError, match="no field for every node"):
            model.to_meshio(update)
        with pytest.raises(brainshift.Error, match="node"):
            client.subscribe(choice=brainshift.Choice(brainshift.Ball([900.0, 0.0, 0.0], 1.0)))


def test_points_of_a_callers_own_become_an_observation(daemon, head):
    boundary = observations(head)[0].body
    with brainshift.connect(daemon.endpoint) as client:
        client.start_session(takeover=True)
        client.subscribe(window=16)
        receipt = client.submit(brainshift.TumourBoundary(np.asarray(boundary.points), boundary.sd_mm), "ius")
        assert receipt.observation_sequence == 1
        assert client.next_update(timeout_s=60).observation_sequence == 1
        client.submit(brainshift.TumourBoundary([[500.0, 500.0, 500.0]] * 10, 0.5), "ius")
        failed = client.next_update(timeout_s=60)
        assert failed.failed and failed.reason and failed.displacement_mm is None
        assert client.latest_usable.observation_sequence == 1
        with pytest.raises(brainshift.Unavailable):
            client.next_update(timeout_s=0.4)  # asks what is current
        assert client.field_status().currency == Currency.DEGRADED
        with pytest.raises(brainshift.Error) as caught:
            client.submit(boundary, "ius", sequence=1)
        assert caught.value.code == "invalid_argument"


def recorded_updates(folder, key):
    """Journal and updates of a session, once the daemon has written one."""
    deadline = time.monotonic() + 30.0
    while True:
        for path in folder.glob("*.surgery"):
            with brainshift.Surgery(path) as surgery:
                found = [update for update in surgery.updates() if update.session == key]
            if found:
                return path, found
        assert time.monotonic() < deadline, "nothing was recorded"


def test_the_recorded_update_decodes_as_the_command_line_exports_it(daemon, place, head):
    """Independent decoders of the same bytes: this package and `brainshift journal export`."""
    with brainshift.connect(daemon.endpoint) as client:
        session = client.start_session(takeover=True, recorded_clock=True)
        client.subscribe(window=16)
        client.submit_observation(observations(head)[0])
        live = client.next_update(timeout_s=60)
    path, recorded = recorded_updates(place / "journal", session.key)
    assert np.array_equal(recorded[-1].displacement_mm, live.displacement_mm)
    copy = place / "copy.surgery"
    run("brainshift", "journal", "repair", path, "--out", copy)  # the daemon still writes the other
    run("brainshift", "journal", "export", copy, "--vtu", place / "fields", "--model", head / "model.h5")
    (field,) = (place / "fields").glob("*.vtu")
    # meshio 5 refuses strings in the field data, where our files say that their points are RAS.
    field.write_text(re.sub("<FieldData>.*</FieldData>", "", field.read_text(), flags=re.DOTALL))
    exported = meshio.read(field).point_data
    assert np.array_equal(exported["displacement"].astype(np.float32), live.displacement_mm)
    assert np.array_equal(exported["sd_mm"].ravel().astype(np.float32), live.sd_mm)


def test_a_daemon_with_keys_tells_strangers_nothing(tmp_path, head):
    for name in ("daemon", "me"):
        run("brainshift", "keys", "make", name, "--dir", tmp_path)
    run("brainshift", "keys", "add", "--allow", tmp_path / "allow-list", "--role", "viewer", tmp_path / "me.public")
    config = f"security:\n  secret_key: {tmp_path / 'daemon.secret'}\n  allow_list: {tmp_path / 'allow-list'}\n"
    with Daemon(tmp_path, head / "model.h5", config) as daemon:
        keys = brainshift.read_keys(tmp_path / "daemon.public", tmp_path / "me.secret")
        with brainshift.connect(daemon.endpoint, keys) as client:
            assert client.status().model_ready
            with pytest.raises(brainshift.Error) as caught:
                client.start_session()
            assert caught.value.code == "not_allowed"
        with brainshift.connect(daemon.endpoint, timeout_s=0.5) as stranger:
            with pytest.raises(brainshift.Unavailable):
                stranger.status()


def test_the_example_draws_the_field(daemon, place, head):
    picture, mesh = place / "field.png", place / "field.vtu"
    done = subprocess.run(
        [sys.executable, SOURCE / "client" / "python" / "examples" / "replay_surgery.py", head / "joint.surgery",
         "--endpoint", daemon.endpoint, "--picture", picture, "--mesh", mesh],
        capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("largest motion") == 3
    assert picture.stat().st_size > 20_000 and mesh.stat().st_size > 20_000


def test_the_example_says_what_is_wrong_in_one_line(head):
    done = subprocess.run(
        [sys.executable, SOURCE / "client" / "python" / "examples" / "replay_surgery.py", head / "missing.surgery"],
        capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and "no such file" in done.stderr
