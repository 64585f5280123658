# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the Python client share. CTest sets the three variables (CMakeLists.txt)."""
import json
import os
import pathlib
import subprocess

import pytest

SOURCE = pathlib.Path(os.environ["BRAINSHIFT_SOURCE"])
PROGRAMS = pathlib.Path(os.environ["BRAINSHIFT_PROGRAMS"])
GOLDEN = SOURCE / "tests" / "data" / "wire"


def record(study, name, value, bound, holds):
    """A row for the tables of a study, where one is run (tests/support/study_record.hpp). holds: None for a figure alone."""
    folder = os.environ.get("BRAINSHIFT_STUDY_DIR")
    if folder:
        with open(pathlib.Path(folder) / "checks.csv", "a", encoding="utf-8") as table:
            passed = "" if holds is None else int(holds)
            table.write(f"{study},{name},{value:g},{bound},{passed},pytest tests/python/test_{study}.py\n")


def golden(name):
    """Bytes of a golden frame and its description."""
    return (GOLDEN / f"{name}.bin").read_bytes(), json.loads((GOLDEN / f"{name}.json").read_text())


def run(program, *arguments):
    done = subprocess.run([PROGRAMS / program, *map(str, arguments)], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    return done.stdout


class Daemon:
    """brainshiftd on a socket of its own; `with` ends it."""

    def __init__(self, folder, model=None, config=""):
        self.folder = folder
        self.endpoint = f"ipc://{folder}/daemon.sock"
        self.log = open(folder / "daemon.log", "w")
        (folder / "daemon.yaml").write_text(f"endpoint: {self.endpoint}\n{config}")
        command = [PROGRAMS / "brainshiftd", "serve", "--config", folder / "daemon.yaml"]
        if model is not None:
            command += ["--model", model]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log, text=True)
        assert self.process.stdout.readline().startswith("listening on ")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        assert self.process.wait(timeout=30) == 0
        self.process.stdout.close()
        self.log.close()


@pytest.fixture(scope="session")
def head(tmp_path_factory):
    """A coarse head: its case, model file, and a surgery with three sources."""
    folder = tmp_path_factory.mktemp("head")
    case = SOURCE / "config" / "cases" / "colin27-coarse.yaml"
    run("brainshiftd", "prepare", "--case", case, "--out", folder / "model.h5")
    run("brainshift", "simulate", "--case", case, "--scenario", "joint-sag", "--seed", "1", "--out",
        folder / "joint.surgery")
    return folder
