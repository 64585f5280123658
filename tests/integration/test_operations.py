# SPDX-License-Identifier: GPL-3.0-or-later
"""What a running daemon tells systemd, a person and a monitor."""
import json
import os
import socket

import pytest
from programs import LOCAL, brainshift, brainshiftd, serve, write


class ServiceManager:
    """A datagram socket in the place of systemd's."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.env = {**os.environ, "NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "600000"}

    def hear_to(self, last):
        """Words until one begins with `last`; waits for at most 10 s of silence."""
        words = []
        self.socket.settimeout(10.0)
        while not words or not words[-1].startswith(last):
            try:
                words.append(self.socket.recv(512).decode())
            except TimeoutError:
                pytest.fail(f"no {last} among {words}")
        return words

    def is_silent(self):
        self.socket.settimeout(0.0)
        try:
            return not self.socket.recv(512)
        except BlockingIOError:
            return True


@pytest.fixture
def manager(folder):
    manager = ServiceManager(folder / "notify")
    yield manager
    manager.socket.close()


def test_ready_is_said_once_clients_can_connect_and_stopping_at_the_end(folder, manager):
    with serve(folder, env=manager.env) as daemon:
        assert manager.hear_to("READY=1")[0] == "READY=1", "nothing before it"
        assert daemon.first_line.startswith("listening on ")
        assert "STATUS=empty" in manager.hear_to("STATUS=")
        # It lives although nobody asks it anything.
        for _ in range(4):
            manager.hear_to("WATCHDOG=1")
        assert daemon.end() == 0
        assert "READY=1" not in manager.hear_to("STOPPING=1")


def test_a_stopped_process_is_silent(folder, manager):
    with serve(folder, env=manager.env) as daemon:
        manager.hear_to("WATCHDOG=1")
        assert daemon.end() == 0
        manager.hear_to("STOPPING=1")
        assert manager.is_silent()


def test_status_of_a_daemon_without_a_model_is_a_page_and_a_reason(folder):
    with serve(folder) as daemon:
        endpoint = daemon.address
        text = brainshift("status", "--endpoint", endpoint, limit_s=30.0)
        assert text.returncode == 1
        assert "ATTENTION: no model is loaded" in text.stdout
        assert "1 connected" in text.stdout
        assert text.stderr == f"brainshift: {endpoint}: no model is loaded\n"
        told = brainshift("status", "--json", "--endpoint", endpoint, limit_s=30.0)
        assert told.returncode == 1
        read = json.loads(told.stdout)
        assert read["well"] is False
        assert read["session"]["phase"] == "empty"
        assert read["process"]["resident_bytes"] > 1 << 20
        once = brainshift("top", "--once", "--interval", "0.1", "--endpoint", endpoint, limit_s=30.0)
        assert once.returncode == 0, once.stderr
        assert "0.0/s" in once.stdout


def test_a_metrics_port_that_is_taken_stops_the_start_in_one_line(folder):
    with serve(folder, LOCAL + "metrics: {endpoint: '127.0.0.1:0'}\n") as first:
        port = first.address.rsplit(":", 1)[1]  # somebody listens there
        config = write(folder / "second.yaml", LOCAL + f"metrics: {{endpoint: '127.0.0.1:{port}'}}\nlog_level: error\n")
        second = brainshiftd("serve", "--config", config, limit_s=30.0)
    assert second.returncode == 2
    assert f"metrics.endpoint = 127.0.0.1:{port}" in second.stderr
    assert second.stderr.count("\n") == 1, second.stderr
