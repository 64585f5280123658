# SPDX-License-Identifier: Apache-2.0
"""What travels, as plain values.

Coordinates are patient RAS in millimetres. Points are arrays (n, 3), a row per point. A displacement
moves an undeformed point to its deformed place.
"""
from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, ClassVar, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Indices = NDArray[np.int32]


def _brief(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{list(value.shape)}" if value.size > 4 else str(value.tolist())
    return f"<{len(value)}>" if isinstance(value, (list, tuple)) and len(value) > 4 else repr(value)


class Brief:
    """Shown on one line: of an array its type and shape. For dataclasses with repr=False."""

    def __repr__(self) -> str:
        values = self.__dict__.items()
        return f"{type(self).__name__}({', '.join(f'{name}={_brief(value)}' for name, value in values)})"


@dataclass(frozen=True)
class SessionKey:
    """Tells one session from every other, of this and of any daemon."""

    boot_id: int = 0  # of the daemon's process
    session_id: int = 0  # from 1; 0: none is running
    model_id: str = ""  # hash of the loaded model


class Phase(enum.IntEnum):
    EMPTY = 1  # no session
    PREPARING = 2
    READY = 3  # no observation has been answered yet
    TRACKING = 4  # the newest observation gave a usable field
    DEGRADED = 5  # the newest observation gave none; the field before it stays
    CLOSED = 6  # the daemon is stopping


@dataclass(frozen=True)
class SessionState:
    MOST_VALID_MS: ClassVar[int] = 10_000  # a daemon that says more is refused

    session: SessionKey
    phase: Phase
    newest_update: int  # sequence; 0: none
    newest_usable: int  # sequence; 0: none
    age_ms: float  # since the observation that newest_usable answers was acquired, on the daemon's clock
    valid_ms: int  # how long the answer holds, from the moment at which it was asked for
    reason: str  # why the session is degraded, else empty
    preparing: bool  # another session is being prepared
    aged_after_ms: int = 0  # above it a field is aged; 0: no limit
    expired_after_ms: int = 0  # above it a field has expired: not to be shown; 0: no limit
    recorded: bool = False  # a recording is played: no field of it is live
    method: str = ""  # of the session
    boundary: str = ""  # of the session


@dataclass(frozen=True)
class Status:
    version: str
    model_ready: bool
    case_id: str
    model_id: str
    busy: bool
    updates: int
    uptime_ms: int
    build: str
    machine: str
    blas_kernel: str


@dataclass(frozen=True)
class Session:
    key: SessionKey
    nodes: int
    tets: int
    slaves: int
    prepare_s: float
    model_bytes: int


@dataclass(frozen=True, repr=False)
class Surface(Brief):
    vertices: Floats  # (n, 3), mm
    triangles: Indices  # (m, 3), counter-clockwise from outside


@dataclass(frozen=True, repr=False)
class Model:
    """The undeformed brain that displacements belong to."""

    case_id: str
    model_id: str
    nodes: Floats  # (n, 3), mm
    tets: Indices  # (m, 4), positively oriented
    boundary: Indices  # (b, 3), outward
    skull: Surface
    tumour: Surface
    craniotomy: Indices  # nodes
    brainstem: Indices
    slaves: Indices  # nodes that may touch the skull
    fixed: Indices
    gravity_direction: Floats  # (3,), unit
    fluid_plane_depth_mm: float  # x . gravity_direction
    slave_plane_depth_mm: float
    tet_labels: Optional[Indices]  # (m,), 0: brain
    septa: Indices  # (s, 3), falx and tentorium from either side, out of the tissue; none without labels
    ventricles: Indices  # (w, 3), wall of the cavities, out of the tissue; none without labels

    def __repr__(self) -> str:
        return (f"Model(case {self.case_id!r}, model {self.model_id}, {len(self.nodes)} nodes, {len(self.tets)} tetrahedra, "
                f"{len(self.slaves)} slaves)")

    def to_meshio(self, update: Optional[Update] = None) -> Any:
        """The mesh as a meshio.Mesh, undeformed, with an update's field as point data.

        Point data: displacement_mm (n, 3) and, when the update has them, sd_mm and known (n,). ValueError
        when the update is of another model or has no whole field. Needs the package meshio.
        """
        import meshio

        cell_data = {} if self.tet_labels is None else {"label": [self.tet_labels]}
        point_data = {} if update is None else update.point_data(self)
        return meshio.Mesh(self.nodes, [("tetra", self.tets)], point_data=point_data, cell_data=cell_data)


# ---------- observations ----------


@dataclass(frozen=True, repr=False)
class TumourBoundary(Brief):
    """Traced in tracked ultrasound. points: (n, 3), deformed, mm; sd_mm: per component."""

    points: ArrayLike
    sd_mm: float


@dataclass(frozen=True, repr=False)
class CorticalSurface(Brief):
    """The exposed cortex. vertices: (n, 3), deformed, mm; triangles: (m, 3) or None."""

    vertices: ArrayLike
    sd_mm: float
    triangles: Optional[ArrayLike] = None


@dataclass(frozen=True, repr=False)
class LandmarkPairs(Brief):
    """The same places before and after, (n, 3) each, mm; sd_mm: per component."""

    undeformed: ArrayLike
    deformed: ArrayLike
    sd_mm: float


@dataclass(frozen=True)
class PatientPose:
    gravity_direction: ArrayLike  # (3,), unit
    fluid_level_mm: Optional[float] = None


Body = Union[TumourBoundary, CorticalSurface, LandmarkPairs, PatientPose]


@dataclass(frozen=True)
class Observation:
    case_id: str
    source: str  # e.g. "ius", "stereopsis", "pointer"
    sequence: int  # counts up per source, from 1
    body: Body
    acquired_ns: int = 0  # monotonic clock of the source
    acquired_wall_ns: int = 0  # UTC since the epoch; metadata
    session: SessionKey = field(default_factory=SessionKey)  # empty: the client's
    sent_ns: int = 0  # the source's monotonic clock at hand-over; 0: not stated


@dataclass(frozen=True)
class Receipt:
    observation_sequence: int
    replaced_pending: bool  # it replaced one of its source that had not been begun


# ---------- what of every field a viewer wants ----------


@dataclass(frozen=True)
class Ball:
    centre_mm: ArrayLike  # (3,)
    radius_mm: float


@dataclass(frozen=True)
class NearTumour:
    margin_mm: float


@dataclass(frozen=True)
class Choice:
    """region: nodes whose undeformed place lies in it; None: all. spacing_mm: 0 for every node."""

    region: Union[Ball, NearTumour, None] = None
    spacing_mm: float = 0.0
    without_sd: bool = False  # neither sd_mm nor known


# ---------- updates ----------


class Quality(enum.IntEnum):
    """Whether a field may be used. The daemon's verdict; status speaks of the algorithm."""

    UNSPECIFIED = 0  # not judged: an iterate
    GOOD = 1
    CAUTION = 2
    UNUSABLE = 3  # never replaces the last usable field


class QualityFlag(enum.IntEnum):
    MISFIT_UNEXPLAINED = 1
    STRENGTH_AT_BOUND = 2
    SOURCES_CONTRADICT = 3
    DATA_OUTSIDE_REGION = 4
    DEADLINE = 5
    CONTACT_NOT_CERTIFIED = 6
    ITERATION_LIMIT = 7
    MOSTLY_PRIOR = 8  # the data say little about the region of surgery
    INVERTED_ELEMENTS = 17
    VOLUME_LOST = 18
    BEYOND_SKULL = 19
    NOT_FINITE = 20


@dataclass(frozen=True)
class MeanStd:
    mean_mm: float
    std_mm: float


@dataclass(frozen=True, repr=False)
class Contact(Brief):
    active: int  # slaves that carry a force
    penetrating: int  # slaves deeper than 0.01 mm
    max_penetration_mm: float
    iterations: int
    active_slaves: Indices  # nodes
    force_n: Singles  # per active slave; positive pushes the brain inwards
    decrement: Optional[float]  # certificate, in posterior standard deviations
    max_violation_mm: Optional[float]


@dataclass(frozen=True)
class Timings:
    register_ms: float
    invert_ms: float
    rebuild_ms: float
    encode_ms: float
    journal_ms: float


@dataclass(frozen=True)
class AnswerTime:
    """From the arrival of the observation at the daemon until its answer was encoded."""

    ms: float
    usual_ms: float  # median over the earlier answers of the session; 0: too few yet
    late: bool  # ms > 2 usual_ms: the brain may have moved since
    age_ms: float = 0.0  # since its data were acquired, by the daemon's clock, when it was encoded


@dataclass(frozen=True)
class Omission:
    part: str
    reason: str
    estimated_error: str  # carries its own unit


@dataclass(frozen=True)
class SourceSummary:
    source: str
    observation_sequence: int
    age_s: float
    data: int
    outliers: int
    consistent: bool
    chi_square: Optional[float]
    degrees_of_freedom: Optional[float]
    p_value: Optional[float]


@dataclass(frozen=True)
class PriorStrength:
    part: str
    mean: float  # in units of the case's standard deviation
    absent: float  # probability
    at_bound: bool


@dataclass(frozen=True, repr=False)
class Update:
    """The answer to an observation: a field, or why there is none."""

    case_id: str
    session: SessionKey
    sequence: int  # per session, from 1
    observation_sequence: int
    method: str
    boundary: str
    final: bool  # False: an iterate, a provisional field
    status: str  # "converged", "iteration_limit", "deadline", "iterating", "not_run", "failed"
    reason: str
    error_code: str  # set when status is "failed"
    displacement_mm: Optional[Singles]  # (n, 3)
    sd_mm: Optional[Singles]  # (n,)
    known: Optional[Singles]  # (n,): share of the standard deviation that the data took away; 0: a guess, 1: known
    nodes: Optional[Indices]  # of the mesh that the rows are of; None: all, in order
    mesh_nodes: Optional[int]  # nodes of the whole mesh, with `nodes`
    quality: Quality
    quality_flags: tuple[QualityFlag, ...]
    quality_reason: str
    contact: Optional[Contact]
    initial_misfit: Optional[MeanStd]
    misfit: Optional[MeanStd]
    timings: Timings
    answer_time: AnswerTime
    left_out: tuple[Omission, ...]
    sources: tuple[SourceSummary, ...]
    prior_strengths: tuple[PriorStrength, ...]
    min_volume_ratio: Optional[float]  # smallest det F
    inverted_elements: int
    misfit_ratio: Optional[float]  # 1: data as far off as their errors say
    data_outside_region: int
    region_known: Optional[float]  # mean of known over the region of surgery
    ventricle_change_mm3: Optional[float]  # by how much the ventricles have grown; None: the model has none
    received_s: float = 0.0  # when this client received it, by currency.boot_time()

    def __repr__(self) -> str:
        about = [f"{self.sequence} of observation {self.observation_sequence}", self.method, self.boundary]
        about.append(self.quality.name.lower() if self.final and not self.failed else self.status)
        if self.displacement_mm is not None and len(self.displacement_mm):
            about.append(f"{len(self.displacement_mm)} nodes, up to {np.linalg.norm(self.displacement_mm, axis=1).max():.2f} mm")
        if why := self.quality_reason or (self.reason if self.failed else ""):
            about.append(repr(why))
        return f"Update({', '.join(about)})"

    @property
    def failed(self) -> bool:
        return self.status == "failed"

    @property
    def usable(self) -> bool:
        """Whether the field may be shown."""
        return self.final and not self.failed and self.quality in (Quality.GOOD, Quality.CAUTION)

    def point_data(self, model: Model) -> dict[str, Any]:
        """displacement_mm, sd_mm and known for every node of the model; ValueError when it has not all."""
        if self.session.model_id != model.model_id:
            raise ValueError(f"the update is of model {self.session.model_id}, this is {model.model_id}")
        if self.displacement_mm is None or len(self.displacement_mm) != len(model.nodes):
            raise ValueError("the update has no field for every node of the model")
        data: dict[str, Any] = {"displacement_mm": self.displacement_mm}
        if self.sd_mm is not None:
            data["sd_mm"] = self.sd_mm
        if self.known is not None:
            data["known"] = self.known
        return data


class Currency(enum.Enum):
    NONE = "none"  # there is no usable field of the running session
    CURRENT = "current"  # the newest usable one; every observation since is answered by it
    SUPERSEDED = "superseded"  # a newer usable one is on its way
    DEGRADED = "degraded"  # the newest usable one, but a newer observation gave none
    STALE = "stale"  # nothing is known of the daemon any more: it may be older than it looks
    AGED = "aged"  # the newest usable one, but older than the daemon's first limit: show it with that word
    EXPIRED = "expired"  # older than the second limit: not to be shown


@dataclass(frozen=True)
class FieldStatus:
    currency: Currency
    reason: str  # one sentence to show; empty when current
    age_s: Optional[float]  # since its data were acquired; None: not known
    recorded: bool = False  # a recording is played: display the word RECORDED with its field
