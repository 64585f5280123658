# SPDX-License-Identifier: GPL-3.0-or-later
"""Chromium without a window, driven over a pipe by the DevTools protocol: messages are JSON, ended by NUL."""
import base64
import json
import os
import select
import shutil
import subprocess
import time

PROGRAM = shutil.which("chromium")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader", "--remote-debugging-pipe"]
LONG_S = 60.0


class Chromium:
    """`with` ends it. folder: for its user data, new."""

    def __init__(self, folder, url, width=1400, height=900, dark=False):
        its_input, self._out = os.pipe()
        self._in, its_output = os.pipe()

        def give():  # it reads from descriptor 3 and writes to 4
            for source, target in ((os.dup(its_input), 3), (os.dup(its_output), 4)):
                os.dup2(source, target)

        self._process = subprocess.Popen([PROGRAM, *FLAGS, f"--user-data-dir={folder}", "about:blank"], close_fds=False,
                                         preexec_fn=give, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(its_input)
        os.close(its_output)
        self._session, self._number, self._buffer, self.complaints = None, 0, b"", []
        page = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.size(width, height)
        self.theme(dark)
        self.call("Page.navigate", url=url)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(timeout=30)
        os.close(self._in)
        os.close(self._out)

    def call(self, method, **params):
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next(method)
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]
            if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                if answer["params"].get("entry", {}).get("source") != "rendering":  # that WebGL runs on the processor
                    self.complaints.append(answer["params"])

    def _next(self, method):
        while b"\0" not in self._buffer:
            assert select.select([self._in], [], [], LONG_S)[0], f"no answer to {method}"
            got = os.read(self._in, 1 << 20)
            assert got, f"Chromium ended at {method}"
            self._buffer += got
        message, self._buffer = self._buffer.split(b"\0", 1)
        return json.loads(message)

    def js(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, expression, most_s=LONG_S):
        """Seconds until it is true, in the page."""
        begin = time.monotonic()
        while not self.js(expression):
            assert time.monotonic() - begin < most_s, f"{expression} within {most_s} s: {self.text('verdict')}"
            time.sleep(0.01)  # asking takes the page's time
        return time.monotonic() - begin

    def text(self, identifier):
        return self.js(f"(document.getElementById('{identifier}') ?? document.body).textContent")

    def key(self, name):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def theme(self, dark):
        self.call("Emulation.setEmulatedMedia",
                  features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def screenshot(self, path):
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))
