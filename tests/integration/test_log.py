# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon whose log nobody reads goes on serving, and ends when it is told to."""
import fcntl
import os
import select

import pytest
import zmq
from programs import LOCAL, serve

import brainshift

SILENCE_S = 20.0


class StalledReader:
    """A named pipe with a reader that reads nothing until it is asked to."""

    def __init__(self, path):
        os.mkfifo(path, 0o600)
        # Open for writing as well: a daemon that opens the pipe need not wait for a reader.
        self._fd = os.open(path, os.O_RDWR | os.O_CLOEXEC)

    def close(self):
        os.close(self._fd)

    def bytes(self):
        """That the pipe holds."""
        return fcntl.fcntl(self._fd, fcntl.F_GETPIPE_SZ)

    def read_to(self, text):
        read = b""
        while text not in read and select.select([self._fd], [], [], SILENCE_S)[0]:
            read += os.read(self._fd, 4096)
        return read


def answers_malformed(endpoint, frames):
    """Sends frames that the daemon refuses, each with a reply and with a line of at least 60 bytes in its log. A reply may get
    lost; a daemon that answers none of `patience` frames has stopped."""
    patience, unanswered = 10, 0
    with zmq.Context() as context, context.socket(zmq.DEALER) as socket:
        socket.linger = 0
        socket.connect(endpoint)
        for _ in range(frames):
            socket.send(b"not a frame")
            if socket.poll(200):
                socket.recv()
                unanswered = 0
            else:
                unanswered += 1
            if unanswered == patience:
                return False
    return True


@pytest.fixture
def stalled(folder):
    """A daemon and the reader of its log, which has stopped reading; pipe and queue of the log are full."""
    reader = StalledReader(folder / "log")
    with serve(folder, LOCAL + "log_level: debug\n", log="log") as daemon:
        assert answers_malformed(daemon.address, reader.bytes() // 60 + 3000), "the daemon waits for the reader of its log"
        yield daemon, reader
    reader.close()


def test_status_is_answered_and_the_lost_lines_are_counted_once_lines_flow_again(stalled):
    daemon, reader = stalled
    with brainshift.connect(daemon.address) as client:
        client.status()
    read = reader.read_to(b"lines of the log were lost")
    assert b"lines of the log were lost" in read
    assert b"malformed frame" in read


def test_sigterm_ends_the_daemon_with_status_zero(stalled):
    daemon, _ = stalled
    assert daemon.end() == 0
