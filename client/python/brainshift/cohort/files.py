# SPDX-License-Identifier: Apache-2.0
"""Files that appear whole or not at all, tables with their data dictionary, and locks."""
from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import math
import os
import pathlib
import shutil
from typing import Any, Iterator, Mapping, Sequence

Path = pathlib.Path
Row = Mapping[str, object]


class Refused(Exception):
    """Bad input: one sentence that names the file, option or subject and what is there instead."""


def write(path: Path, content: str | bytes) -> None:
    """The file with this content, or as it was; never a part of it, whenever the machine stops."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with open(temporary, "wb") as stream:
        stream.write(content if isinstance(content, bytes) else content.encode())
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(temporary, path)


def write_json(path: Path, value: object) -> None:
    write(path, json.dumps(value, indent=2, sort_keys=False, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise Refused(f"{path}: {error}") from None


def copy(source: Path, target: Path) -> None:
    write(target, source.read_bytes())


def drop_temporaries(folder: Path, of: str = "") -> None:
    """Removes what a killed `write` of a file that begins with `of` left. Call it under the lock of these files."""
    for file in folder.glob(f".{of}*.tmp"):
        file.unlink(missing_ok=True)


def digest(path: Path) -> str:
    """SHA-256 of a file's content."""
    sha = hashlib.sha256()
    with open(path, "rb") as stream:
        for block in iter(lambda: stream.read(1 << 20), b""):
            sha.update(block)
    return sha.hexdigest()


def cell(value: object) -> str:
    """A number in six digits, as TSV of BIDS has it; n/a for what is missing."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "n/a"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.6g}"
    return " ".join(str(value).split()) or "n/a"


def table_text(columns: Sequence[str], rows: Sequence[Row]) -> str:
    lines = ["\t".join(columns), *("\t".join(cell(row.get(column)) for column in columns) for row in rows)]
    return "\n".join(lines) + "\n"


def write_table(path: Path, dictionary: Mapping[str, Mapping[str, object]], rows: Sequence[Row]) -> None:
    """path (.tsv) with the columns of the dictionary, and the dictionary beside it (.json), first."""
    write_json(path.with_suffix(".json"), dictionary)
    write(path, table_text(list(dictionary), rows))


@contextlib.contextmanager
def locked(path: Path) -> Iterator[int]:
    """Waits for the lock that this file stands for. A process that is killed lets go of it.

    Gives the descriptor: a child that inherits it holds the lock too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)


def remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
