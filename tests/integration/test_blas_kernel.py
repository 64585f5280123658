# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs take a kernel of OpenBLAS that suits the processor, also where OpenBLAS does not know the processor and takes its
oldest (common/linalg/blas_kernel.hpp)."""
import os
import pathlib

import pytest
from programs import brainshiftd


def started(*arguments, kernel=None):
    env = {**os.environ, "OPENBLAS_VERBOSE": "2"}
    env.pop("OPENBLAS_CORETYPE", None)
    if kernel is not None:
        env["OPENBLAS_CORETYPE"] = kernel
    return brainshiftd(*arguments, env=env)


def kernels(done):
    """Those that OpenBLAS says it has chosen, one for each time that the program was started."""
    core = "Core: "
    return [line[len(core):] for line in (done.stderr + done.stdout).splitlines() if line.startswith(core)]


def test_the_kernel_is_not_the_oldest_where_the_processor_has_avx2():
    done = started("--version")
    assert done.returncode == 0
    chosen = kernels(done)
    if not chosen:
        pytest.skip("the loaded BLAS is not OpenBLAS")
    if "avx2" not in pathlib.Path("/proc/cpuinfo").read_text().split():
        pytest.skip("no AVX2")
    assert chosen[-1] != "Prescott"
    assert len(chosen) <= 2


def test_the_kernel_is_the_users_where_one_is_named():
    done = started("--version", kernel="Prescott")
    assert done.returncode == 0
    if not kernels(done):
        pytest.skip("the loaded BLAS is not OpenBLAS")
    assert kernels(done) == ["Prescott"]


def test_arguments_reach_a_program_that_starts_itself_again():
    done = started("prepare", "--case", "no such case.yaml", "--out", "", "--json")
    assert done.returncode == 2
    told = [line for line in done.stderr.splitlines() if line.startswith("brainshiftd: ")]
    assert len(told) == 1, done.stderr
    assert '--out: "" must name a file' in told[0]


def test_every_program_that_names_its_kernel_chooses_it_first():
    root = pathlib.Path(__file__).parents[2]
    mains = [path for folder in ("client", "server", "tests") for path in (root / folder).rglob("*.cpp")
             if "int main(" in path.read_text()]
    naming = [path for path in mains if '"common/linalg/openblas.hpp"' in path.read_text()]
    assert len(naming) > 5
    assert [path.name for path in naming if "choose_blas_kernel()" not in path.read_text()] == []
