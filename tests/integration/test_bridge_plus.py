# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in for PlusServer plays recorded sequences, in the manners in which PlusServer was seen to send; the bridge makes of
them the points that `brainshift import` makes of the files, as the daemon's journal holds them.

PLUS's own recordings need the folder tracked_ultrasound_plus of BRAINSHIFT_EXTERNAL_DATA (PlusLibData, BSD-3); skipped without it.
"""
import os
import pathlib
import xml.etree.ElementTree as ElementTree

import igtl_peer
import numpy as np
import pytest
from igtl_peer import Listener
from programs import COARSE_CASE, LOCAL, TIMEOUT_FACTOR, Background, brainshift as command, good, serve, write
from recordings import Sequence, SurgeryFile, chain, matrix, matrix_text, motion

import brainshift

TUMOUR_MM = (46.0, -47.0, 9.0)  # of the coarse case

# name: (recording, device set, frame of the images, tolerance: a half unit in the last place of a float, at the tracker's
# distance, in rotation and place of two links, 4 * sqrt(3) * 6e-8 * distance)
RECORDINGS = {
    "Spine": ("SpinePhantomFreehand.igs.mha", "PlusDeviceSet_SpinePhantomFreehandReconstructionOnly.xml", "Image", 2e-4),
    "Nwire": ("NwirePhantomFreehandCropped.igs.mha", "PlusDeviceSet_NwirePhantomFreehand_vtkVolumeReconstructorTest2.xml",
              "CroppedImage", 8e-4),
}


def quadrangles(frames):
    """On every image another: rows of frame, u, v."""
    for frame in range(frames):
        size = 30.0 + frame
        for u, v in ((0.0, 0.0), (size, 3.0), (size + 5.0, size), (2.0, size)):
            yield frame, 40.25 + u, 50.5 + v


def registration(recording, device, image_frame):
    """Takes the corners to the tumour, so that `brainshift import` accepts them."""
    constants = {f"{one.get('From')}To{one.get('To')}": matrix(one.get("Matrix"))
                 for one in ElementTree.parse(device).iter("Transform") if one.get("Matrix")}
    places = []
    for frame, u, v in quadrangles(len(recording.frames)):
        links = {name: T for name, (T, valid) in recording.links(frame).items() if valid}
        if {"ProbeToTracker", "ReferenceToTracker"} <= set(links):
            places.append((chain({**constants, **links}, image_frame, "Reference") @ (u, v, 0.0, 1.0))[:3])
    T = motion((1, 2, 3), 0.4)
    T[:3, 3] = TUMOUR_MM - T[:3, :3] @ np.mean(places, axis=0)
    return matrix_text(T)


def points_of(path):
    with brainshift.Surgery(path) as surgery:
        (observation,) = surgery.observations()
    return np.asarray(observation.body.points)


def messages(recording, skipped=(), tdata=False):
    """As PlusServer sends: for every frame the image and then the transforms, or one TDATA of all, with the frame's time.

    skipped: images that it leaves out when it has much to send.
    """
    for frame, fields in enumerate(recording.frames):
        seconds = float(fields["Timestamp"])
        if frame not in skipped:
            yield igtl_peer.image("Image_Reference", recording.size, recording.image(frame), seconds)
        if tdata:
            yield igtl_peer.tracking_data(recording.links(frame), seconds)
            continue
        for name, (T, valid) in recording.links(frame).items():
            yield igtl_peer.transform(name, T, valid, seconds)


def streamed(folder, model, to_send, images, options):
    """The points that the bridge hands to the daemon, from the daemon's journal."""
    to_send = list(to_send)
    (folder / "journal").mkdir()
    with serve(folder, LOCAL + f"journal_dir: {folder / 'journal'}\n", model=model) as daemon, Listener() as plus:
        with brainshift.connect(daemon.address) as console:
            console.start_session()
            console.subscribe(16)
            with Background("brainshift", "bridge", "--endpoint", daemon.address, "--listen", "127.0.0.1:0", "--from",
                            f"127.0.0.1:{plus.port}", *options, log=folder / "bridge.log") as bridge:
                with plus.accept() as client:
                    greeting = client.receive()
                    assert greeting is not None and greeting.version == 2
                    for message in to_send:
                        client.send(message)
                    console.next_update(60.0 * TIMEOUT_FACTOR)
                assert bridge.end() == 0
                (told,) = [line for line in bridge.rest().splitlines() if "sweep" in line or "left out" in line]
                assert told.startswith(f"sweep of {images} images: ") and told.endswith(": accepted")
        assert daemon.end() == 0
    (journal,) = (folder / "journal").iterdir()
    assert len(SurgeryFile(journal).payloads("observation")) == 1
    return points_of(journal)


@pytest.mark.parametrize("played", RECORDINGS.values(), ids=RECORDINGS)
def test_plus_yields_the_points_of_import_to_single_precision(folder, inputs, record_property, played):
    data = os.environ.get("BRAINSHIFT_EXTERNAL_DATA")
    if data is None:
        pytest.skip("BRAINSHIFT_EXTERNAL_DATA is not set")
    plus = pathlib.Path(data) / "tracked_ultrasound_plus"
    file, device, image_frame, tolerance_mm = played
    recording = Sequence.read(plus / file)
    corners = list(quadrangles(len(recording.frames)))
    rows = "".join(f"{frame},{u},{v}\n" for frame, u, v in corners)
    timed = "".join(f"{recording.frames[frame]['Timestamp']},{u},{v}\n" for frame, u, v in corners)
    options = ("--device", plus / device, "--image", image_frame, "--registration",
               write(folder / "registration.txt", registration(recording, plus / device, image_frame)), "--contours")

    good(command("import", "--recording", plus / file, *options, write(folder / "contours.csv", "frame,u_px,v_px\n" + rows), "--case", COARSE_CASE, "--out", folder / "sweep.surgery"))
    from_file = points_of(folder / "sweep.surgery")
    from_stream = streamed(folder, inputs / "head" / "model.h5", messages(recording), len(recording.frames),
                           (*options, write(folder / "timed.csv", "time_s,u_px,v_px\n" + timed), "--relative-times"))
    assert from_stream.shape == from_file.shape
    assert len(from_file) > 1000
    worst_mm = np.linalg.norm(from_stream - from_file, axis=1).max()
    record_property("worst_mm", worst_mm)
    assert worst_mm < tolerance_mm


@pytest.mark.parametrize("tdata", (False, True), ids=("transforms", "tdata"))
def test_skipped_images_and_long_names_change_no_point(folder, inputs, tdata):
    """PlusServer left 18 of 216 images out, cut names at 20 characters, and sent tools of which one is out of sight."""
    sweep = inputs / "sweep"
    recording = Sequence.read(sweep / "sweep.igs.mha")
    recording.frames = [{name.replace("Probe", "UltrasoundProbe"): value for name, value in frame.items()}
                        for frame in recording.frames]
    device = write(folder / "device.xml", (sweep / "device.xml").read_text().replace("Probe", "UltrasoundProbe"))
    skipped = {frame for frame in range(len(recording.frames)) if frame % 12 == 7}
    assert "UltrasoundProbeToTracker" in recording.links(0) and skipped
    rows = [line.split(",") for line in (sweep / "contours.csv").read_text().splitlines()[1:]]
    kept = [row for row in rows if int(row[0]) not in skipped]
    options = ("--registration", sweep / "registration.txt", "--device", device)
    file = write(folder / "sweep.igs.mha", recording.text())
    counted = write(folder / "contours.csv", "frame,u_px,v_px\n" + "".join(",".join(row) + "\n" for row in kept))
    good(command("import", "--recording", file, *options, "--contours", counted, "--case", COARSE_CASE, "--out",
                 folder / "sweep.surgery"))
    timed = write(folder / "timed.csv", "time_s,u_px,v_px\n" + "".join(
        f"{recording.frames[int(frame)]['Timestamp']},{u},{v}\n" for frame, u, v in rows if int(frame) not in skipped))
    from_stream = streamed(folder, inputs / "head" / "model.h5", messages(recording, skipped, tdata),
                           len(recording.frames) - len(skipped), (*options, "--contours", timed, "--relative-times"))
    from_file = points_of(folder / "sweep.surgery")
    assert from_stream.shape == from_file.shape and len(from_file) > 500
    assert np.linalg.norm(from_stream - from_file, axis=1).max() < 4.0 * np.sqrt(3.0) * 6e-8 * 2000.0
