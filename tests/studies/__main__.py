# SPDX-License-Identifier: GPL-3.0-or-later
"""python3 -m studies NAME ...; what it does stands in __init__.py."""
import importlib
import sys
from pathlib import Path

from .common import InputError, WriteError

NAMES = sorted(path.stem for path in Path(__file__).parent.glob("*.py")
               if "\ndef main(arguments)" in path.read_text(encoding="utf-8"))


def run(arguments):
    """Exit status."""
    name = arguments[0] if arguments else ""
    try:
        if name not in NAMES:
            raise InputError(f'"{name}" is no study; there are {", ".join(NAMES)}')
        return 0 if importlib.import_module("studies." + name).main(arguments[1:]) else 1
    except (InputError, WriteError) as error:
        print(f"studies {name}: {error}".replace("studies : ", "studies: "), file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
