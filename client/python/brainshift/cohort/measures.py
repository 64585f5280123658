# SPDX-License-Identifier: Apache-2.0
"""What a surgery is judged by: columns of the tables, from the runs of `brainshift replay`."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any



@dataclass(frozen=True)
class Measure:
    column: str
    path: tuple[str, ...]  # into an object of report.json
    units: str
    description: str
    better: str = ""       # lower, higher, or near 0.9; empty: not compared

    def loss(self, value: float) -> float:
        """Smaller is better."""
        return {"lower": value, "higher": -value}.get(self.better, abs(value - 0.9))

    def of(self, run: dict[str, Any]) -> float | None:
        value: Any = run
        for key in self.path:
            value = value.get(key) if isinstance(value, dict) else None
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
        return float(value) if number else None


MEASURES = (
    Measure("tumour_shift_mm", ("error_mm", "initial", "mean"), "mm", "how far the tumour truly moved, mean"),
    Measure("tumour_error_mm", ("error_mm", "cross", "mean"), "mm",
            "distance between estimate and truth at points of the tumour that were not measured, mean", "lower"),
    Measure("tumour_recovered_pct", ("recovery_pct",), "%", "100 (1 - tumour_error_mm / tumour_shift_mm)", "higher"),
    Measure("craniotomy_shift_mm", ("error_mm", "craniotomy_displacement_initial", "mean"), "mm",
            "how far the exposed surface truly moved, mean"),
    Measure("craniotomy_error_mm", ("error_mm", "craniotomy_displacement", "mean"), "mm",
            "distance between estimate and truth at the nodes of the exposed surface, mean", "lower"),
    Measure("field_error_p50_pct", ("field_error_pct", "p50"), "%",
            "distance between estimate and truth over all nodes, median, of the largest true displacement", "lower"),
    Measure("field_error_p99_pct", ("field_error_pct", "p99"), "%", "the same, 99th percentile", "lower"),
    Measure("largest_shift_mm", ("largest_true_displacement_mm",), "mm", "largest true displacement of a node"),
    Measure("coverage_90", ("coverage_90",), "1",
            "share of true displacement components inside the 90 % interval; 0.9 is right", "near 0.9"),
    Measure("region_known", ("region_known",), "1", "share of the standard deviation about the surgery that the data took away"),
    Measure("misfit_mm", ("error_mm", "sparse", "mean"), "mm", "misfit where data were measured, mean"),
    Measure("unusable_updates", ("quality", "counts", "unusable"), "1", "updates that may not be shown", "lower"),
)
COUNTS = (
    Measure("updates", ("updates",), "1", "updates of the surgery"),
    Measure("nodes", ("mesh", "nodes"), "1", "nodes of the mesh"),
    Measure("active_contacts", ("contact", "active"), "1", "nodes that touch the skull"),
    Measure("max_penetration_mm", ("contact", "max_penetration_mm"), "mm", "largest depth in the skull"),
)
TIMES = (
    Measure("prepare_s", ("prepare_s",), "s", "factors and condensed operators"),
    Measure("latency_p50_ms", ("latency_ms", "p50"), "ms", "observation to update, median"),
    Measure("latency_max_ms", ("latency_ms", "max"), "ms", "observation to update, longest"),
)

KEYS: dict[str, dict[str, object]] = {
    "participant_id": {"Description": "subject"},
    "session_id": {"Description": "session; n/a for datasets without sessions"},
    "surgery": {"Description": "scenario of the simulator, or the name of a recording"},
    "seed": {"Description": "seed of a simulated surgery; n/a for a recorded one"},
    "method": {"Description": "method of inversion"},
    "boundary": {"Description": "brain-skull boundary condition", "Levels": {"contact": "the brain may leave the skull",
                                                                              "fixed": "it slides along the skull"}},
}


def dictionary(measures: tuple[Measure, ...]) -> dict[str, dict[str, object]]:
    return {m.column: {"Description": m.description, "Units": m.units} for m in measures}


QUALITY: dict[str, object] = {"Description": "worst quality of the updates", "Levels": {
    "good": "no flag", "caution": "may be shown, with its flags", "unusable": "may not be shown", "not_judged": "no verdict"}}
SURGERIES = {**KEYS, "quality": QUALITY, **dictionary(MEASURES + COUNTS)}


def rows(result: dict[str, Any], measures: tuple[Measure, ...] = MEASURES + COUNTS) -> list[dict[str, object]]:
    """One for each run of a result file of `participant`."""
    made: list[dict[str, object]] = []
    for run in result["Runs"]:
        row: dict[str, object] = {"participant_id": result["ParticipantId"], "session_id": result["SessionId"],
                                  "surgery": result["Surgery"], "seed": result["Seed"], "method": run.get("method"),
                                  "boundary": run.get("boundary"), "quality": (run.get("quality") or {}).get("worst")}
        made.append({**row, **{m.column: m.of(run) for m in measures}})
    return made


def order(row: dict[str, object]) -> tuple[str, ...]:
    seed = row["seed"]
    return (*(str(row[key] or "") for key in ("participant_id", "session_id", "surgery")),
            f"{seed:020d}" if isinstance(seed, int) else "", str(row["method"]), str(row["boundary"]))
