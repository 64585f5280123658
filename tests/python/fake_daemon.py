# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon of a few lines: answers by a script, in a thread of its own."""
import queue
import threading

import zmq

from brainshift import frame
from brainshift.frame import MessageType
from brainshift.v1 import brainshift_pb2 as pb

KEY = dict(boot_id=7, session_id=1, model_id="model")


def state(newest_update=0, newest_usable=0, **changes):
    fields = dict(phase=4, newest_update=newest_update, newest_usable=newest_usable, age_ms=1.0, valid_ms=1000)
    fields.update(changes)
    return pb.SessionState(session=pb.SessionKey(**{**KEY, **fields.pop("key", {})}), **fields).SerializeToString()


def update(sequence, quality=1, status="converged", **key):
    message = pb.Update(case_id="case", sequence=sequence, observation_sequence=sequence, method="condensed",
                        boundary="contact", final=True, status=status, quality=quality, **{**KEY, **key})
    message.quality_flags.extend({2: [5], 3: [19]}.get(quality, []))
    if status == "failed":
        message.error_code = "empty_set"
    else:
        message.displacement.xyz_mm.extend([float(sequence), 0.0, 0.0])
    return message.SerializeToString()


class FakeDaemon:
    """answers(request, daemon) -> list of (type, request id, payload) for every frame that arrives."""

    def __init__(self, answers):
        self.answers = answers
        self.requests = queue.Queue()  # frames, in order
        self.peer = None  # that spoke last; of the request that is being answered
        self._commands = queue.Queue()
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        self._socket.setsockopt(zmq.LINGER, 0)
        port = self._socket.bind_to_random_port("tcp://127.0.0.1")
        self.endpoint = f"tcp://127.0.0.1:{port}"
        self._bell_address = f"inproc://bell-{id(self)}"
        self._bell = self._context.socket(zmq.PAIR)
        self._bell.bind(self._bell_address)
        self._ringer = self._context.socket(zmq.PAIR)
        self._ringer.connect(self._bell_address)
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def push(self, kind, payload):
        """To the peer that spoke last."""
        self._commands.put(frame.encode(kind, 0, payload))
        self._ringer.send(b"")

    def push_bytes(self, *parts):
        self._commands.put(parts)
        self._ringer.send(b"")

    def _serve(self):
        poller = zmq.Poller()
        poller.register(self._socket, zmq.POLLIN)
        poller.register(self._bell, zmq.POLLIN)
        while True:
            ready = dict(poller.poll())
            if self._bell in ready:
                self._bell.recv()
                command = self._commands.get_nowait()
                if command is None:
                    return
                self._socket.send_multipart([self.peer, *(command if isinstance(command, tuple) else (command,))])
            if self._socket in ready:
                self.peer, message = self._socket.recv_multipart()
                request = frame.decode(message)
                self.requests.put(request)
                for kind, request_id, payload in self.answers(request):
                    self._socket.send_multipart([self.peer, frame.encode(kind, request_id, payload)])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._commands.put(None)
        self._ringer.send(b"")
        self._thread.join(timeout=10)
        for socket in (self._socket, self._bell, self._ringer):
            socket.close(linger=0)
        self._context.term()


class Script:
    """Answers subscriptions with a state that tests change, and what else they set."""

    def __init__(self):
        self.state = state()
        self.replies = {}

    def __call__(self, request):
        if request.type == MessageType.SUBSCRIBE_REQUEST:
            return [(MessageType.SESSION_STATE, request.request_id, self.state)]
        kind, payload = self.replies.get(request.type, (None, None))
        return [] if kind is None else [(kind, request.request_id, payload)]
