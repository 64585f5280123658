#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends a recorded surgery to a running daemon and draws the field that it answers with.

    python3 replay_surgery.py S.surgery --endpoint tcp://127.0.0.1:5555 --picture field.png --mesh field.vtu

Needs matplotlib for the picture and meshio for the mesh.
"""
from __future__ import annotations

import argparse
import sys

import numpy as np

import brainshift


def play(client: brainshift.Client, surgery: brainshift.Surgery) -> brainshift.Update | None:
    """Sends every observation and waits for its answer; the last usable update."""
    client.subscribe(window=16)
    for observation in surgery.observations():
        client.submit_observation(observation)
        update = client.next_update(timeout_s=60)
        while not update.final:
            update = client.next_update(timeout_s=60)
        if update.failed:
            print(f"{observation.source} {observation.sequence}: {update.reason}")
            continue
        length = np.linalg.norm(update.displacement_mm, axis=1)
        print(f"{observation.source} {observation.sequence}: {update.quality.name.lower()}, largest motion "
              f"{length.max():.2f} mm, sd up to {update.sd_mm.max():.2f} mm, {update.timings.invert_ms:.0f} ms")
    return client.latest_usable


def draw(model: brainshift.Model, update: brainshift.Update, file: str) -> None:
    """Two axial views of the nodes near the tumour's centre: motion and standard deviation."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    height = model.tumour.vertices[:, 2].mean()
    near = np.abs(model.nodes[:, 2] - height) < 8.0
    right, front = model.nodes[near, 0], model.nodes[near, 1]
    u, sd = update.displacement_mm[near], update.sd_mm[near]
    figure, axes = plt.subplots(1, 2, figsize=(11, 5.5), sharex=True, sharey=True, constrained_layout=True)
    for axis, colours, arrows, label in ((axes[0], np.linalg.norm(u, axis=1), True, "displacement (mm)"),
                                         (axes[1], sd, False, "standard deviation (mm)")):
        dots = axis.scatter(right, front, c=colours, s=60, cmap="viridis", vmin=0.0)
        if arrows:
            axis.quiver(right, front, u[:, 0], u[:, 1], angles="xy", scale_units="xy", scale=0.25, width=0.003)
        axis.plot(*model.tumour.vertices[:, :2].T, ",", color="black", alpha=0.3)
        axis.set_aspect("equal")
        axis.set_xlabel("R (mm, towards the patient's right)")
        figure.colorbar(dots, ax=axis, label=label, shrink=0.8)
    axes[0].invert_xaxis()  # of both: the patient's right is on the left, as in all pictures of brainshift
    axes[0].set_ylabel("A (mm, towards the front)")
    axes[0].set_title("motion; arrows drawn 4x")
    axes[1].set_title("its standard deviation")
    figure.suptitle(f"{update.case_id}: nodes within 8 mm of S = {height:.0f} mm; quality {update.quality.name.lower()}")
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surgery")
    parser.add_argument("--endpoint", default="tcp://127.0.0.1:5555")
    parser.add_argument("--takeover", action="store_true", help="end a session that another connected client started")
    parser.add_argument("--picture", help="PNG file of the last usable field")
    parser.add_argument("--mesh", help="mesh file with the field, in any format that meshio writes")
    arguments = parser.parse_args()
    try:
        with brainshift.Surgery(arguments.surgery) as surgery, brainshift.connect(arguments.endpoint) as client:
            client.start_session(takeover=arguments.takeover, recorded_clock=True)
            model = client.model()
            update = play(client, surgery)
    except brainshift.Error as error:
        print(f"replay_surgery: {error.message}", file=sys.stderr)
        return 1
    if update is None:
        print("replay_surgery: no observation gave a usable field", file=sys.stderr)
        return 1
    if arguments.picture:
        draw(model, update, arguments.picture)
    if arguments.mesh:
        model.to_meshio(update).write(arguments.mesh)
    return 0


if __name__ == "__main__":
    sys.exit(main())
