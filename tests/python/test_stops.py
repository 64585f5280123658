# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon, a bridge and a viewer that are stopped (SIGSTOP) for a while and go on: nobody dies, and nobody calls a field
current that is older than the limit.

BRAINSHIFT_STOPS_S: how long, s, each in turn; with BRAINSHIFT_STUDY_DIR the counts are recorded for `make faults`.
"""
import json
import os
import signal
import threading
import time

import igtl_reader
import pytest
from conftest import Daemon, record
from displays import Displays

import brainshift
from BrainshiftLib.label import parse_state

STOPS_S = [float(text) for text in os.environ.get("BRAINSHIFT_STOPS_S", "1").split()]
AGED_S = 0.8
SLACK_S = 0.25  # from when a word is written until it is read and compared, on a busy machine


class Source(threading.Thread):
    """Observes five times a second, while `observes`; knows when the data of every update were acquired."""

    def __init__(self, endpoint, body):
        super().__init__(daemon=True)
        self.endpoint, self.body = endpoint, body
        self.acquired, self.observes, self.ends = {}, True, False

    def run(self):
        with brainshift.connect(self.endpoint, timeout_s=1.0) as client:
            client.start_session(takeover=True)
            client.subscribe(window=16)
            at = {}
            while not self.ends:
                began = time.monotonic()
                try:
                    if self.observes:
                        at[client.submit(self.body, "source", acquired_ns=int(began * 1e9)).observation_sequence] = began
                    update = client.next_update(0.15)
                    self.acquired[update.sequence] = at.get(update.observation_sequence, began)
                except brainshift.Error:
                    pass
                time.sleep(max(0.0, 0.2 - (time.monotonic() - began)))


class Claims:
    """Everything that was called current, by whom, of which update, when it was read, and how old it was said to be."""

    def __init__(self, displays):
        self.displays, self.all, self.seen = displays, [], {"json": 0, "bridge": None}

    def look(self):
        displays, now = self.displays, time.monotonic()
        lines = displays.programs["json"].lines
        for line in lines[self.seen["json"]:]:
            spoken = json.loads(line) if line.startswith("{") else {}
            if spoken.get("currency") == "current" and spoken.get("sequence"):
                self.all.append(("watch", spoken["sequence"], now, spoken["age_s"]))
        self.seen["json"] = len(lines)
        message = displays.messages.get(("brainshift_state", "STRING"))
        if message is not None and message is not self.seen["bridge"]:
            self.seen["bridge"] = message
            state = parse_state(igtl_reader.string_of(message))
            if state.currency == "current":
                self.all.append(("bridge", state.sequence, now, 1e-3 * state.age_ms))
        displays.pump()
        status = displays.client.field_status()
        if status.currency is brainshift.Currency.CURRENT:
            self.all.append(("client", displays.client.latest_usable.sequence, time.monotonic(), status.age_s))

    def look_for(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.look()

    def all_are_current(self, limit_s=30.0):
        """Waits until each of the three has called a new update current."""
        before, end = len(self.all), time.monotonic() + limit_s
        while {who for who, *_ in self.all[before:]} != {"watch", "bridge", "client"}:
            assert time.monotonic() < end, f"current: {({who for who, *_ in self.all[before:]})}"
            self.look()


@pytest.fixture
def place(tmp_path, head):
    limits = f"age: {{aged_after_s: {AGED_S}, expired_after_s: {5 * AGED_S}}}\n"
    with brainshift.Surgery(head / "joint.surgery") as surgery:
        body = next(one.body for one in surgery.observations() if isinstance(one.body, brainshift.TumourBoundary))
    with Daemon(tmp_path, head / "model.h5", limits) as daemon:
        source = Source(daemon.endpoint, body)
        source.start()
        while not source.acquired:
            time.sleep(0.01)
        displays = Displays(daemon.endpoint, programs=("json", "bridge"), spacing="8mm")
        yield daemon, source, displays
        source.ends = True
        source.join()
        displays.end()


def test_whoever_was_stopped_goes_on_and_calls_nothing_old_current(place):
    daemon, source, displays = place
    claims = Claims(displays)
    claims.all_are_current()
    processes = {"daemon": daemon.process, "bridge": displays.programs["bridge"].process, "watch": displays.programs["json"].process}
    for seconds in STOPS_S:
        for process in processes.values():
            process.send_signal(signal.SIGSTOP)
            # What a stopped daemon has is as old as the stop is long once it goes on.
            source.observes = process is not daemon.process
            claims.look_for(seconds)
            process.send_signal(signal.SIGCONT)
            claims.look_for(0.5)
            source.observes = True
            claims.all_are_current()
    deaths = sum(process.poll() is not None for process in processes.values())
    ages = [(read - source.acquired[sequence], who, said) for who, sequence, read, said in claims.all if sequence in source.acquired]
    old = [one for one in ages if one[0] > AGED_S + SLACK_S]
    younger = [one for one in ages if one[2] is not None and one[2] < one[0] - SLACK_S]
    record("stops", "stops of daemon and bridge and viewer", 3 * len(STOPS_S), "shown", None)
    record("stops", "longest stop s", max(STOPS_S), "shown", None)
    record("stops", "deaths", deaths, "= 0", deaths == 0)
    record("stops", "times that a field was called current", len(ages), "shown", None)
    record("stops", "of them older than the limit", len(old), "= 0", not old)
    record("stops", "of them said to be younger than they were", len(younger), "= 0", not younger)
    assert deaths == 0 and not old and not younger, (deaths, old[:5], younger[:5])
