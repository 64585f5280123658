# SPDX-License-Identifier: Apache-2.0
"""Keys of daemons that ask for them: files made by `brainshift keys make` (docs/security.md)."""
from __future__ import annotations

import os
import pathlib
import stat
from dataclasses import dataclass, field
from typing import Union

Path = Union[str, "os.PathLike[str]"]
KEY_CHARACTERS = 40
_ALPHABET = frozenset("0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#")


@dataclass(frozen=True)
class Keys:
    server_public_key: str
    public_key: str
    secret_key: str = field(repr=False)


def read_keys(server_key: Path, key: Path) -> Keys:
    """server_key: the daemon's .public file; key: the own .secret file.

    ValueError names the file and what is wrong with it, and never shows a secret; OSError as open().
    """
    mode = os.stat(key).st_mode
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ValueError(f"{key}: others may read it (mode {stat.S_IMODE(mode):04o}): chmod 600")
    own = _entries(key)
    return Keys(_key(server_key, _entries(server_key), "public"), _key(key, own, "public"), _key(key, own, "secret"))


def _entries(path: Path) -> dict[str, str]:
    entries: dict[str, str] = {}
    for line in pathlib.Path(path).read_text(encoding="ascii").splitlines():
        name, colon, value = line.partition(":")
        if colon and not line.startswith("#"):
            entries[name.strip()] = value.strip()
    return entries


def _key(path: Path, entries: dict[str, str], name: str) -> str:
    value = entries.get(name)
    if value is None:
        raise ValueError(f"{path}: has no line \"{name}: ...\"")
    if len(value) != KEY_CHARACTERS or not _ALPHABET.issuperset(value):
        raise ValueError(f"{path}: {name} must be a key of {KEY_CHARACTERS} characters in Z85")
    return value
