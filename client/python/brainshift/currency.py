# SPDX-License-Identifier: Apache-2.0
"""What a viewer knows of the daemon's session, and for how long.

Times are those of boot_time(), s, and are given by the caller. What an answer says holds from
the moment at which its request was SENT, so that no queue on the way makes a field look younger.
"""
from __future__ import annotations

import dataclasses
import time
from collections import OrderedDict
from typing import Optional

from .values import Currency, FieldStatus, SessionKey, SessionState, Update

_MOST_ASKED = 64


def boot_time() -> float:
    """A monotonic clock, s, that runs while the computer sleeps, as time.monotonic() does not on Linux."""
    if hasattr(time, "CLOCK_BOOTTIME"):
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()


class SessionWatch:
    def __init__(self) -> None:
        self.state: Optional[SessionState] = None  # last heard, by an answer or otherwise
        self.as_of: Optional[float] = None  # when the request was sent that was answered last
        self.model_id = ""  # that the viewer draws with; empty: none yet
        self._asked: OrderedDict[int, float] = OrderedDict()

    def asked(self, request_id: int, now: float) -> None:
        if len(self._asked) == _MOST_ASKED:
            self._asked.popitem(last=False)
        self._asked[request_id] = now

    def answered(self, request_id: int, state: SessionState) -> None:
        """Proves nothing when the request is not known."""
        if request_id not in self._asked:
            return
        self.as_of = self._asked[request_id]
        self.state = state
        while self._asked and next(iter(self._asked)) != request_id:  # answers come in order
            self._asked.popitem(last=False)
        self._asked.popitem(last=False)

    def refused(self, request_id: int) -> bool:
        return self._asked.pop(request_id, None) is not None

    def told(self, state: SessionState) -> None:
        """News that nobody asked for: no proof of time."""
        self.state = state

    def lost(self) -> None:
        """Requests that are under way get no answer."""
        self._asked.clear()

    def model_fits(self, model_id: str) -> bool:
        return self.model_id in ("", model_id)

    def judge(self, shown: Optional[Update], endpoint: str, now: float) -> FieldStatus:
        """Whether `shown`, the newest usable field that the viewer has, may be shown as current."""
        status = self._currency(shown, endpoint, now)
        return dataclasses.replace(status, recorded=self.state is not None and self.state.recorded)

    def _currency(self, shown: Optional[Update], endpoint: str, now: float) -> FieldStatus:
        if self.state is None or self.as_of is None:
            return FieldStatus(Currency.STALE, f"not subscribed to {endpoint}", None)
        state = self.state
        if not self.model_fits(state.session.model_id):
            return FieldStatus(
                Currency.NONE, f"{endpoint} serves model {state.session.model_id}, this viewer has loaded "
                f"{self.model_id}: load the model anew", None)
        if shown is None or shown.session != state.session:
            return FieldStatus(
                Currency.NONE, f"no usable field of the running session yet ({state.phase.name.lower()})", None)
        silent_s = now - self.as_of
        age_s = 1e-3 * state.age_ms + silent_s if shown.sequence == state.newest_usable else None
        if shown.sequence > state.newest_usable and shown.answer_time.ms > 0.0:  # the daemon's word is older
            age_s = 1e-3 * shown.answer_time.age_ms + now - shown.received_s
        if silent_s >= 1e-3 * state.valid_ms:
            return FieldStatus(Currency.STALE, f"no word from {endpoint} for {silent_s:.1f} s", age_s)
        if shown.sequence < state.newest_usable:
            return FieldStatus(Currency.SUPERSEDED, "a newer field is on its way", age_s)
        age_ms = 0.0 if age_s is None else 1e3 * age_s
        if 0 < state.expired_after_ms < age_ms:
            return FieldStatus(Currency.EXPIRED, _too_old(age_ms, state.expired_after_ms), age_s)
        if state.newest_update > shown.sequence:
            return FieldStatus(Currency.DEGRADED, state.reason, age_s)
        if 0 < state.aged_after_ms < age_ms:
            return FieldStatus(Currency.AGED, _too_old(age_ms, state.aged_after_ms), age_s)
        return FieldStatus(Currency.CURRENT, "", age_s)


def _too_old(age_ms: float, limit_ms: int) -> str:
    return f"its data are {1e-3 * age_ms:.1f} s old: {1e-3 * limit_ms:g} s at most"


class LatestUsable:
    """The newest usable update of the running session."""

    def __init__(self) -> None:
        self.session = SessionKey()
        self.update: Optional[Update] = None

    def begin(self, session: SessionKey) -> None:
        self.session, self.update = session, None

    def follow(self, session: SessionKey) -> None:
        if session != self.session:
            self.begin(session)

    def belongs(self, session: SessionKey) -> bool:
        if self.session == SessionKey() or session == self.session:
            return True
        return session.boot_id == self.session.boot_id and session.session_id > self.session.session_id

    def take(self, update: Update) -> None:
        if not self.belongs(update.session):
            return
        self.follow(update.session)
        if update.usable:
            self.update = update
