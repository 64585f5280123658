# SPDX-License-Identifier: GPL-3.0-or-later
"""From the daemon through `brainshift bridge` to the core of the Slicer module, over a socket.

What SlicerOpenIGTLink does in between, the tests' own reader does (igtl_reader.py).
"""
import re
import subprocess
import time

import igtl_reader
import numpy as np
import pytest
import slicer_paths  # first: it finds BrainshiftLib
from conftest import PROGRAMS, Daemon
from igtl_reader import Reader
from slicer_fields import image_of

import brainshift
from BrainshiftLib.grid import FieldError, check_field, field_from_image, grid_transform
from BrainshiftLib.label import may_be_shown, parse_metadata, parse_state

assert slicer_paths.MODULE.is_dir()
pytestmark = pytest.mark.skipif(
    subprocess.run([PROGRAMS / "brainshift", "bridge", "--help"], capture_output=True, timeout=60).returncode != 0,
    reason="this build has no `brainshift bridge`")


class Bridge:
    """On a port that the system chooses; `with` ends it."""

    def __init__(self, endpoint):
        self.process = subprocess.Popen([PROGRAMS / "brainshift", "bridge", "--endpoint", endpoint, "--listen", "127.0.0.1:0",
                                         "--spacing", "4mm"],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = ""
        for line in self.process.stdout:
            said += line
            found = re.search(r"127\.0\.0\.1:(\d+)", line)
            if found:
                self.address = ("127.0.0.1", int(found.group(1)))
                return
        raise AssertionError(f"the bridge named no port: {said}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.stdout.close()
        self.process.wait(timeout=30)


class Seen:
    """What a viewer knows: the newest message of each device."""

    def __init__(self, reader):
        self.reader, self.newest, self.versions = reader, {}, set()

    def until(self, condition, timeout_s=60.0):
        deadline = time.monotonic() + timeout_s
        while not condition(self):
            assert time.monotonic() < deadline, f"waited in vain: {self.state}"
            message = self.reader.next()
            assert message is not None, "the bridge closed the connection"
            self.newest[message.type, message.device] = message
            self.versions.add(message.version)
        return self

    @property
    def state(self):
        message = self.newest.get(("STRING", "brainshift_state"))
        return None if message is None else parse_state(igtl_reader.string_of(message))

    @property
    def field_message(self):
        return self.newest.get(("IMAGE", "brainshift_u"))

    @property
    def label(self):
        return None if self.field_message is None else parse_metadata(self.field_message.attribute)

    @property
    def field(self):
        voxels, ijk_to_ras = igtl_reader.image_of(self.field_message)
        return field_from_image(image_of(voxels.astype(np.float32)), ijk_to_ras)

    def verdict(self, pinned):
        return may_be_shown(self.label, self.state, pinned, 0.0, 3.0, 0.0)


def of_update(sequence):
    return lambda seen: seen.label is not None and seen.label.sequence == sequence == seen.state.sequence


@pytest.fixture
def place(tmp_path, head):
    with Daemon(tmp_path, head / "model.h5") as daemon, brainshift.connect(daemon.endpoint) as client:
        with brainshift.Surgery(head / "joint.surgery") as surgery:
            observations = list(surgery.observations())
        client.start_session(takeover=True, recorded_clock=True)
        client.subscribe(window=16)
        with Bridge(daemon.endpoint) as bridge:
            def observe(index):
                client.submit_observation(observations[index])
                return client.next_update(timeout_s=60)
            yield daemon, client, bridge, observe


def test_nodes_land_where_the_daemon_says_within_the_stated_error(place):
    _, client, bridge, observe = place
    model = client.model()
    with Reader(bridge.address) as reader:
        seen = Seen(reader)
        update = observe(0)
        assert update.usable
        seen.until(of_update(update.sequence))
        assert seen.verdict(seen.state.model_id).show, seen.verdict(seen.state.model_id)
        assert not seen.verdict("another model").show and not seen.verdict("").show
        field, label = seen.field, seen.label
        transform = grid_transform(field)
        nodes, u = np.asarray(model.nodes), np.asarray(update.displacement_mm, dtype=float)
        last = field.origin + field.spacing * (np.array(field.vectors.shape[2::-1]) - 1)
        depth = np.minimum(nodes - field.origin, last - nodes).min(axis=1)
        inside = depth > label.fade_mm + 1.5 * label.spacing_mm
        assert inside.sum() > 50 and np.linalg.norm(u[inside], axis=1).max() > 0.5
        there = np.array([transform.TransformPoint(*node) for node in nodes[inside]])
        error = np.linalg.norm(there - (nodes + u)[inside], axis=1)
        assert error.max() <= label.grid_error_mm + 1e-3
        against = np.linalg.norm(there - (nodes - u)[inside], axis=1)
        assert against.max() > 1.0, "the opposite direction is not what arrived"
        back = np.array([transform.GetInverse().TransformPoint(*point) for point in there])
        assert np.linalg.norm(back - nodes[inside], axis=1).max() <= 0.02
        outside = nodes[depth < 0.0]
        assert len(outside) > 50
        assert all(transform.TransformPoint(*node) == tuple(node) for node in outside[:50])


def test_a_daemon_that_falls_silent_takes_the_field_away(place):
    daemon, _, bridge, observe = place
    with Reader(bridge.address) as reader:
        seen = Seen(reader)
        update = observe(0)
        seen.until(of_update(update.sequence))
        model = seen.state.model_id
        assert seen.verdict(model).show
        daemon.process.send_signal(19)  # SIGSTOP
        try:
            seen.until(lambda seen: seen.label.blank and seen.state.blank, timeout_s=20.0)
            assert not seen.verdict(model).show and seen.verdict(model).reason
            with pytest.raises(FieldError, match="blank"):
                check_field(seen.field)
        finally:
            daemon.process.send_signal(18)  # SIGCONT


def test_a_bridge_that_ends_blanks_first(place):
    _, _, bridge, observe = place
    with Reader(bridge.address) as reader:
        seen = Seen(reader)
        update = observe(0)
        seen.until(of_update(update.sequence))
        bridge.process.terminate()
        seen.until(lambda seen: seen.label.blank, timeout_s=20.0)
        assert not seen.verdict(seen.label.model_id).show


def test_a_client_of_version_1_gets_no_version_2_and_the_module_shows_it_nothing(place):
    _, _, bridge, observe = place
    with Reader(bridge.address, version=1) as reader:
        seen = Seen(reader)
        update = observe(0)
        seen.until(lambda seen: seen.state is not None and seen.state.sequence == update.sequence and seen.field_message)
        assert seen.versions == {1} and seen.label is None
        assert not seen.verdict(seen.state.model_id).show
