# SPDX-License-Identifier: Apache-2.0
"""What can go wrong: a stable code to branch on and one sentence to show."""
from __future__ import annotations


class Error(Exception):
    """An answer that says no, or none at all.

    code     "unavailable": no daemon, no answer in time, or one that is stopping; "protocol": an
             answer that cannot be understood; "not_allowed": the key's role does not include the
             request; any other is the daemon's own, e.g. "model_not_ready", "invalid_argument".
    message  one sentence.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message

    def __str__(self) -> str:
        return f"{self.message} ({self.code})"


class Unavailable(Error):
    """Nobody answered, or nothing arrived in time."""

    def __init__(self, message: str) -> None:
        super().__init__("unavailable", message)


class ProtocolError(Error):
    """A message that is not one of protocol version 2."""

    def __init__(self, message: str) -> None:
        super().__init__("protocol", message)
