# SPDX-License-Identifier: Apache-2.0
"""How a program talks to brainshiftd. Mirrors client/lib, the C++ client; see there for the why."""
from __future__ import annotations

import dataclasses
import math
import time
from collections import deque
from typing import Callable, Deque, Iterator, Optional, TypeVar, Union

import zmq

from . import codec, frame
from .currency import LatestUsable, SessionWatch, boot_time
from .errors import Error, ProtocolError, Unavailable
from .frame import MessageType
from .keys import Keys
from .values import (Body, Choice, FieldStatus, Model, Observation, Receipt, Session, SessionKey, SessionState, Status,
                     Update)

_HEARTBEAT_MS = 1000
_RENEWAL_S = 0.25
_MOST_WINDOW = 256
_MOST_SECONDS = 6 * 24 * 3600.0
Value = TypeVar("Value")


@dataclasses.dataclass
class _Subscription:
    number: int
    window: int
    choice: Choice
    received: int = 0
    acknowledged: int = 0
    renewed: float = -math.inf


class Client:
    """A connection to a daemon. Use each from one thread.

    Currency. The top hazard is an old picture that looks current. field_status() says whether the
    field of latest_usable may be shown as current, and if not, why. next_update() and updates() keep
    the daemon's word fresh while they wait; call them at least once a second, or the field is stale.

    Calls raise Error: `code` to branch on, `message` to show. ValueError is for arguments that no
    daemon would take.
    """

    def __init__(self, endpoint: str, keys: Optional[Keys] = None, timeout_s: float = 5.0) -> None:
        """Does not wait for the daemon: the first request does. timeout_s: for every request but
        start_session, which may prepare a model. keys: see brainshift.read_keys."""
        if not 1e-3 <= timeout_s <= _MOST_SECONDS:
            raise ValueError(f"timeout_s = {timeout_s}: must be in [0.001, {_MOST_SECONDS:.0f}]")
        self.endpoint = endpoint
        self.timeout_s = timeout_s
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        options = {zmq.LINGER: 0, zmq.IMMEDIATE: 1, zmq.HEARTBEAT_IVL: _HEARTBEAT_MS,
                   zmq.HEARTBEAT_TIMEOUT: 3 * _HEARTBEAT_MS, zmq.HANDSHAKE_IVL: 5000, zmq.RECONNECT_IVL: 50,
                   zmq.RECONNECT_IVL_MAX: 1000, zmq.RCVHWM: 64, zmq.SNDHWM: 16,
                   zmq.MAXMSGSIZE: frame.HEADER_BYTES + frame.MAX_PAYLOAD_BYTES}
        try:
            for option, value in options.items():
                self._socket.setsockopt(option, value)
            if keys is not None:
                self._socket.curve_serverkey = keys.server_public_key.encode("ascii")
                self._socket.curve_publickey = keys.public_key.encode("ascii")
                self._socket.curve_secretkey = keys.secret_key.encode("ascii")
            self._socket.connect(endpoint)
        except (zmq.ZMQError, ValueError) as error:
            self.close()
            raise ValueError(f"endpoint {endpoint}: {error} (e.g. tcp://127.0.0.1:5555)") from None
        self._last_request = 0
        self._watch = SessionWatch()
        self._latest = LatestUsable()
        self._subscription: Optional[_Subscription] = None
        self._updates: Deque[Union[Update, ProtocolError]] = deque()  # an error in place of an update
        self._mesh_nodes = 0  # of the model that the viewer draws with; 0: not known
        self._sequences: dict[str, int] = {}
        self._case_id = ""
        self._own = SessionKey()  # of the session that this client started

    def close(self) -> None:
        self._socket.close(linger=0)
        self._context.term()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---------- requests ----------

    def status(self) -> Status:
        """The daemon always answers it."""
        return self._ask(MessageType.STATUS_REQUEST, b"", MessageType.STATUS_REPLY, codec.status)

    def start_session(self, case_id: Optional[str] = None, method: str = "condensed", boundary: str = "contact", *,
                      publish_iterates: bool = False, takeover: bool = False, recorded_clock: bool = False, timeout_s: float = 600.0) -> Session:
        """Starts a session for all clients and ends the running one. Returns when it is prepared.

        case_id: of the daemon's case; None: whatever case it serves. takeover: end a session that
        another connected client started. recorded_clock: for a replay, which may run faster than the
        recording. Errors: "invalid_argument" (another case), "model_not_ready", "not_allowed",
        "unavailable".
        """
        if case_id is None:
            case_id = self.status().case_id
        payload = codec.start_session(case_id, method, boundary, publish_iterates, takeover, recorded_clock)
        session = self._ask(MessageType.START_SESSION_REQUEST, payload, MessageType.START_SESSION_REPLY,
                            codec.session, timeout_s)
        self._case_id, self._own = case_id, session.key
        self._sequences.clear()
        self._latest.begin(session.key)
        self._watch.model_id, self._mesh_nodes = session.key.model_id, session.nodes
        return session

    def model(self) -> Model:
        """The undeformed mesh, its surfaces and node sets: some MiB."""
        model = self._ask(MessageType.MODEL_REQUEST, b"", MessageType.MODEL_REPLY, codec.model)
        self._watch.model_id, self._mesh_nodes = model.model_id, len(model.nodes)
        return model

    def submit(self, body: Body, source: str, *, sequence: Optional[int] = None, acquired_ns: Optional[int] = None,
               acquired_wall_ns: int = 0) -> Receipt:
        """Hands a measurement over; returns when the daemon has accepted it, before it is inverted.

        source: the instrument, e.g. "ius". sequence: counts up per source; None: the next one of
        this client. acquired_ns: by time.monotonic_ns(); None: now.
        """
        if not self._case_id:
            self._case_id = self.status().case_id
        if sequence is None:
            sequence = self._sequences.get(source, 0) + 1
        now = time.monotonic_ns()
        observation = Observation(self._case_id, source, sequence, body, now if acquired_ns is None else acquired_ns,
                                  acquired_wall_ns, SessionKey(), now)
        return self.submit_observation(observation)

    def submit_observation(self, observation: Observation) -> Receipt:
        """The same for one that is complete, e.g. of a recording; without a session it is for the one
        that this client started, or for the one that it watches if it started none. Error
        "unavailable": the session that it started has ended, by what it has been told; nothing is sent."""
        if observation.session == SessionKey():
            self._check_own_session()
            session = self._latest.session if self._own == SessionKey() else self._own
            observation = dataclasses.replace(observation, session=session)
        receipt = self._ask(MessageType.OBSERVATION, codec.observation(observation), MessageType.OBSERVATION_REPLY,
                            codec.receipt)
        known = self._sequences.get(observation.source, 0)
        self._sequences[observation.source] = max(known, observation.sequence)
        return receipt

    def _check_own_session(self) -> None:
        own, runs = self._own, self._latest.session
        if own == SessionKey() or runs in (own, SessionKey()):
            return
        why = ("the daemon has been restarted" if runs.boot_id != own.boot_id else
               f"another client has started session {runs.session_id}" if runs.session_id else "none runs now")
        raise Error("unavailable", f"session {own.session_id} has ended: {why}")

    def subscribe(self, window: int = 1, choice: Choice = Choice()) -> SessionState:
        """From now on the daemon pushes updates to this client; the newest usable one comes at once.

        window: updates that may be under way at once. 1 is for a viewer: whenever it asks it gets
        the newest, and what it missed is replaced. More is for one that wants every update.
        """
        if not 1 <= window <= _MOST_WINDOW:
            raise ValueError(f"window = {window}: must be in [1, {_MOST_WINDOW}]")
        before = self._subscription
        self._subscription = _Subscription(1 if before is None else before.number + 1, window, choice)
        now = time.monotonic()
        self._subscription.renewed = now
        self._watch.asked(self._last_request + 1, boot_time())
        try:
            return self._ask(MessageType.SUBSCRIBE_REQUEST, self._subscription_payload(), MessageType.SESSION_STATE,
                             codec.session_state)
        except Unavailable:
            raise
        except Error:
            self._subscription = before  # the daemon goes on with the one before
            raise

    # ---------- updates ----------

    def next_update(self, timeout_s: float) -> Update:
        """The next update in order of arrival: an iterate, a final one of any quality, or a failure
        (Update.failed). Only Update.usable ones may be shown. Unavailable when none arrives in time;
        ProtocolError for one that contradicts itself or the mesh.

        With a window of 1, one that had to wait here is first confirmed to be the newest.
        """
        deadline = time.monotonic() + timeout_s
        if self._subscription is not None and self._subscription.window == 1:
            while self._socket.poll(0):
                self._receive_push(time.monotonic())
            if self._updates:
                self._confirm(deadline)
        while True:
            while self._updates:
                update = self._updates.popleft()
                if isinstance(update, ProtocolError):
                    raise update
                if self._latest.belongs(update.session):  # else its session has ended while it waited
                    self._latest.take(update)
                    return update
            now = time.monotonic()
            until = deadline
            if self._subscription is not None:
                if self._renewal_due() <= now:
                    self._renew()
                until = min(deadline, self._renewal_due())
            if not self._receive_push(until) and time.monotonic() >= deadline:
                raise Unavailable(f"no update from {self.endpoint} within {timeout_s:g} s")

    def updates(self, timeout_s: float) -> Iterator[Update]:
        """next_update() again and again; ends when none arrives for timeout_s."""
        while True:
            try:
                yield self.next_update(timeout_s)
            except Unavailable:
                return

    @property
    def latest_usable(self) -> Optional[Update]:
        """The newest usable update of the running session that next_update() has returned. Neither
        failures and unusable updates nor a lost connection replace it; another session does."""
        return self._latest.update

    def field_status(self) -> FieldStatus:
        """Whether latest_usable may be shown as current, now."""
        return self._watch.judge(self._latest.update, self.endpoint, boot_time())

    @property
    def session_state(self) -> Optional[SessionState]:
        """What the daemon last said of its session; None before subscribe()."""
        return self._watch.state

    # ---------- inside ----------

    def _ask(self, kind: MessageType, payload: bytes, reply: MessageType, decode: Callable[[bytes], Value],
             timeout_s: Optional[float] = None) -> Value:
        limit_s = self.timeout_s if timeout_s is None else timeout_s
        deadline = time.monotonic() + limit_s
        self._last_request += 1
        own = self._last_request
        if not self._socket.poll(max(0, math.ceil(1e3 * limit_s)), zmq.POLLOUT):
            raise Unavailable(f"no daemon at {self.endpoint}")
        self._socket.send(frame.encode(kind, own, payload), zmq.NOBLOCK)
        while True:
            message = self._receive(deadline)
            if message is None:
                raise Unavailable(f"no answer from {self.endpoint} within {limit_s:g} s")
            self._take_push(message)
            complaint = message.type == MessageType.ERROR_REPLY and message.request_id == 0
            if message.request_id != own and not complaint:
                continue  # pushed, or late
            if message.type == MessageType.ERROR_REPLY:
                raise codec.error(message.payload)
            if message.type != reply:
                raise ProtocolError(f"{self.endpoint}: a reply of type {message.type.name}, must be {reply.name}")
            return decode(message.payload)

    def _receive(self, deadline: float) -> Optional[frame.Frame]:
        left_ms = max(0, math.ceil(1e3 * (deadline - time.monotonic())))
        if not self._socket.poll(left_ms):
            return None
        parts = self._socket.recv_multipart(zmq.NOBLOCK)
        if len(parts) != 1:
            raise ProtocolError(f"{self.endpoint} sent a multipart message")
        return frame.decode(parts[0])

    def _take_push(self, message: frame.Frame) -> None:
        if message.type == MessageType.SESSION_STATE:
            state = codec.session_state(message.payload)
            if message.request_id == 0:
                self._watch.told(state)
            else:
                self._watch.answered(message.request_id, state)
            self._latest.follow(state.session)
        elif message.type == MessageType.UPDATE:
            if self._subscription is not None:
                self._subscription.received += 1
            try:
                update = codec.update(message.payload)
                if not self._latest.belongs(update.session) or not self._watch.model_fits(update.session.model_id):
                    return
                codec.check_mesh(update, self._mesh_nodes)
                self._updates.append(dataclasses.replace(update, received_s=boot_time()))
            except ProtocolError as error:
                self._updates.append(error)  # next_update() raises it, no other call

    def _receive_push(self, deadline: float) -> bool:
        message = self._receive(deadline)
        if message is None:
            return False
        if message.type == MessageType.ERROR_REPLY and self._watch.refused(message.request_id):
            raise codec.error(message.payload)  # it refuses to renew: of another model the choice may be empty
        self._take_push(message)
        return True

    def _subscription_payload(self) -> bytes:
        assert self._subscription is not None
        own = self._subscription
        return codec.subscribe(own.number, own.window, own.received, own.choice)

    def _renewal_due(self) -> float:
        assert self._subscription is not None
        own = self._subscription
        if own.received - own.acknowledged >= max(1, own.window // 2):
            return own.renewed
        return own.renewed + _RENEWAL_S

    def _renew(self) -> None:
        """Tells the daemon what was received and asks what is current; waits for nothing."""
        assert self._subscription is not None
        now = time.monotonic()
        self._last_request += 1
        self._subscription.renewed = now
        self._subscription.acknowledged = self._subscription.received
        message = frame.encode(MessageType.SUBSCRIBE_REQUEST, self._last_request, self._subscription_payload())
        try:
            self._socket.send(message, zmq.NOBLOCK)
        except zmq.Again:
            # No connection: what was under way is lost. The daemon, or the next one, is to begin anew.
            self._watch.lost()
            self._subscription.number += 1
            self._subscription.received = self._subscription.acknowledged = 0
            return
        self._watch.asked(self._last_request, boot_time())

    def _confirm(self, deadline: float) -> None:
        """Drops what is outdated by now, once the daemon has said what is newest."""
        assert self._subscription is not None
        asked, begun = boot_time(), time.monotonic()
        while self._watch.as_of is None or self._watch.as_of < asked:
            if self._renewal_due() <= time.monotonic() or self._subscription.renewed < begun:
                self._renew()
            if not self._receive_push(min(deadline, self._renewal_due())) and time.monotonic() >= deadline:
                raise Unavailable(f"no answer from {self.endpoint} in time")
        state = self._watch.state
        assert state is not None
        self._updates = deque(
            u for u in self._updates
            if isinstance(u, ProtocolError) or u.session == state.session and
            u.sequence >= (state.newest_usable if u.usable else state.newest_update))


def connect(endpoint: str = "tcp://127.0.0.1:5555", keys: Optional[Keys] = None, timeout_s: float = 5.0) -> Client:
    """A Client, for `with brainshift.connect(...) as client:`."""
    return Client(endpoint, keys, timeout_s)
