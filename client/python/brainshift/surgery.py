# SPDX-License-Identifier: Apache-2.0
"""Recorded surgeries: the observations and updates of a surgery file or a journal.

The file is an SQLite database (common/io/recording/surgery_file.hpp). Every record carries a
checksum of all before it; this reader leaves them to `brainshift journal check` and says so.
"""
from __future__ import annotations

import os
import sqlite3
from typing import Iterator, Union
from urllib.parse import quote

from . import codec
from .errors import Error
from .values import Observation, Update

Path = Union[str, "os.PathLike[str]"]
_APPLICATION_ID = 0x42534652  # "BSFR"
_VERSION = 2


class Surgery:
    """A surgery file, opened for reading. Error "unreadable" names the file and what is wrong."""

    def __init__(self, path: Path) -> None:
        self._path = os.fspath(path)
        if not os.path.isfile(self._path):
            raise Error("not_found", f"{self._path}: no such file")
        try:
            self._database = sqlite3.connect(f"file:{quote(os.path.abspath(self._path))}?mode=ro", uri=True)
            (application,) = self._database.execute("PRAGMA application_id").fetchone()
            (version,) = self._database.execute("PRAGMA user_version").fetchone()
            if application != _APPLICATION_ID or version != _VERSION:
                raise Error("unreadable", f"{self._path}: is no surgery file of version {_VERSION}")
            self.meta: dict[str, str] = {
                str(key): str(value) for key, value in self._database.execute("SELECT key, value FROM meta")}
        except sqlite3.Error as error:
            raise Error("unreadable", f"{self._path}: {error}") from None

    def observations(self) -> Iterator[Observation]:
        """In the order of the recording."""
        return map(codec.recorded_observation, self._records("observation"))

    def updates(self) -> Iterator[Update]:
        """Those that the daemon published, in order; failures too."""
        return map(codec.update, self._records("update"))

    def _records(self, kind: str) -> Iterator[bytes]:
        try:
            for (payload,) in self._database.execute("SELECT payload FROM record WHERE kind = ? ORDER BY id", (kind,)):
                yield bytes(payload)
        except sqlite3.Error as error:
            raise Error("unreadable", f"{self._path}: {error}") from None

    def close(self) -> None:
        self._database.close()

    def __enter__(self) -> Surgery:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
