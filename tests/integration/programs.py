# SPDX-License-Identifier: GPL-3.0-or-later
"""The programs under test, run as a user runs them, and the coarse case.

CTest sets the variables (CMakeLists.txt); without them they are those of build/release.
"""
import os
import pathlib
import select
import signal
import subprocess

SOURCE = pathlib.Path(os.environ.get("BRAINSHIFT_SOURCE", pathlib.Path(__file__).parents[2]))
PROGRAMS = pathlib.Path(os.environ.get("BRAINSHIFT_PROGRAMS", SOURCE / "build" / "release" / "bin"))
TIMEOUT_FACTOR = float(os.environ.get("BRAINSHIFT_TIMEOUT_FACTOR", "1"))  # 10 with sanitizers
COARSE_CASE = SOURCE / "config" / "cases" / "colin27-coarse.yaml"
HEAD = pathlib.Path("/usr/share/mricron/templates/ch2bet.nii.gz")  # Debian's mricron-data
LOCAL = "endpoint: tcp://127.0.0.1:*\n"  # a daemon's configuration: any free port


def run(program, *arguments, limit_s=120.0, env=None):
    """Its exit status and what it printed: returncode, stdout, stderr. It is killed after limit_s."""
    return subprocess.run([PROGRAMS / program, *map(str, arguments)], capture_output=True, encoding="utf-8",
                          timeout=TIMEOUT_FACTOR * limit_s, env=env)


def brainshift(*arguments, **how):
    return run("brainshift", *arguments, **how)


def brainshiftd(*arguments, **how):
    return run("brainshiftd", *arguments, **how)


def good(done):
    """The same, of a program that must have ended well."""
    assert done.returncode == 0, done.stderr
    return done


def refused(done, *says, program=None):
    """Exit status 2, and one line on stderr that begins with the program's name and has these parts."""
    program = program or pathlib.Path(done.args[0]).name
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stderr.startswith(program + ": ")
    for part in says:
        assert str(part) in done.stderr


class Background:
    """A program that keeps running until it is told to end; `with` kills it if nobody did.

    Returns when it has printed a line. stderr goes to the file `log`.
    """

    def __init__(self, program, *arguments, log, env=None):
        with open(log, "wb", buffering=0) as stderr:
            self.process = subprocess.Popen([PROGRAMS / program, *map(str, arguments)], stdout=subprocess.PIPE,
                                            stderr=stderr, env=env, bufsize=0)
        printed, _, _ = select.select([self.process.stdout], [], [], TIMEOUT_FACTOR * 60.0)
        self.first_line = self.process.stdout.readline().decode().rstrip("\n") if printed else ""

    @property
    def address(self):
        listening = "listening on "
        assert self.first_line.startswith(listening), self.first_line
        return self.first_line[len(listening):]

    def end(self, number=signal.SIGTERM):
        """Sends the signal and waits; the exit status, negative when a signal ended it."""
        self.process.send_signal(number)
        return self.process.wait(TIMEOUT_FACTOR * 60.0)

    def rest(self):
        """What it printed after its first line, once it has ended."""
        return self.process.stdout.read().decode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()


def serve(folder, config=LOCAL, *, model=None, log="daemon.log", env=None):
    """A daemon; its configuration and log are files of the folder."""
    file = folder / "daemon.yaml"
    file.write_text(config)
    arguments = [] if model is None else ["--model", model]
    return Background("brainshiftd", "serve", "--config", file, *arguments, log=folder / log, env=env)


def write(file, content):
    """The file, with this text or these bytes."""
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def with_line(text, section, key, line):
    """YAML with one line replaced: the first below the top-level `section:` whose key is `key`. Keeps the indentation."""
    lines = text.split("\n")
    top = next(i for i, one in enumerate(lines) if one.startswith(section + ":"))
    at = next(i for i in range(top + 1, len(lines)) if lines[i].lstrip(" ").startswith(key + ":"))
    lines[at] = lines[at][:len(lines[at]) - len(lines[at].lstrip(" "))] + line
    return "\n".join(lines)


def coarse_case(*changes):
    """The text of the coarse case with lines replaced: (section, key, line)."""
    text = COARSE_CASE.read_text()
    for change in changes:
        text = with_line(text, *change)
    return text
