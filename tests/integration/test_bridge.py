# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift bridge` between the real daemon and OpenIGTLink clients on the loopback interface."""
import dataclasses
import signal
import time
from types import SimpleNamespace

import igtl_peer
import numpy as np
import pytest
from igtl_peer import Peer
from igtl_reader import image_of, points_of, status_of
from programs import TIMEOUT_FACTOR, Background, brainshift as command, good, refused, serve

import brainshift

LONG_S = 60.0
STATUS_OK, STATUS_NOT_READY = 1, 13


def is_blank(message):
    return not image_of(message)[0].any()


def next_field(viewer):
    """The next volume of displacements that is not blank."""
    while (message := viewer.receive_from("brainshift_u", LONG_S)) is not None:
        if not is_blank(message):
            return message
    pytest.fail("no field came")


def shown_at(message, places):
    """The vectors of a volume at places (n, 3), trilinear, from the message alone."""
    voxels, ijk_to_ras = image_of(message)
    at = np.linalg.solve(ijk_to_ras[:3, :3], (np.atleast_2d(places) - ijk_to_ras[:3, 3]).T).T
    low = np.floor(at).astype(int)
    vectors = np.zeros_like(at)
    for corner in np.ndindex(2, 2, 2):
        i, j, k = (low + corner).T
        weights = np.where(corner, at - low, low + 1.0 - at).prod(axis=1)
        vectors += weights[:, np.newaxis] * voxels[k, j, i]
    return vectors


class Theatre(SimpleNamespace):
    """A daemon with a session, its console, the model, and a bridge once it is asked for."""

    def bridge_with(self, *more):
        self.bridge = Background("brainshift", "bridge", "--endpoint", self.daemon.address, "--listen", "127.0.0.1:0", *more,
                                 log=self.folder / "bridge.log")
        self.port = int(self.bridge.address.rsplit(":", 1)[1])

    def viewer(self, version=2, **how):
        return Peer.connect(self.port, version=version, **how)

    def submit(self):
        """The update that answers the recorded observation, sent once more."""
        self.observation = dataclasses.replace(self.observation, sequence=self.observation.sequence + 1,
                                               acquired_ns=self.observation.acquired_ns + 1_000_000)
        self.console.submit_observation(self.observation)
        return self.next_final()

    def next_final(self):
        while True:
            update = self.console.next_update(LONG_S)
            assert not update.failed, update.reason
            if update.final:
                return update


@pytest.fixture
def theatre(folder, inputs):
    with brainshift.Surgery(inputs / "head" / "paper.surgery") as surgery:
        observation = dataclasses.replace(next(surgery.observations()), session=brainshift.SessionKey())
    with serve(folder, model=inputs / "head" / "model.h5") as daemon, brainshift.connect(daemon.address) as console:
        console.start_session("colin27-coarse")
        theatre = Theatre(folder=folder, daemon=daemon, console=console, model=console.model(), observation=observation,
                          bridge=None)
        console.subscribe(16)
        yield theatre
        if theatre.bridge is not None:
            theatre.bridge.__exit__()


def test_nodes_land_where_the_daemon_says_within_the_stated_error(theatre):
    theatre.bridge_with()
    with theatre.viewer() as peer:
        update = theatre.submit()
        message = next_field(peer)
        told = message.metadata
        assert told["sequence"] == str(update.sequence)
        assert told["model_id"] == theatre.model.model_id
        assert told["currency"] == "current"
        assert told["direction"] == "modeling"
        error_mm = float(told["grid_error_mm"])
        assert 0.0 < error_mm < 1.0
        # Exact from here inwards.
        inner_mm = float(told["fade_mm"]) + 2.0 * float(told["spacing_mm"])
        voxels, ijk_to_ras = image_of(message)
        dims = np.array(voxels.shape[2::-1])
        low = ijk_to_ras[:3, 3] + inner_mm
        high = (ijk_to_ras @ (*(dims - 1), 1.0))[:3] - inner_mm
        nodes = theatre.model.nodes
        inside = ((nodes >= low) & (nodes <= high)).all(axis=1)
        u = update.displacement_mm[inside]
        assert np.linalg.norm(shown_at(message, nodes[inside]) - u, axis=1).max() < error_mm + 1e-4
        assert inside.sum() > 100
        assert np.linalg.norm(u, axis=1).max() > 3.0, "otherwise zeros would do"

        assert image_of(peer.receive_from("brainshift_sd"))[0].max() > 0.1
        assert 0.1 < image_of(peer.receive_from("brainshift_known"))[0].max() <= 1.0
        tumour, _ = points_of(peer.receive_from("brainshift_tumour"))
        assert len(tumour) == len(theatre.model.tumour.vertices)
        assert np.linalg.norm(tumour - theatre.model.tumour.vertices, axis=1).max() > 1.0


def test_a_client_of_version_one_never_receives_version_two(theatre):
    theatre.bridge_with("--json")
    with theatre.viewer(version=1) as old, theatre.viewer() as modern:
        theatre.submit()
        old.ask_for_status(1)
        next_field(modern)
        theatre.submit()
        field = False
        while (message := old.receive(3.0)) is not None:
            assert message.version == 1, message.type
            field = field or (message.device == "brainshift_u" and not is_blank(message))
            if message.device == "brainshift_cortex" and field:
                break
        assert field


def test_the_bridge_goes_blank_within_the_lease_when_the_daemon_is_killed(theatre):
    theatre.bridge_with()
    with theatre.viewer() as peer:
        theatre.submit()
        next_field(peer)
        assert peer.receive_from("brainshift_cortex") is not None
        theatre.daemon.end(signal.SIGKILL)
        killed = time.monotonic()
        code = STATUS_OK
        while code == STATUS_OK:
            code, reason = status_of(peer.receive_from("brainshift"))
        assert code == STATUS_NOT_READY
        assert "no word from " + theatre.daemon.address in reason
        message = peer.receive_from("brainshift_u")
        # The lease is a second; a look at it comes every 50 ms.
        assert time.monotonic() - killed < 2.0
        assert is_blank(message)
        assert message.metadata["currency"] == "stale"
        assert message.metadata["blank"] == "true"
        assert is_blank(peer.receive_from("brainshift_sd")) and is_blank(peer.receive_from("brainshift_known"))
        tumour, _ = points_of(peer.receive_from("brainshift_tumour"))
        undeformed = theatre.model.tumour.vertices
        assert np.linalg.norm(tumour - undeformed) <= 1e-5 * np.linalg.norm(undeformed)


def test_the_bridge_blanks_before_it_ends(theatre):
    theatre.bridge_with()
    with theatre.viewer() as peer:
        theatre.submit()
        next_field(peer)
        theatre.bridge.process.send_signal(signal.SIGTERM)
        blank, reason = False, ""
        while (message := peer.receive(TIMEOUT_FACTOR * 10.0)) is not None:  # until it hangs up
            if message.device == "brainshift_u":
                blank = is_blank(message)
            if message.type == "STATUS":
                _, reason = status_of(message)
        assert theatre.bridge.process.wait(TIMEOUT_FACTOR * 10.0) == 0  # a second signal would kill it
        assert blank, "the last volume that came"
        assert reason == "the bridge has ended"


def test_a_reader_that_stalls_gets_the_newest_and_little_else(theatre):
    theatre.bridge_with("--spacing", "1.5mm")
    with theatre.viewer(receive_buffer=64 * 1024) as stalled, theatre.viewer() as quick:
        updates = 25
        for _ in range(updates):
            newest = str(theatre.submit().sequence)
            while next_field(quick).metadata["sequence"] != newest:
                pass
        volumes, last = 0, None
        while last != newest:
            last = next_field(stalled).metadata["sequence"]
            volumes += 1
        assert volumes <= 4, f"of {updates}"


def test_a_model_that_slicer_sends_is_the_tumours_boundary(theatre):
    theatre.bridge_with("--tumour-device", "TumourNow", "--no-surfaces")
    with theatre.viewer() as peer:
        assert peer.receive_from("brainshift_u", LONG_S) is not None, "the bridge has the model"
        tumour = theatre.model.tumour
        peer.send(igtl_peer.surface("TumourNow", tumour.vertices - (0.0, 0.0, 3.0), tumour.triangles))
        update = theatre.next_final()
        assert update.usable, update.quality_reason
        ((_, _, moved),) = shown_at(next_field(peer), tumour.vertices.mean(axis=0))
        assert moved < -1.0


def test_bad_options_of_the_bridge_exit_two_with_one_line():
    for options, says in (
            (("--region", "nose"), "--region nose: must be brain"),
            (("--margin", "10"), "--margin 10: must be a length"),
            (("--spacing", "2cm"), "--spacing 2cm: must be a length"),
            (("--from", "18944"), "--from 18944: must be ADDRESS:PORT"),
            (("--from", "127.0.0.1:18944"), "say what of it to use"),
            (("--seeds", "s.csv"), "--from"),
            (("--landmarks-after", "F"), "both or none"),
            (("--key", "nowhere"), "--server-key"),
    ):
        done = command("bridge", "--listen", "127.0.0.1:0", *options)
        refused(done, says)
        assert done.stdout == ""


def test_help_of_the_bridge_teaches():
    shown = good(command("bridge", "--help")).stdout
    for part in ("Examples:", "brainshift_u", "--tumour-device", "OpenIGTLinkIF", "18945"):
        assert part in shown
