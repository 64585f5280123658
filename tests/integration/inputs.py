# SPDX-License-Identifier: GPL-3.0-or-later
"""inputs.py FOLDER: what several of the tests read and none writes, made once for a run of CTest.

  head/model.h5      the coarse head, with what `prepare --json` told (prepare.json, prepare.err)
  head/paper.surgery the paper's simulated surgery of it
  toy/, stereo/, sweep/  what integration_inputs makes (make_inputs.cpp)
"""
import pathlib
import shutil
import sys

from programs import COARSE_CASE, HEAD, brainshift, brainshiftd, good, run


def simulate(scenario, out):
    good(brainshift("simulate", "--case", COARSE_CASE, "--scenario", scenario, "--seed", 1, "--out", out))
    return out


def make(folder):
    assert HEAD.exists(), "Debian's mricron-data is not installed"
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("head", "toy", "stereo", "sweep"):
        (folder / name).mkdir(parents=True)
    head = folder / "head"
    told = good(brainshiftd("prepare", "--case", COARSE_CASE, "--out", head / "model.h5", "--json"))
    (head / "prepare.json").write_text(told.stdout)
    (head / "prepare.err").write_text(told.stderr)
    simulate("paper", head / "paper.surgery")
    good(run("integration_inputs", folder))


if __name__ == "__main__":
    make(pathlib.Path(sys.argv[1]))
