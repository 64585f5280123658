# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel, built and used without a network."""
import os
import shutil
import subprocess
import sys
import zipfile

from conftest import SOURCE

PACKAGE = SOURCE / "client" / "python"


def test_the_wheel_holds_all_that_the_package_needs(tmp_path):
    copy = tmp_path / "source"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    environment = {**os.environ, "BRAINSHIFT_PROTO": str(SOURCE / "proto")}
    done = subprocess.run([sys.executable, "setup.py", "-q", "bdist_wheel", "--dist-dir", tmp_path / "wheels"], cwd=copy,
                          env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    (wheel,) = (tmp_path / "wheels").glob("brainshift-*-py3-none-any.whl")
    installed = tmp_path / "installed"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
    assert (installed / "brainshift" / "py.typed").exists()
    (entries,) = installed.glob("brainshift-*.dist-info/entry_points.txt")
    assert "brainshift-bids = brainshift.cohort.command:main" in entries.read_text()
    environment["PYTHONPATH"] = str(installed)
    used = subprocess.run([sys.executable, "-c", "import brainshift, brainshift.cohort.command; print(brainshift.__file__)"], cwd=tmp_path,
                          env=environment, capture_output=True, text=True, timeout=60)
    assert used.stdout.startswith(str(installed)), used.stderr


def test_a_missing_folder_of_messages_is_named(tmp_path):
    copy = tmp_path / "source"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    done = subprocess.run([sys.executable, "setup.py", "-q", "bdist_wheel"], cwd=copy,
                          env={**os.environ, "BRAINSHIFT_PROTO": str(tmp_path / "none")}, capture_output=True, text=True,
                          timeout=120)
    assert done.returncode != 0
    assert "set BRAINSHIFT_PROTO to the folder of the messages" in done.stderr


def test_every_name_is_typed(tmp_path):
    built = os.environ["PYTHONPATH"].split(os.pathsep)[0]
    done = subprocess.run(["mypy", "--config-file", PACKAGE / "pyproject.toml", "--python-executable", sys.executable,
                           "--cache-dir", tmp_path], cwd=built, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stdout + done.stderr
