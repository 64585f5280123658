# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests share: inputs that nobody writes to, and a folder of its own for each test."""
import os
import pathlib
import tempfile

import inputs as shared
import pytest


@pytest.fixture(scope="session")
def inputs():
    """The folder of inputs.py: CTest's, or one for this run."""
    made = os.environ.get("BRAINSHIFT_INPUTS")
    if made:
        yield pathlib.Path(made)
        return
    with tempfile.TemporaryDirectory(prefix="brainshift-") as folder:
        shared.make(pathlib.Path(folder))
        yield pathlib.Path(folder)


@pytest.fixture
def folder():
    """Empty, and gone after the test. Its path is short, as addresses of sockets must be."""
    with tempfile.TemporaryDirectory(prefix="brainshift-") as name:
        yield pathlib.Path(name)
