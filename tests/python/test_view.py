# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift view` in a real browser, beside the real daemon on the coarse head. Skipped where there is no Chromium.

BRAINSHIFT_SCREENSHOTS=FOLDER keeps what the browser showed.
"""
import json
import os
import pathlib
import re
import signal
import subprocess

import chromium
import numpy as np
import pytest
from chromium import Chromium
from conftest import PROGRAMS, Daemon

import brainshift

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="needs the program chromium")
GREY = "document.body?.className === 'grey'"
LIVE = "document.body?.className === ''"
LEASE_S = 1.5  # within which a page must be grey


class View:
    def __init__(self, endpoint, *options):
        self.process = subprocess.Popen([PROGRAMS / "brainshift", "view", "--endpoint", endpoint, "--listen", "127.0.0.1:0",
                                         *map(str, options)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().split()[0]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGCONT)
        self.process.terminate()
        assert self.process.wait(timeout=30) == 0
        self.process.stdout.close()
        self.process.stderr.close()


def keep(browser, name):
    if "BRAINSHIFT_SCREENSHOTS" in os.environ:
        browser.screenshot(pathlib.Path(os.environ["BRAINSHIFT_SCREENSHOTS"]) / f"{name}.png")


@pytest.fixture(scope="module")
def surgery(head, tmp_path_factory):
    """A daemon that has answered three observations of a recording, and the last update with its model."""
    folder = tmp_path_factory.mktemp("view")
    (folder / "journal").mkdir()
    daemon = Daemon(folder, head / "model.h5", "journal_dir: journal\nage: { aged_after_s: 600, expired_after_s: 1200 }\n")
    with brainshift.connect(daemon.endpoint) as client:
        client.start_session(recorded_clock=True)
        client.subscribe(window=16)
        with brainshift.Surgery(head / "joint.surgery") as recorded:
            for observation in list(recorded.observations())[:3]:
                client.submit_observation(observation)
                update = client.next_update(timeout_s=60)
        yield daemon, client, client.model(), update
    daemon.process.kill()
    daemon.process.wait()
    daemon.process.stdout.close()
    daemon.log.close()


@pytest.fixture(scope="module")
def view(surgery, head):
    with View(surgery[0].endpoint, "--model", head / "model.h5", "--journal", surgery[0].folder / "journal") as view:
        yield view


@pytest.fixture(scope="module")
def browser(view, tmp_path_factory):
    with Chromium(tmp_path_factory.mktemp("chromium"), view.url) as browser:
        browser.wait(LIVE)
        yield browser


def test_one_line_says_what_is_shown_and_that_it_is_recorded(browser, surgery):
    update = surgery[3]
    assert re.match(rf"RECORDED · {update.quality.name}.* tumour moved \d+\.\d+ ± \d+\.\d+ mm$", browser.text("verdict"))
    assert re.search(r"data .* s old · method condensed · boundary contact · update 3", browser.text("details"))
    assert browser.text("left-out") and browser.text("sources")
    assert browser.complaints == []
    keep(browser, "view")


def test_the_value_at_the_cross_is_that_of_the_mesh(browser, surgery):
    _, _, model, update = surgery
    tumour_now = np.array([model.tumour.vertices.mean(axis=0)])
    was = brainshift.Field(brainshift.FieldMesh(model), update).undeformed(tumour_now)
    told = re.search(r"· in the MRI: R (\S+), A (\S+), S (\S+) · moved (\S+) ± (\S+) mm · (\d+) % known.* within (\S+) mm",
                     browser.text("cursor"))
    numbers = [float(n) for n in told.groups()]
    error = numbers[6] + 0.02  # of the grid, and of the figures' rounding
    assert np.linalg.norm(np.array(numbers[:3]) - was.points[0]) < error + 0.1
    assert abs(numbers[3] - np.linalg.norm(was.field.displacement_mm[0])) < error
    assert abs(numbers[4] - was.field.sd_mm[0]) < 0.05
    assert abs(numbers[5] - 100 * was.field.known[0]) < 3


def test_the_switches_change_the_picture_and_its_legend(browser):
    seen = set()
    for name in ("u", "sd", "known", "volume", "none"):
        browser.js(f"document.querySelector('input[value={name}]').click()")
        seen.add(browser.js("document.getElementById('axial').toDataURL()"))
        seen.add("legend " + browser.text("scale"))
        keep(browser, f"map-{name}")
    for switch in ("input[value=before]", "#arrows", "#tumour"):
        browser.js(f"document.querySelector('{switch}').click()")
        seen.add(browser.js("document.getElementById('axial').toDataURL()"))
    assert len(seen) == 13
    keep(browser, "arrows")
    for switch in ("input[value=u]", "input[value=now]", "#arrows", "#tumour"):
        browser.js(f"document.querySelector('{switch}').click()")


def test_the_page_says_where_to_measure_next_as_the_command_does(browser, surgery, head):
    journal = next((surgery[0].folder / "journal").glob("*.surgery"))
    told = json.loads(subprocess.run([PROGRAMS / "brainshift", "advise", journal, "--model", head / "model.h5", "--json"],
                                     capture_output=True, text=True, check=True).stdout)
    best = [one for one in told["candidates"] if one["reduction_mm"] is not None][:5]
    assert not browser.js("document.getElementById('advice').checked"), "nothing is computed unasked"
    before = browser.js("document.getElementById('axial').toDataURL()")
    browser.js("document.getElementById('advice').click()")
    browser.wait("document.querySelectorAll('#advice-rows tr').length > 0", 60)
    assert re.match(r"Where to measure next: sd at the tumour boundary \d+\.\d+ mm now(; none of these would take off 0.01 mm)?$",
                    browser.text("advice-caption"))
    shown = browser.js("[...document.querySelectorAll('#advice-rows tr')].map(row => [...row.children].map(cell => cell.textContent))")
    figures = lambda one: [f"{one['reduction_mm']:.2f}", f"{one['sd_after_mm']:.2f}"]
    assert [row[1:] for row in shown] == [figures(one) for one in best]
    # The last digits of two estimates decide between candidates that are equal as shown.
    named = {one["name"]: one for one in told["candidates"] if one["reduction_mm"] is not None}
    places, names = zip(*(row[0].split(" ", 1) for row in shown))
    assert places == ("1", "2", "3", "4", "5") and [row[1:] for row in shown] == [figures(named[name]) for name in names]
    browser.js("document.querySelector('#advice-rows button').click()")
    was = re.search(r"in the MRI: R (\S+), A (\S+), S (\S+) ·", browser.text("cursor"))
    assert np.allclose([float(n) for n in was.groups()], named[names[0]]["where_mm"], atol=0.15), "the cross goes to the first"
    keep(browser, "advice")
    assert browser.js("document.getElementById('axial').toDataURL()") != before
    browser.js("document.getElementById('advice').click()")
    opened = browser.js("performance.timeOrigin")
    browser.call("Page.reload")
    browser.wait(f"performance.timeOrigin > {opened} && document.body?.dataset.drawn")
    browser.wait(LIVE)


def test_keys_move_the_linked_slices(browser):
    before = browser.text("cursor"), browser.js("document.getElementById('coronal').toDataURL()")
    browser.js("document.getElementById('axial').focus()")
    browser.key("ArrowUp")
    browser.wait(f"document.getElementById('cursor').textContent !== {before[0]!r}")
    assert browser.js("document.getElementById('coronal').toDataURL()") != before[1], "A + 1 mm is another coronal slice"
    browser.key("ArrowDown")


def test_the_volume_change_at_the_cross_is_that_of_the_mesh(browser, surgery):
    _, _, model, update = surgery
    browser.js("document.querySelector('input[value=volume]').click()")
    told = re.search(r" · volume ([+−])(\S+) %", browser.text("cursor"))
    browser.js("document.querySelector('input[value=u]').click()")
    now = np.array([model.tumour.vertices.mean(axis=0)])
    field = brainshift.Field(brainshift.FieldMesh(model), update)
    was = field.undeformed(now).points[0]
    step = 2.0 * np.eye(3)
    gradient = np.array([field.at([was + one]).displacement_mm[0] - field.at([was - one]).displacement_mm[0] for one in step]) / 4.0
    change = 100.0 * (np.linalg.det(np.eye(3) + gradient.T) - 1.0)
    assert abs(float(told[2]) * (-1 if told[1] == "−" else 1) - change) < 1.0


def test_the_surface_turns_by_keys_and_is_not_black(browser):
    lit = ("(() => { const c = document.getElementById('surface'), d = document.createElement('canvas'); d.width = d.height = 90;"
           "const x = d.getContext('2d'); x.drawImage(c, 0, 0, 90, 90);"
           "return x.getImageData(0, 0, 90, 90).data.filter((v, i) => i % 4 === 0 && v > 40).length; })()")
    assert browser.js(lit) > 1500
    before = browser.text("surface-from"), browser.js("document.getElementById('surface').toDataURL()")
    assert before[0].startswith("3-D, from the ")
    browser.js("document.getElementById('surface').focus()")
    for _ in range(9):
        browser.key("ArrowLeft")
    assert browser.text("surface-from") != before[0]
    assert browser.js("document.getElementById('surface').toDataURL()") != before[1]


def test_everything_to_operate_has_a_name(browser):
    nodes = browser.call("Accessibility.getFullAXTree")["nodes"]
    for node in nodes:
        role = node.get("role", {}).get("value")
        if role in ("radio", "checkbox", "image", "img", "graphics-document"):
            assert node["name"]["value"], node
    assert sum(node.get("role", {}).get("value") in ("radio", "checkbox") for node in nodes) == 11


@pytest.mark.parametrize("width, dark", [(1400, True), (800, False), (800, True)])
def test_no_page_is_wider_than_its_window(browser, width, dark):
    browser.size(width, 1000)
    browser.theme(dark)
    assert browser.js("document.documentElement.scrollWidth") <= width
    keep(browser, f"{width}-{'dark' if dark else 'light'}")
    browser.size(1400, 900)
    browser.theme(False)


def test_a_page_whose_program_is_frozen_goes_grey(browser, view):
    view.process.send_signal(signal.SIGSTOP)
    assert browser.wait(GREY) < LEASE_S
    assert "no word from brainshift view" in browser.text("verdict")
    view.process.send_signal(signal.SIGCONT)
    browser.wait(LIVE)


def test_a_page_of_a_frozen_daemon_goes_grey(browser, surgery):
    surgery[0].process.send_signal(signal.SIGSTOP)
    assert browser.wait(GREY) < LEASE_S
    assert re.search("NOT CURRENT: .", browser.text("verdict"))
    keep(browser, "grey")
    surgery[0].process.send_signal(signal.SIGCONT)
    browser.wait(LIVE)


def test_another_session_takes_the_field_away(browser, surgery):
    surgery[1].start_session(takeover=True)
    browser.wait("document.getElementById('verdict').textContent.startsWith('NO FIELD')")
    assert "moved" not in browser.text("cursor")
    assert browser.js(GREY)


def test_a_page_of_a_dead_daemon_goes_grey(browser, surgery, head):
    with brainshift.Surgery(head / "joint.surgery") as recorded:
        surgery[1].submit_observation(next(recorded.observations()))
    browser.wait(LIVE)
    surgery[0].process.kill()
    assert browser.wait(GREY) < LEASE_S
    assert browser.text("verdict").startswith("NOT CURRENT: ")


def test_bad_options_are_one_line(head):
    for options, says in ((["--listen", "0.0.0.0:8080"], "for this computer alone"), (["--listen", "8080x"], "--listen"),
                          (["--model", "/none.h5"], "/none.h5"), (["--journal", "/tmp"], "--journal needs --model"),
                          (["--model", head / "model.h5", "--journal", "/none"], "--journal: /none is no folder")):
        done = subprocess.run([PROGRAMS / "brainshift", "view", *options], capture_output=True, text=True, timeout=60)
        assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1, done.stderr
