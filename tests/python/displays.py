# SPDX-License-Identifier: GPL-3.0-or-later
"""A scripted daemon, and eight displays of what it says: `brainshift watch` (as text and as JSON: the C++ client), top, status,
bridge, the Python client, and the core of the Slicer module behind the bridge."""
import json
import re
import subprocess
import threading
import time

import igtl_reader
import slicer_paths  # first: it finds BrainshiftLib
from conftest import PROGRAMS, golden
from fake_daemon import FakeDaemon

import brainshift
from brainshift import frame
from brainshift.frame import MessageType
from brainshift.v1 import brainshift_pb2 as pb, operations_pb2 as ops
from BrainshiftLib.label import Light, may_be_shown, parse_metadata, parse_state

assert slicer_paths.MODULE.is_dir()
MODEL, OTHER = "fedcba9876543210", "0123456789abcdef"
GOOD, CAUTION, UNUSABLE = 1, 2, 3
TRACKING, DEGRADED = 4, 5
# What a daemon says in each state, the quality of its newest update, and what a display must say then.
STATES = {
    "aged": (dict(age_ms=40e3), GOOD, r"aged"),
    "foreign": (dict(key=dict(boot_id=8, session_id=2, model_id=OTHER)), GOOD, OTHER),
    "recorded": (dict(recorded=True), GOOD, r"recorded(?!\W+(false|None))"),
    "provisional": ({}, CAUTION, r"caution|time ran out"),
    "unusable": (dict(phase=DEGRADED, reason="update is unusable: beyond the skull"), UNUSABLE, r"unusable|degraded|skull"),
    "silent": (None, GOOD, r"stale|no answer|not answer|no word|nothing was heard"),
}
DISPLAYS = ("session_state", "cpp_client", "python_client", "watch", "top", "status", "bridge", "slicer")
# They speak of daemon and session, whose fields bring their own verdict: that one is caution is not theirs to tell.
NOT_TOLD = {(display, "provisional") for display in ("session_state", "top", "status")}
# They follow whatever daemon there is, and name the model of what they show; a viewer knows its own.
FOLLOWING = {(display, "foreign") for display in ("top", "status", "bridge")}
CHANGE_S, LOOK_S = 10.0, 0.3


class Script:
    """Answers of a daemon in the present state to any number of clients."""

    def __init__(self):
        self.daemon, self.sent = None, {}
        self.usable = self.newest = 0
        self.set("fresh")

    def set(self, name, key=None):
        changes, quality, _ = STATES.get(name, ({}, GOOD, ""))
        self.quiet = changes is None
        changes = dict(changes or {})
        self.key = key or dict(boot_id=7, session_id=1, model_id=MODEL) | changes.pop("key", {})
        self.newest += 1
        self.quality = quality
        if quality != UNUSABLE:
            self.usable = self.newest
        fields = dict(phase=TRACKING, age_ms=100.0, valid_ms=1000, aged_after_ms=30000, expired_after_ms=120000,
                      method="condensed", boundary="contact") | changes
        self.state = pb.SessionState(session=pb.SessionKey(**self.key), newest_update=self.newest,
                                     newest_usable=self.usable, **fields)

    def update(self):
        message = pb.Update(case_id="one-tetrahedron", sequence=self.newest, observation_sequence=self.newest,
                            method="condensed", boundary="contact", final=True, status="converged", quality=self.quality,
                            quality_reason={GOOD: "", CAUTION: "the time ran out", UNUSABLE: "beyond the skull"}[self.quality],
                            answer_time=pb.AnswerTime(ms=30.0, usual_ms=30.0, age_ms=self.state.age_ms), **self.key)
        message.quality_flags.extend({CAUTION: [5], UNUSABLE: [19]}.get(self.quality, []))
        message.displacement.xyz_mm.extend([0.5] * 12)
        return message.SerializeToString()

    def __call__(self, request):
        if self.quiet:
            return []
        answer = {
            MessageType.STATUS_REQUEST: lambda: (MessageType.STATUS_REPLY, pb.StatusReply(
                version="1", model_ready=True, case_id="one-tetrahedron", model_id=self.key["model_id"])),
            MessageType.MODEL_REQUEST: lambda: (MessageType.MODEL_REPLY, self.model()),
            MessageType.REPORT_REQUEST: lambda: (MessageType.REPORT_REPLY, ops.DaemonReport(
                version="1", model_ready=True, case_id="one-tetrahedron", session=self.state, max_age_s=5.0, limit_ms=1000.0,
                usable=self.usable)),
            MessageType.SUBSCRIBE_REQUEST: lambda: (MessageType.SESSION_STATE, self.state)}[MessageType(request.type)]()
        replies = [(answer[0], request.request_id, answer[1].SerializeToString())]
        if request.type == MessageType.SUBSCRIBE_REQUEST:
            # Once to each client, as its credit allows.
            subscription = pb.SubscribeRequest.FromString(request.payload).subscription
            stamp = (subscription, self.newest)
            if self.sent.get(self.daemon.peer) != stamp:
                self.sent[self.daemon.peer] = stamp
                replies.append((MessageType.UPDATE, 0, self.update()))
        return replies

    def model(self):
        reply = pb.ModelReply.FromString(frame.decode(golden("model_reply")[0]).payload)
        reply.model_id = self.key["model_id"]
        return reply


class Lines:
    """A program whose newest lines count."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([PROGRAMS / "brainshift", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                        text=True)
        self.lines = [""]
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))

    def until(self, pattern):
        deadline = time.monotonic() + CHANGE_S
        while time.monotonic() < deadline:
            for line in self.lines:
                if found := re.search(pattern, line):
                    return found
            time.sleep(0.01)
        raise AssertionError(self.lines)

    def end(self):
        self.process.terminate()
        self.process.wait(timeout=30)


class Displays:
    """What each says now: (looks like a good current field, its words)."""

    def __init__(self, endpoint, programs=("watch", "json", "top", "bridge"), model=MODEL, spacing="1mm"):
        self.endpoint, self.model = endpoint, model
        arguments = {"watch": ("watch", ), "json": ("watch", "--json"), "top": ("top", "--interval", "0.1"),
                     "bridge": ("bridge", "--listen", "127.0.0.1:0", "--region", "brain", "--spacing", spacing, "--margin", "5mm")}
        self.programs = {name: Lines(*arguments[name], "--endpoint", endpoint) for name in programs}
        port = int(self.programs["bridge"].until(r"127\.0\.0\.1:(\d+)").group(1))
        self.reader = igtl_reader.Reader(("127.0.0.1", port))
        self.client = None
        if "json" in programs:
            self.client = brainshift.connect(endpoint, timeout_s=0.2)
            self.client.model()
            self.client.subscribe()
        self.messages, self.heard, self.fields = {}, 0.0, []
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        try:
            while (message := self.reader.next(3600.0)) is not None:
                self.messages[message.device, message.type] = message
                # Until the bridge has read this peer's version it sends version 1, which has no label: no display shows that.
                if message.device == "brainshift_u" and (label := parse_metadata(message.attribute)) is not None:
                    self.fields.append(label)
                if message.device == "brainshift_state":
                    self.heard = time.monotonic()
        except (OSError, igtl_reader.ProtocolError):
            pass

    def end(self):
        if self.client is not None:
            self.client.close()
        for program in self.programs.values():
            program.end()

    def watch(self):
        line = self.programs["watch"].lines[-1]
        return "current" in line and "good" in line and "RECORDED" not in line, line

    def cpp_client(self):
        spoken = [json.loads(line) for line in self.programs["json"].lines if line.startswith("{")]
        if not spoken:
            return False, ""
        quality = next((line["quality"] for line in reversed(spoken) if line.get("quality")), "")
        last = spoken[-1]
        words = {key: last[key] for key in ("currency", "reason", "recorded")} | {"quality": quality}
        return last["currency"] == "current" and quality == "good" and not last["recorded"], json.dumps(words)

    def pump(self):
        try:
            self.client.next_update(0.05)
        except brainshift.Error:
            pass

    def python_client(self):
        self.pump()
        status, usable = self.client.field_status(), self.client.latest_usable
        words = f"{status.currency.value} {status.reason} {'recorded' if status.recorded else ''}"
        if usable is not None:
            words += f" {usable.quality.name.lower()}"
        good = status.currency == brainshift.Currency.CURRENT and usable.quality is brainshift.Quality.GOOD
        return good and not status.recorded, words

    def top(self):
        line = self.programs["top"].lines[-1]
        return bool(line) and not re.search(r"ATTENTION|AGED|EXPIRED|STALE|RECORDED", line), line

    def status(self):
        done = subprocess.run([PROGRAMS / "brainshift", "status", "--endpoint", self.endpoint], capture_output=True, text=True,
                              timeout=60)
        return done.returncode == 0 and "RECORDED" not in done.stdout, done.stdout + done.stderr

    def session_state(self):
        """As the Python client hands it out."""
        self.pump()
        state = self.client.session_state
        fresh = state.age_ms <= state.aged_after_ms and state.newest_update == state.newest_usable
        of_it = state.session.model_id == MODEL  # which this client has loaded
        return fresh and of_it and not state.recorded and self.client.field_status().currency != brainshift.Currency.STALE, (
            f"{state} {'aged' if state.age_ms > state.aged_after_ms else ''} {self.client.field_status().reason}")

    def bridge(self):
        code, words = igtl_reader.status_of(self.messages["brainshift", "STATUS"])
        return code == 1 and not words, words + igtl_reader.string_of(self.messages["brainshift_state", "STRING"])

    def field(self):
        """The label of the newest volume of displacements."""
        return parse_metadata(self.messages["brainshift_u", "IMAGE"].attribute)

    def slicer(self):
        state = parse_state(igtl_reader.string_of(self.messages["brainshift_state", "STRING"]))
        verdict = may_be_shown(self.field(), state, self.model, time.monotonic() - self.heard, 3.0, 0.0)
        return verdict.light is Light.GREEN, f"{verdict.light.value} {verdict.reason} {state.quality}"


def waited_for(display, wanted):
    """Its words once it says what is wanted, or what it says in the end; and whether it does."""
    deadline = time.monotonic() + CHANGE_S
    while True:
        try:
            green, words = display()
        except KeyError:  # nothing has come yet
            green, words = False, ""
        if wanted(green, words) or time.monotonic() > deadline:
            return wanted(green, words), words
        time.sleep(0.02)
