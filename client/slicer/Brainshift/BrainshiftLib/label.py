# SPDX-License-Identifier: Apache-2.0
"""What `brainshift bridge` says of a field, and whether the field may be shown.

A label comes twice. As metadata of every message (in Slicer: attributes `OpenIGTLink.<key>` of the node) it belongs to
the data that it came with. As JSON in the device `brainshift_state` it is the bridge's newest word.
A field is shown only when both agree and the newest word is young enough.
"""
from __future__ import annotations

import enum
import json
import math
import time
from dataclasses import dataclass
from typing import Any, Callable, Mapping, Optional

KEYS = ("sequence", "session_id", "model_id", "case_id", "quality", "flags", "currency", "reason", "age_ms", "direction",
        "recorded", "method", "boundary", "blank", "has_sd", "grid_error_mm", "spacing_mm", "fade_mm")
OPTIONAL_KEYS = ("has_known",)  # of newer bridges
ATTRIBUTE_PREFIX = "OpenIGTLink."  # how SlicerOpenIGTLink names the attribute of a metadata entry
LONGEST_STATE = 65536  # characters; the bridge needs less than a thousand
QUALITIES = ("good", "caution", "unusable", "none")
# The words of client/lib/field_status.hpp. Of a field that is superseded a newer one is a moment away, an aged one has old
# data; they are shown in amber. The bridge blanks the field in place of the others.
CURRENCIES = ("current", "superseded", "aged", "expired", "degraded", "stale", "none")
SHOWN_CURRENCIES = ("current", "superseded", "aged")
# The state travels in front of its field. Until the field has come, the one before it is shown, for so long at most.
BEHIND_S = 0.5
NO_SESSION = ("", "0")
DIRECTION = "modeling"  # u moves undeformed -> deformed: Slicer's "to parent"


def boot_time() -> float:
    """A monotonic clock, s, that runs while the computer sleeps where there is one."""
    if hasattr(time, "CLOCK_BOOTTIME"):
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()


class LabelError(ValueError):
    """One line that names the key and the value."""


@dataclass(frozen=True)
class Label:
    sequence: int
    session_id: str
    model_id: str
    case_id: str
    quality: str
    flags: str
    currency: str
    reason: str
    age_ms: Optional[float]  # since its data were acquired, when the label was written; None: not known
    direction: str
    recorded: bool  # a recording is played: the field is not the patient's now
    method: str
    boundary: str
    blank: bool   # the volumes are zero and the surfaces undeformed, since there is nothing to be shown
    has_sd: bool  # False: the standard deviations are zero because nobody sent any
    has_known: bool  # False: the same of how much the data say
    grid_error_mm: Optional[float]  # largest difference between grid and mesh at a node
    spacing_mm: Optional[float]
    fade_mm: Optional[float]  # before the grid's rim; the field is that of the mesh farther inside only


def parse_state(text: str) -> Label:
    """The JSON of `brainshift_state`. Raises LabelError."""
    if len(text) > LONGEST_STATE:
        raise LabelError(f"brainshift_state: {len(text)} characters, more than {LONGEST_STATE}")
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        raise LabelError(f"brainshift_state: not JSON: {text[:40]!r}") from None
    if not isinstance(values, dict):
        raise LabelError("brainshift_state: not a JSON object")
    return _label(values)


def parse_metadata(get: Callable[[str], Optional[str]]) -> Optional[Label]:
    """The attributes of a node (`get` is its GetAttribute). None where there are none at all, as after a message
    of OpenIGTLink version 1. Raises LabelError when some are missing or make no sense."""
    found = {key: get(ATTRIBUTE_PREFIX + key) for key in KEYS + OPTIONAL_KEYS}
    present = {key: value for key, value in found.items() if value is not None}
    return _label(present) if present else None


def _label(values: Mapping[str, Any]) -> Label:
    for key in KEYS:
        if key not in values:
            raise LabelError(f"{key}: missing")
    return Label(
        sequence=_count("sequence", values["sequence"]),
        session_id=_text("session_id", values["session_id"]),
        model_id=_text("model_id", values["model_id"]),
        case_id=_text("case_id", values["case_id"]),
        quality=_word("quality", values["quality"], QUALITIES),
        flags=_text("flags", values["flags"]),
        currency=_word("currency", values["currency"], CURRENCIES),
        reason=_text("reason", values["reason"]),
        age_ms=_length("age_ms", values["age_ms"]),
        direction=_text("direction", values["direction"]),
        recorded=_truth("recorded", values["recorded"]),
        method=_text("method", values["method"]),
        boundary=_text("boundary", values["boundary"]),
        blank=_truth("blank", values["blank"]),
        has_sd=_truth("has_sd", values["has_sd"]),
        has_known=_truth("has_known", values.get("has_known", False)),
        grid_error_mm=_length("grid_error_mm", values["grid_error_mm"]),
        spacing_mm=_length("spacing_mm", values["spacing_mm"]),
        fade_mm=_length("fade_mm", values["fade_mm"]))


def _text(key: str, value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise LabelError(f"{key}: {value!r} is no text")
    return str(value)


def _word(key: str, value: Any, words: tuple[str, ...]) -> str:
    if value not in words:
        raise LabelError(f"{key}: {value!r} is none of {', '.join(words)}")
    return str(value)


def _truth(key: str, value: Any) -> bool:
    if isinstance(value, bool):
        return value
    if value not in ("true", "false"):  # as metadata writes it
        raise LabelError(f"{key}: {value!r} is neither true nor false")
    return bool(value == "true")


def _count(key: str, value: Any) -> int:
    try:
        if isinstance(value, (bool, float)):
            raise ValueError
        number = int(value)
    except (TypeError, ValueError):
        raise LabelError(f"{key}: {value!r} is no whole number") from None
    if number < 0:
        raise LabelError(f"{key}: {number} is negative")
    return number


def _length(key: str, value: Any) -> Optional[float]:
    if value is None or value == "unknown":  # in JSON and in metadata
        return None
    try:
        if isinstance(value, bool):
            raise ValueError
        number = float(value)
    except (TypeError, ValueError):
        raise LabelError(f"{key}: {value!r} is no number") from None
    if not math.isfinite(number) or number < 0.0:
        raise LabelError(f"{key}: {number} is not finite and >= 0")
    return number


class Light(enum.Enum):
    GREEN = "green"
    AMBER = "amber"  # shown, with a reservation
    RED = "red"      # not shown


@dataclass(frozen=True)
class Verdict:
    light: Light
    reason: str  # one line; empty when green

    @property
    def show(self) -> bool:
        return self.light is not Light.RED


def may_be_shown(field: Optional[Label], state: Optional[Label], pinned_model: str, heard_s: float, lease_s: float,
                 behind_s: float) -> Verdict:
    """Whether a field may be shown, of what is known of it.

    field: label of the field that arrived last. state: the bridge's newest word. pinned_model: the model that the user
    confirmed; empty before that. heard_s: seconds since the newest word came; infinite or NaN where none came. behind_s: for how long field and state have
    been of different updates; counts only when they are.
    """
    reason = _refusal(field, state, pinned_model, heard_s, lease_s, behind_s)
    if reason:
        return Verdict(Light.RED, reason)
    assert field is not None and state is not None
    reasons = []
    if state.recorded or field.recorded:
        reasons.append("RECORDED, not the patient now")
    if field.sequence != state.sequence:
        return Verdict(Light.AMBER, "; ".join([*reasons, "the next field is on its way"]))
    if state.currency != "current":
        word = f"{state.currency}: {state.reason}" if state.reason else state.currency
        return Verdict(Light.AMBER, "; ".join([*reasons, word]))
    if "late" in field.flags.split("+"):
        reasons.append("answered late: it took more than twice what is usual")
    if "caution" in (field.quality, state.quality):
        reasons.append(state.reason or field.reason or state.flags or "to be used with caution")
    if reasons:
        return Verdict(Light.AMBER, "; ".join(reasons))
    return Verdict(Light.GREEN, "")


def _refusal(field: Optional[Label], state: Optional[Label], pinned_model: str, heard_s: float, lease_s: float,
             behind_s: float) -> str:
    if state is None:
        return "nothing was heard from the bridge"
    if not heard_s <= lease_s:  # NaN is refused as well
        return f"nothing was heard from the bridge for {heard_s:.1f} s"
    if not pinned_model:
        return f"confirm that model {state.model_id or '(none)'} belongs to this patient"
    for label in (state,) if field is None else (state, field):
        if label.model_id != pinned_model:
            return f"the field belongs to model {label.model_id or '(none)'}, the scene to model {pinned_model}"
    for label in (state,) if field is None else (state, field):
        if label.currency not in SHOWN_CURRENCIES:
            return label.reason or f"the field is {label.currency}"
        if label.blank:
            return label.reason or "the field is blank"
        if label.quality not in ("good", "caution"):
            return label.reason or f"the field is {label.quality}"
        if label.direction != DIRECTION:
            return f"the direction is {label.direction!r}, not {DIRECTION!r}"
    if field is None:
        return "the field came without metadata, or none came: the module needs OpenIGTLink version 2"
    if field.session_id in NO_SESSION or field.session_id != state.session_id:
        return f"the field belongs to session {field.session_id or '(none)'}, not to {state.session_id or '(none)'}"
    if field.sequence != state.sequence and not behind_s <= BEHIND_S:
        return f"the field is that of update {field.sequence}, the bridge is at {state.sequence}"
    return ""


def belongs(label: Optional[Label], field: Label, behind_s: float) -> bool:
    """Whether other data (sd, a surface) may be shown with the field: of the same update, or, while those of its update
    travel behind it, of another one of the session."""
    if label is None or (label.model_id, label.session_id) != (field.model_id, field.session_id) or label.blank:
        return False
    return label.sequence == field.sequence or behind_s <= BEHIND_S
