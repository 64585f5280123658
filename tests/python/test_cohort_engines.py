# SPDX-License-Identifier: GPL-3.0-or-later
"""The same cohort here, by Snakemake and by a real Slurm of this machine: the same tables, bit for bit.

Skipped where Snakemake, or Slurm and munge, are not installed (docker/packages-cohort.txt). The programs are stand-ins,
one of which fails once for every subject. With BRAINSHIFT_COHORT (cmake/scripts/cohort.sh) it is that folder's dataset and tables,
by the programs themselves: the first BRAINSHIFT_COHORT_SUBJECTS of them.
"""
import os
import pathlib
import pwd
import shutil
import socket
import subprocess
import sys
import time

import bids_tree
import cohort_programs
import pytest
from conftest import PROGRAMS, SOURCE
from test_cohort import app, everything

ENGINES = SOURCE / "docs" / "cohort"
SLURM = [shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin") for name in ("munged", "slurmctld", "slurmd", "sbatch")]
OPTIONS = os.environ.get("BRAINSHIFT_COHORT_OPTIONS", "--seed 1 2").split()
REAL = os.environ.get("BRAINSHIFT_COHORT")
LIMIT_S = 7200.0 if REAL else 200.0
MEMORY_MB = 8000 if REAL else 2000


@pytest.fixture
def cohort(tmp_path):
    """Dataset, programs, tables of a run by hand, and brainshift-bids as a program."""
    if REAL:
        return real_cohort(tmp_path)
    bids, programs = bids_tree.dataset(tmp_path / "ds"), cohort_programs.make(tmp_path / "bin")
    for label in ("01", "02", "03"):
        bids_tree.subject(bids, label, lesion=label != "02")
    app(bids, tmp_path / "hand", "participant", "--programs", programs, *OPTIONS, expect=2)
    app(bids, tmp_path / "hand", "group")
    run = tmp_path / "brainshift-bids"
    # The first call for a subject fails, as a node that dies makes it.
    run.write_text(f'#!/bin/bash\ncase "$*" in *participant*)\n  mark={tmp_path}/tried-$5\n'
                   '  [ -e "$mark" ] || { touch "$mark"; exit 1; } ;;\nesac\n'
                   f'export PYTHONPATH={os.environ["PYTHONPATH"]} PATH={programs}:$PATH\n'
                   f'exec {sys.executable} -m brainshift.cohort "$@"\n')
    run.chmod(0o755)
    return bids, run, everything(tmp_path / "hand")


def real_cohort(tmp_path):
    """The same of BRAINSHIFT_COHORT; of a part of the subjects the group is made anew."""
    bids, count = tmp_path / "ds", int(os.environ["BRAINSHIFT_COHORT_SUBJECTS"])
    whole = pathlib.Path(REAL)
    bids.mkdir()
    for one in ("dataset_description.json", "derivatives"):
        (bids / one).symlink_to(whole / "bids" / one)
    subjects = sorted(one.name for one in (whole / "bids").glob("sub-*"))[:count]
    for one in subjects:
        (bids / one).symlink_to(whole / "bids" / one)
    shutil.copytree(whole / "here", tmp_path / "hand", ignore=lambda _, names: [
        n for n in names if n.startswith("group_") or n.startswith("sub-") and n.split("_")[0] not in subjects])
    app(bids, tmp_path / "hand", "group")
    run = tmp_path / "brainshift-bids"
    run.write_text(f'#!/bin/bash\nexport PYTHONPATH={os.environ["PYTHONPATH"]} PATH={PROGRAMS}:$PATH\n'
                   f'exec {sys.executable} -m brainshift.cohort "$@"\n')
    run.chmod(0o755)
    return bids, run, everything(tmp_path / "hand")


@pytest.mark.skipif(shutil.which("snakemake") is None, reason="needs Debian's snakemake")
def test_snakemake_makes_the_same_tables_and_retries(cohort, tmp_path):
    bids, run, expected = cohort
    done = subprocess.run(["snakemake", "-s", ENGINES / "Snakefile", "--cores", "2", "--retries", "1", "--config", f"bids={bids}",
                           f"out={tmp_path / 'out'}", f"app={run}", f"options={' '.join(OPTIONS)}"], cwd=tmp_path,
                          env={**os.environ, "HOME": str(tmp_path)}, capture_output=True, text=True, timeout=LIMIT_S)
    assert done.returncode == 0, done.stderr
    assert everything(tmp_path / "out") == expected


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


@pytest.fixture
def slurm(tmp_path):
    """A cluster of this machine alone; gives the environment of its commands."""
    munged, slurmctld, slurmd, _ = SLURM
    folder, host, user = tmp_path / "slurm", socket.gethostname().split(".")[0], pwd.getpwuid(os.getuid()).pw_name
    for name in (".", "state", "spool"):
        (folder / name).mkdir(mode=0o755)
    folder.chmod(0o755)
    for parent in list(folder.parents)[:-2]:
        parent.chmod(0o755) if parent.stat().st_uid == os.getuid() else None
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    controller, node = free_ports(2)
    (folder / "slurm.conf").write_text(f"""ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={controller}
SlurmdPort={node}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,sched_interval=2,bf_interval=2
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory={MEMORY_MB} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
""")
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    commands = [[munged, "--foreground", "--force", f"--key-file={key}", f"--socket={folder}/munge.socket",
                 f"--pid-file={folder}/munged.pid", f"--seed-file={folder}/munged.seed", f"--log-file={folder}/munged.log"],
                [slurmctld, "-D"], [slurmd, "-D"]]
    running = []
    with open(folder / "log", "wb") as log:
        try:
            for command in commands:
                running.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log, stdin=subprocess.DEVNULL))
            idle = wait(lambda: "idle" in command_output(["sinfo", "-h", "-o", "%T"], environment), 60.0)
            assert idle, (folder / "log").read_text()
            yield environment
        finally:
            for process in reversed(running):
                process.terminate()
                try:
                    process.wait(20.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def wait(condition, limit_s):
    end = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.2)
    return True


def command_output(command, environment):
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60).stdout


@pytest.mark.skipif(None in SLURM, reason="needs Debian's slurm-wlm and munge")
def test_slurm_makes_the_same_tables_and_tries_again(cohort, slurm, tmp_path):
    bids, run, expected = cohort
    out = tmp_path / "out"
    submitted = subprocess.run([ENGINES / "slurm.sh", bids, out, *OPTIONS],
                               env={**slurm, "APP": str(run), "MEM_MB": str(MEMORY_MB * 45 // 100)}, capture_output=True, text=True, timeout=60)
    assert submitted.returncode == 0, submitted.stderr
    assert submitted.stdout.strip().isdigit()
    assert wait((out / "group_report.html").exists, LIMIT_S), "".join(f.read_text() for f in out.rglob("*.log"))
    logs = "".join(file.read_text() for file in (out / ".work" / "logs").iterdir())
    assert REAL or "try 1 of 3 ended with 1" in logs
    assert everything(out) == expected
