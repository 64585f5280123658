# SPDX-License-Identifier: GPL-3.0-or-later
"""measure_view.py CASE OUT: what the page of `brainshift view` costs and shows, in Chromium beside a daemon on this machine.

Plays the observations of a simulated surgery again and again: without a page, with one, with sixteen (one in Chromium, the
others readers of the same events and fields), in turns, so that what else the machine does meets all alike. OUT gets
rows-updates.csv (a row per update), checks.csv, tables.md, summary.json. docs/view.md says what the figures mean.
"""
import argparse
import dataclasses
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from chromium import Chromium  # noqa: E402
from conftest import Daemon, run  # noqa: E402
from studies.checks import Record, summarise  # noqa: E402
from test_view import LIVE, View  # noqa: E402

import brainshift  # noqa: E402

STUDY, VIEWERS = "view", 16
PERIOD_S = 0.5  # of the updates


class Reader(threading.Thread):
    """A page without a picture: hears the events, and fetches every field that they name."""

    def __init__(self, url):
        super().__init__(daemon=True)
        self.url, self.fields = url, 0
        self.start()

    def run(self):
        shown = ""
        with urllib.request.urlopen(self.url + "events", timeout=30) as events:
            for line in events:
                field = json.loads(line[6:])["field"] if line.startswith(b"data: ") else ""
                if field and field != shown:
                    shown = field
                    urllib.request.urlopen(self.url + "field", timeout=30).read()
                    self.fields += 1


def read(url, count):
    """What --read does: so many readers until the input ends, then the fewest fields that one fetched."""
    readers = [Reader(url) for _ in range(count)]
    sys.stdin.read()
    print(min(reader.fields for reader in readers))
    sys.stdout.flush()
    os._exit(0)


class Surgery:
    """The observations of a recording, over and over with new numbers."""

    def __init__(self, client, recording):
        with brainshift.Surgery(recording) as recorded:
            self.observations = list(recorded.observations())
        self.client, self.turn, self.due = client, 0, 0.0

    def update(self):
        """The next update, PERIOD_S after the one before, with the seconds that it took."""
        time.sleep(max(0.0, self.due - time.monotonic()))
        self.due = time.monotonic() + PERIOD_S
        cycle, i = divmod(self.turn, len(self.observations))
        self.turn += 1
        one = self.observations[i]
        most = max(each.sequence for each in self.observations)
        begin = time.monotonic()
        self.client.submit_observation(dataclasses.replace(one, sequence=one.sequence + cycle * most,
                                                           acquired_ns=one.acquired_ns + cycle * 10**12))
        update = self.client.next_update(timeout_s=60)
        return update, time.monotonic() - begin, time.time()


def drawn_ms(browser, update, received):
    """Until the page has drawn the field, ms."""
    of = f"{update.session.boot_id}.{update.session.session_id}.{update.sequence}"
    browser.wait(f"document.body.dataset.drawn?.startsWith('{of} ')", 20)
    return float(browser.js("document.body.dataset.drawn").split()[1]) - 1e3 * received


def first_again_ms(browser):
    """From a page that is opened anew to its first slices: the program has the model by now."""
    opened = browser.js("performance.timeOrigin")
    browser.call("Page.reload")
    browser.wait(f"performance.timeOrigin > {opened} && document.body?.dataset.drawn")
    return browser.js("Number(document.body.dataset.drawn.split(' ')[1]) - performance.timeOrigin")


def cursor_errors(browser, model, update):
    """Of |u| at places that the page prints, against the mesh; and what the page says the error is at most."""
    field = brainshift.Field(brainshift.FieldMesh(model), update)
    box = browser.js("(() => { const b = document.getElementById('axial').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()")
    errors, stated = [], None
    for across in np.linspace(0.25, 0.75, 9):
        for up in np.linspace(0.2, 0.8, 9):
            browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=box[0] + across * box[2], y=box[1] + up * box[3])
            told = re.search(r"in the MRI: R (\S+), A (\S+), S (\S+) · moved (\S+) ±.* within (\S+) mm", browser.text("cursor"))
            if not told:
                continue
            *place, moved, stated = (float(part.rstrip(",")) for part in told.groups())
            there = field.at([place]).displacement_mm[0]
            if np.isfinite(there).all():
                errors.append(abs(moved - np.linalg.norm(there)))
    return np.array(errors), stated


def heap_mb(browser):
    """What the page's scripts hold, after a collection."""
    browser.call("HeapProfiler.collectGarbage")
    used = browser.call("Runtime.getHeapUsage")
    return (used["usedSize"] + used.get("embedderHeapUsedSize", 0.0) + used.get("backingStorageSize", 0.0)) / 1e6


def resident_mb(process):
    pages = int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def grow(options, surgery, endpoint, model_file, folder, record):
    """A page that stays open, with an update every PERIOD_S: the slope of what page and program hold, times the time. The page keeps
    300 updates for its strips, so the time until then does not count."""
    rows = ["s,page_mb,program_mb"]
    with View(endpoint, "--model", model_file) as view, Chromium(folder / "chromium-growth", view.url) as browser:
        browser.wait(LIVE)
        begin, samples = time.monotonic(), []
        while time.monotonic() - begin < options.growth_s:
            for _ in range(10):
                surgery.update()
            samples.append((time.monotonic() - begin, heap_mb(browser), resident_mb(view.process)))
            rows.append(",".join(f"{value:.3f}" for value in samples[-1]))
        browser.wait(LIVE)
        complaints = len(browser.complaints)
        for one in browser.complaints:
            print(f"view: the browser complained: {json.dumps(one)[:400]}", file=sys.stderr)
    (options.out / "rows-growth.csv").write_text("\n".join(rows) + "\n")
    kept = np.array([one for one in samples if one[0] > max(options.growth_s / 3, 1.2 * 300 * PERIOD_S)])
    for column, name in ((1, "page"), (2, "program")):
        slope = np.polyfit(kept[:, 0], kept[:, column], 1)[0] if len(kept) > 2 else float("nan")
        value = slope * options.growth_s
        record.check(STUDY, f"growth of the {name} in {options.growth_s:.0f} s", value, "<= 2 MB", bool(value <= 2.0))
    record.figure(STUDY, "updates meanwhile", 10 * len(samples), "")
    record.check(STUDY, "what the browser complained of", complaints, "= 0", complaints == 0)


def percentiles(values):
    return float(np.percentile(values, 50)), float(np.percentile(values, 99))


def measure(options, record):
    folder = pathlib.Path(tempfile.mkdtemp(prefix="brainshift-"))
    model_file, recording = options.model or folder / "model.h5", folder / "joint.surgery"
    if options.model is None:
        run("brainshiftd", "prepare", "--case", options.case, "--out", model_file)
    run("brainshift", "simulate", "--case", options.case, "--scenario", "joint-sag", "--seed", "1", "--out", recording)
    rows = ["pages,update,answer_ms,drawn_ms"]
    heard = []
    answers, drawn = {0: [], 1: [], VIEWERS: []}, {1: [], VIEWERS: []}
    with Daemon(folder, model_file, "age: { aged_after_s: 600, expired_after_s: 1200 }\n") as daemon, \
            brainshift.connect(daemon.endpoint, timeout_s=60) as client:
        client.start_session(recorded_clock=True)
        client.subscribe(window=16)
        model, surgery = client.model(), Surgery(client, recording)
        for _ in range(5):
            update = surgery.update()[0]
        for turn in range(options.turns):
            for pages in (0, 1, VIEWERS):
                if pages == 0:
                    for _ in range(options.updates):
                        update, took, _ = surgery.update()
                        answers[0].append(1e3 * took)
                        rows.append(f"0,{update.sequence},{1e3 * took:.3f},")
                    continue
                with View(daemon.endpoint, "--model", model_file) as view, \
                        Chromium(folder / f"chromium-{turn}-{pages}", view.url) as browser:
                    browser.wait(LIVE)
                    readers = subprocess.Popen([sys.executable, __file__, "--read", view.url, str(pages - 1)], text=True,
                                               stdin=subprocess.PIPE, stdout=subprocess.PIPE) if pages > 1 else None
                    time.sleep(2.0 if readers else 0.0)  # until they have begun
                    browser.wait("document.body.dataset.drawn")
                    first_ms = browser.js("Number(document.body.dataset.drawn.split(' ')[1]) - performance.timeOrigin")
                    for _ in range(options.updates):
                        update, took, received = surgery.update()
                        answers[pages].append(1e3 * took)
                        drawn[pages].append(drawn_ms(browser, update, received))
                        rows.append(f"{pages},{update.sequence},{1e3 * took:.3f},{drawn[pages][-1]:.0f}")
                    if pages == 1 and turn == 0:
                        weight = browser.js("performance.getEntriesByType('resource').filter(e => !/events$/.test(e.name))"
                                            ".filter((e, i, all) => all.findIndex(o => o.name === e.name) === i)"
                                            ".reduce((sum, e) => sum + e.decodedBodySize, 0)")
                        assets = browser.js("performance.getEntriesByType('resource').filter(e => /[.](js|css)$/.test(e.name))"
                                            ".reduce((sum, e) => sum + e.decodedBodySize, 0)")
                        errors, stated = cursor_errors(browser, model, update)
                        one = first_ms, weight, assets, first_again_ms(browser)
                    if readers:
                        heard.append(int(readers.communicate()[0]))
        if options.growth_s > 0:
            grow(options, surgery, daemon.endpoint, model_file, folder, record)
    if options.turns == 0:
        return
    (options.out / "rows-updates.csv").write_text("\n".join(rows) + "\n")
    check = lambda name, value, bound, unit: record.check(STUDY, name, value, f"<= {bound} {unit}".strip(), value <= bound)
    p50, p99 = percentiles(drawn[1])
    check("update received to drawn p50", p50, 150, "ms")
    check("update received to drawn p99", p99, 400, "ms")
    for pages, bound in ((1, 1.05), (VIEWERS, 1.2)):
        check(f"p99 of the daemon's answer with {pages} page{'s' if pages > 1 else ''} over none",
              percentiles(answers[pages])[1] / percentiles(answers[0])[1], bound, "")
        record.figure(STUDY, f"p50 of the same with {pages}", percentiles(answers[pages])[0] / percentiles(answers[0])[0], "ratio")
    record.figure(STUDY, "daemon's answer without a page p50 ms", percentiles(answers[0])[0], "at the client")
    record.figure(STUDY, "daemon's answer without a page p99 ms", percentiles(answers[0])[1], "at the client")
    record.figure(STUDY, "received to drawn with 16 pages p50 ms", percentiles(drawn[VIEWERS])[0], "")
    record.figure(STUDY, "received to drawn with 16 pages p99 ms", percentiles(drawn[VIEWERS])[1], "")
    check("page weight: scripts and style", one[2] / 1e6, 4, "MB")
    record.figure(STUDY, "with MRI and model and one field", one[1] / 1e6, "MB on one computer")
    check("time to the first slices", one[3] / 1e3, 2, "s")
    record.figure(STUDY, "the same with the program just started", one[0] / 1e3, "s")
    check("greatest difference at the cursor from the mesh", float(errors.max()), stated + 0.02, "mm (the grid's stated error and rounding)")
    record.figure(STUDY, "places compared", len(errors), "in the axial slice")
    record.figure(STUDY, "fields that each of sixteen pages fetched at least", min(heard), f"of {options.updates} updates")
    record.figure(STUDY, "nodes", len(model.nodes), "")
    record.figure(STUDY, "load of the machine over its processors", os.getloadavg()[1] / os.cpu_count(), "5 minutes at the end")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("case", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--model", type=pathlib.Path, help="prepared of the case; otherwise it is prepared")
    parser.add_argument("--turns", type=int, default=5, help="0: nothing is timed")
    parser.add_argument("--growth-s", type=float, default=600.0, help="how long a page stays open to see what it comes to hold")
    parser.add_argument("--updates", type=int, default=20, help="per turn and number of pages")
    options = parser.parse_args()
    record = Record(options.out)
    measure(options, record)
    record.save()
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True).stdout.strip() or "unknown"
    return 0 if summarise(options.out, commit, "make page") else 1


if __name__ == "__main__":
    if sys.argv[1:2] == ["--read"]:
        read(sys.argv[2], int(sys.argv[3]))
    sys.exit(main())
