# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed C++ client: what it holds, and a program outside this tree that uses it."""
import os
import pathlib
import re
import subprocess

import numpy as np
import pytest
from conftest import SOURCE, Daemon

import brainshift

BUILD = pathlib.Path(os.environ["BRAINSHIFT_BUILD"])


def cmake(*arguments, path=os.environ["PATH"]):
    done = subprocess.run(["cmake", *map(str, arguments)], capture_output=True, text=True, timeout=240,
                          env=os.environ | {"PATH": path})
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("installed")
    cmake("--install", BUILD, "--component", "client", "--prefix", prefix)
    return prefix


@pytest.fixture(scope="module")
def program(prefix, tmp_path_factory):
    build = tmp_path_factory.mktemp("example")
    flags = os.environ.get("BRAINSHIFT_CXX_FLAGS", "")
    # Found by PATH, as CMake does it for every folder named bin. The build's own comes first, as with
    # those who have its programs in PATH: nothing there may look like an installed package.
    cmake("-S", SOURCE / "client" / "examples" / "send_boundary", "-B", build, f"-DCMAKE_CXX_FLAGS={flags}",
          path=f"{BUILD / 'bin'}:{prefix / 'bin'}:{os.environ['PATH']}")
    cmake("--build", build)
    return build / "send_boundary"


def test_all_of_it_is_apache(prefix):
    headers = list((prefix / "include").rglob("*.hpp"))
    assert len(headers) > 20
    for header in headers:
        assert "SPDX-License-Identifier: Apache-2.0" in header.read_text(), header
    assert not (prefix / "bin").exists()


def test_headers_include_nothing_that_is_not_installed(prefix):
    root = prefix / "include" / "brainshift"
    for header in root.rglob("*.hpp"):
        for name in re.findall(r'^#include "([^"]+)"', header.read_text(), re.MULTILINE):
            assert (root / name).exists(), f"{header} includes {name}"


def test_a_client_alone_asks_for_no_solver(tmp_path):
    absent = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in ("CGAL", "SQLite3", "HDF5", "yaml-cpp", "spdlog")]
    cmake("-S", SOURCE, "-B", tmp_path, "-DBRAINSHIFT_CLIENT_ONLY=ON", *absent)
    targets = cmake("--build", tmp_path, "--target", "help")
    assert "brainshift_client_lib" in targets and "brainshift_inversion" not in targets


def test_a_program_outside_this_tree_tells_what_python_does(program, head, tmp_path):
    with brainshift.Surgery(head / "joint.surgery") as surgery:
        boundary = next(surgery.observations()).body
    points = tmp_path / "points.txt"
    np.savetxt(points, boundary.points)
    with Daemon(tmp_path, head / "model.h5") as daemon:
        told = subprocess.run([program, daemon.endpoint, points], capture_output=True, text=True, timeout=120)
        assert told.returncode == 0, told.stderr
        with brainshift.connect(daemon.endpoint) as client:
            client.start_session(takeover=True)
            client.subscribe()
            client.submit(brainshift.TumourBoundary(np.loadtxt(points), 0.5), "ius")
            update = client.next_update(timeout_s=60)
    largest = np.linalg.norm(update.displacement_mm.astype(np.float64), axis=1).max()
    field, _, currency = told.stdout.strip().rpartition(", ")
    assert field == f"{len(update.displacement_mm)} nodes, largest displacement {largest:.6f} mm"
    assert currency in ("current", "stale")  # stale: the machine was busy for a second


def test_it_says_in_one_line_that_nobody_answers(program, tmp_path):
    told = subprocess.run([program, f"ipc://{tmp_path}/none.sock", "none"], capture_output=True, text=True, timeout=60)
    assert told.returncode == 1
    assert told.stderr.startswith("send_boundary: no daemon at ipc://") and told.stderr.count("\n") == 1


def test_debian_packages_hold_programs_and_client_apart(tmp_path):
    made = subprocess.run(["cpack", "--config", BUILD / "CPackConfig.cmake", "-B", tmp_path], capture_output=True,
                          text=True, timeout=240)
    assert made.returncode == 0, made.stdout + made.stderr

    def tell(package, *question):
        (file,) = tmp_path.glob(f"{package}_*.deb")
        return subprocess.run(["dpkg-deb", *question[:1], file, *question[1:]], capture_output=True, text=True,
                              check=True).stdout

    programs, client = tell("brainshift", "-c"), tell("libbrainshift-client-dev", "-c")
    assert "./usr/bin/brainshiftd" in programs and "./usr/lib/systemd/system/brainshiftd.service" in programs
    assert "./usr/include" not in programs
    assert "/cmake/brainshift_client/brainshift_client-config.cmake" in client and "./usr/bin" not in client
    assert "libopenblas0-pthread" in tell("brainshift", "-f", "Depends")
    assert "cholmod" not in tell("libbrainshift-client-dev", "-f", "Depends")
    assert "medical device" in tell("brainshift", "-f", "Description")
