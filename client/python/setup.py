# SPDX-License-Identifier: Apache-2.0
"""Builds the package; protoc (Debian: protobuf-compiler) makes brainshift.v1 from the messages.

The messages are those of proto/ in the repository, or of the folder that BRAINSHIFT_PROTO names.
"""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = pathlib.Path(__file__).resolve().parent
MESSAGES = ("brainshift", "operations")


class BuildWithMessages(build_py):
    def run(self) -> None:
        proto = pathlib.Path(os.environ.get("BRAINSHIFT_PROTO", HERE.parent.parent / "proto"))
        files = [f"brainshift/v1/{name}.proto" for name in MESSAGES]
        for file in files:
            if not (proto / file).is_file():
                raise SystemExit(f"{proto / file} not found: set BRAINSHIFT_PROTO to the folder of the messages")
        protoc = shutil.which("protoc")
        if protoc is None:
            raise SystemExit("protoc not found: install protobuf-compiler")
        generated = HERE / "build" / "messages"
        generated.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            [protoc, f"--proto_path={proto}", f"--python_out={generated}", f"--pyi_out={generated}", *files],
            check=True)
        folder = generated / "brainshift" / "v1"
        (folder / "__init__.py").write_text("# Made by protoc.\n", encoding="utf-8")
        self.package_dir = {**(self.package_dir or {}), "brainshift.v1": os.path.relpath(folder, HERE)}
        super().run()


setup(cmdclass={"build_py": BuildWithMessages})
