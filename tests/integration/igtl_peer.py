# SPDX-License-Identifier: GPL-3.0-or-later
"""The other side of an OpenIGTLink connection on the loopback interface: it sends, and waits for what it is asked for, with a
limit. The messages are those of tests/python/igtl_reader.py."""
import socket
import struct
import time

import igtl_reader
import numpy as np

LIMIT_S = 10.0


class Peer(igtl_reader.Reader):
    def __init__(self, connection):
        self._socket = connection

    @classmethod
    def connect(cls, port, *, version, receive_buffer=None):
        """A client of 3D Slicer's version 2 or of version 1. It shows version 2 at once, and version 1 when it sends.

        receive_buffer: of the system, bytes.
        """
        connection = socket.socket()
        if receive_buffer is not None:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        connection.connect(("127.0.0.1", port))
        peer = cls(connection)
        if version == 2:
            peer.ask_for_status(version)
        return peer

    def ask_for_status(self, version):
        self.send(igtl_reader.encode(version, "GET_STATUS", "", b""))

    def send(self, message):
        try:
            self._socket.sendall(message)
        except (BrokenPipeError, ConnectionResetError):
            pass  # the other side has closed: receive() will tell

    def receive(self, limit_s=LIMIT_S):
        """The next message; None when the limit is over or the other side has closed."""
        try:
            return self.next(limit_s)
        except (TimeoutError, ConnectionResetError):
            return None

    def receive_from(self, device, limit_s=LIMIT_S):
        """The next message of this device; messages of others are dropped."""
        deadline = time.monotonic() + limit_s
        while True:
            message = self.receive(deadline - time.monotonic())
            if message is None or message.device == device:
                return message


class Listener:
    """Listens on a port of 127.0.0.1 that the system chooses."""

    def __init__(self):
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._socket.settimeout(LIMIT_S)
        self.port = self._socket.getsockname()[1]

    def accept(self):
        return Peer(self._socket.accept()[0])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()


def timestamp(seconds):
    """Since 1970, with a binary fraction of 32 bits."""
    return round(seconds * 2**32)


def transform(device, T, valid, seconds):
    """A TRANSFORM with the status that PlusServer adds. Of a name above 20 characters the header has the beginning."""
    content = struct.pack(">12f", *T[:3].T.ravel())
    metadata = [("TransformStatus", "OK" if valid else "INVALID")]
    if len(device) > 20:
        metadata.append(("IGTL_DEVICE_NAME", device))
    return igtl_reader.encode(2, "TRANSFORM", device[:20], content, metadata, timestamp(seconds))


def tracking_data(tools, seconds):
    """A TDATA of name to matrix and validity, with the states that PlusServer adds by their whole names."""
    content = b"".join(struct.pack(">20sBB12f", name[:20].encode(), 1, 0, *T[:3].T.ravel()) for name, (T, _) in tools.items())
    metadata = [(name + "Status", "OK" if valid else "INVALID") for name, (_, valid) in tools.items()]
    return igtl_reader.encode(2, "TDATA", "TrackingData", content, metadata, timestamp(seconds))


def image(device, size, pixels, seconds):
    """A picture of 8-bit pixels, in its own frame."""
    dims = (*size, 1)
    content = igtl_reader.IMAGE.pack(1, 1, 3, 2, 1, *dims, *np.eye(3).ravel(), 0, 0, 0, 0, 0, 0, *dims)
    return igtl_reader.encode(2, "IMAGE", device, content + pixels, (), timestamp(seconds))


def surface(device, vertices, triangles):
    """A POLYDATA of triangles."""
    polygons = np.column_stack([np.full(len(triangles), 3), triangles]).astype(">u4").tobytes()
    counts = struct.pack(">10I", len(vertices), 0, 0, 0, 0, len(triangles), len(polygons), 0, 0, 0)
    return igtl_reader.encode(2, "POLYDATA", device, counts + vertices.astype(">f4").tobytes() + polygons)
