# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors with their exit status, options, and files that are written whole or not at all."""
import argparse
import gzip
import os
import zlib
from pathlib import Path


class InputError(Exception):
    """A file or an option that cannot be used: exit status 2. The text is one line."""


class WriteError(Exception):
    """A result that cannot be written: exit status 1."""


class Parser(argparse.ArgumentParser):
    """Options as `--name value`; a wrong one is told in one line."""

    def __init__(self, name, description):
        super().__init__(prog="studies " + name, description=description, allow_abbrev=False)

    def error(self, message):
        raise InputError(f"{message} (see {self.prog} --help)")


def study_parser(name, description, command, title):
    """The options of every study: its folder, and what tables.md and the charts are headed with."""
    parser = Parser(name, description)
    parser.add_argument("--dir", type=Path, required=True, help="folder of rows; results go there too")
    parser.add_argument("--commit", default="unknown", help="for tables.md")
    parser.add_argument("--command", default=command, help="that the figures come from")
    parser.add_argument("--title", default=title, help="of the charts")
    return parser


def write_file(path, content):
    """Text or bytes. A reader never sees half of it."""
    path = Path(path)
    beside = path.with_name(path.name + ".part")
    try:
        beside.write_bytes(content if isinstance(content, bytes) else content.encode())
        os.replace(beside, path)
    except OSError as error:
        raise WriteError(f"{path}: cannot be written: {error.strerror}") from None


def read_text(path):
    """Of a file, or of one that gzip compressed (.gz)."""
    try:
        content = Path(path).read_bytes()
        return (gzip.decompress(content) if str(path).endswith(".gz") else content).decode()
    except (gzip.BadGzipFile, EOFError, zlib.error):
        raise InputError(f"{path}: is not what gzip writes") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be opened: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8") from None
