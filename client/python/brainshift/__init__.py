# SPDX-License-Identifier: Apache-2.0
"""Client of brainshiftd: how a brain has moved during surgery, as numpy arrays.

    import brainshift

    with brainshift.connect("tcp://127.0.0.1:5555") as client:
        client.start_session()
        model = client.model()                                   # model.nodes: (n, 3), RAS, mm
        client.subscribe()
        client.submit(brainshift.TumourBoundary(points, sd_mm=0.5), source="ius")
        update = client.next_update(timeout_s=10)
        if update.usable:
            moved = model.nodes + update.displacement_mm         # (n, 3), mm
            print(update.quality.name, client.field_status())

Research software for simulation, replay and laboratory use: no medical device.
"""
from .client import Client, connect
from .errors import Error, ProtocolError, Unavailable
from .field import Field, FieldMesh, FieldValues, Undeformed
from .keys import Keys, read_keys
from .surgery import Surgery
from .values import (AnswerTime, Ball, Choice, Contact, CorticalSurface, Currency, FieldStatus, LandmarkPairs, MeanStd, Model,
                     NearTumour, Observation, Omission, PatientPose, Phase, PriorStrength, Quality, QualityFlag,
                     Receipt, Session, SessionKey, SessionState, SourceSummary, Status, Surface, Timings,
                     TumourBoundary, Update)

__all__ = [
    "AnswerTime", "Ball", "Choice", "Client", "Contact", "CorticalSurface", "Currency", "Error", "Field", "FieldMesh",
    "FieldStatus", "FieldValues", "Keys", "LandmarkPairs", "MeanStd", "Model", "NearTumour", "Observation", "Omission", "PatientPose", "Phase",
    "PriorStrength", "ProtocolError", "Quality", "QualityFlag", "Receipt", "Session", "SessionKey", "SessionState",
    "SourceSummary", "Status", "Surface", "Surgery", "Timings", "TumourBoundary", "Unavailable", "Undeformed", "Update",
    "connect", "read_keys",
]
__version__ = "0.1.0"
