# SPDX-License-Identifier: Apache-2.0
"""brainshiftd and brainshift, as this package calls them."""
from __future__ import annotations

import contextlib
import os
import select
import shutil
import subprocess
from dataclasses import dataclass
from typing import Iterator, Sequence

from .files import Path, Refused, digest

LISTENING = "listening on "


class Failed(Exception):
    """A program that ended badly for another reason than its input: worth another try."""


@dataclass(frozen=True)
class Programs:
    daemon: Path
    tool: Path
    identity: str  # version, and a part of the SHA-256 of both files: two builds of a version differ

    def call(self, program: Path, *arguments: object, folder: Path, held: int | None = None) -> str:
        """Its output. Refused with its own sentence when it ends with 2, Failed with anything else."""
        done = subprocess.run(_tied([str(program), *map(str, arguments)]), cwd=folder, capture_output=True, text=True,
                              errors="replace", stdin=subprocess.DEVNULL, env=_environment(), check=False,
                              pass_fds=() if held is None else (held,))
        if done.returncode:
            lines = done.stderr.strip().splitlines() or ["no message"]
            text = f"{program.name} {arguments[0]}: {lines[-1].removeprefix(program.name + ': ')}"
            if done.returncode == 2:
                raise Refused(text)
            raise Failed(f"{text} (exit status {done.returncode})")
        return done.stdout

    @contextlib.contextmanager
    def serving(self, model: Path, folder: Path) -> Iterator[str]:
        """A daemon with this model on a socket that only this account can open; gives its endpoint, relative to
        the folder, because a socket's path may not be long."""
        endpoint = "ipc://d.sock"
        (folder / "d.sock").unlink(missing_ok=True)
        (folder / "daemon.yaml").write_text(f"endpoint: {endpoint}\nlog_level: warn\n", encoding="utf-8")
        with open(folder / "daemon.log", "wb") as log:
            process = subprocess.Popen(_tied([str(self.daemon), "serve", "--config", "daemon.yaml", "--model", str(model),
                                              "--endpoint", endpoint]), cwd=folder, stdout=subprocess.PIPE, stderr=log,
                                       stdin=subprocess.DEVNULL, env=_environment())
        assert process.stdout is not None
        try:
            ready, _, _ = select.select([process.stdout], [], [], 300.0)
            line = process.stdout.readline().decode(errors="replace") if ready else ""
            if not line.startswith(LISTENING):
                last = (folder / "daemon.log").read_text(errors="replace").strip().splitlines() or ["no message"]
                raise Failed(f"{self.daemon.name} serve: {last[-1]}")
            yield endpoint
        finally:
            process.terminate()
            try:
                process.wait(30.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            process.stdout.close()


def find(folder: str | None) -> Programs:
    """The programs in this folder, else in PATH."""
    paths = []
    for name in ("brainshiftd", "brainshift"):
        found = shutil.which(name, path=folder)
        if found is None:
            raise Refused(f"{name} is not in {folder or 'PATH'} (--programs FOLDER says where)")
        paths.append(Path(found).resolve())
    version = subprocess.run([paths[0], "--version"], capture_output=True, text=True, check=False).stdout.strip()
    return Programs(paths[0], paths[1], f"{version or 'brainshiftd'} {digest(paths[0])[:8]}-{digest(paths[1])[:8]}")


def _tied(command: list[str]) -> list[str]:
    """The same command, that ends with this process, however this one ends (setpriv of util-linux)."""
    setpriv = shutil.which("setpriv")
    return [setpriv, "--pdeathsig", "KILL", *command] if setpriv else command


def _environment() -> dict[str, str]:
    return {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def cpus_for(worker: int, workers: int, mine: Sequence[int]) -> Sequence[int]:
    """The share of one of several workers in these processors."""
    share = max(1, len(mine) // workers)
    start = worker * share % len(mine)
    return mine[start:start + share]
