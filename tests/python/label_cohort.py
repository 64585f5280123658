# SPDX-License-Identifier: GPL-3.0-or-later
"""label_cohort.py LABELS OUT [--subjects N]: a BIDS dataset of the heads in a folder of label maps (FreeSurfer's numbers).

Beyond the number of maps a subject is a mirrored head: the map of another one with left for right. The T1w image is made of
the labels, a grey value for each; LABELS/*.nii.gz are only read. Tumours are left to `brainshift-bids --simulated-tumour`.
"""
import argparse
import json
import pathlib

import bids_tree
import numpy as np

from brainshift.cohort import nifti

# What the dataset's dseg.tsv calls them; 24 is the fluid between brain and skull, from 500 on lies what is outside of it.
NAMES = {2: "left white matter", 41: "right white matter", 3: "left cortex", 42: "right cortex", 7: "left cerebellum white matter",
         8: "left cerebellum cortex", 46: "right cerebellum white matter", 47: "right cerebellum cortex", 16: "brainstem",
         4: "left lateral ventricle", 43: "right lateral ventricle", 14: "third ventricle", 15: "fourth ventricle", 24: "extra-cerebral fluid"}
GREY = {2: 110, 41: 110, 7: 105, 46: 105, 3: 75, 42: 75, 8: 75, 47: 75, 16: 100, 4: 20, 43: 20, 14: 20, 15: 20, 24: 20}


def subject(bids, label, source, mirrored):
    image = nifti.read(source)
    labels = image.values.astype("int16")
    affine = image.affine[:3].copy()
    if mirrored:
        affine[0] = -affine[0]
    brain = np.argwhere((labels > 0) & (labels < 500))
    low, high = brain.min(axis=0) - 4, brain.max(axis=0) + 5
    assert low.min() >= 0, f"{source}: the brain touches the edge of the image"
    labels = np.ascontiguousarray(labels[tuple(slice(a, b) for a, b in zip(low, high))])
    affine[:, 3] += affine[:, :3] @ low
    grey = np.full(labels.max() + 1, 60, "int16")
    grey[0] = 0
    for number, value in GREY.items():
        grey[number] = value
    where = f"sub-{label}/anat/sub-{label}"
    bids_tree.put(bids / f"{where}_T1w.nii.gz", grey[labels], affine)
    bids_tree.put(bids / "derivatives" / "labels" / f"{where}_dseg.nii.gz", labels, affine)
    return set(np.unique(labels)) - {0}


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("labels", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--subjects", type=int, default=20)
    options = parser.parse_args()
    maps = sorted(options.labels.glob("*.nii.gz"))
    if not 0 < options.subjects <= 2 * len(maps):
        parser.error(f"{options.labels} has {len(maps)} label maps: {options.subjects} subjects cannot be made of them")
    bids_tree.dataset(options.out)
    occurring = set()
    for i in range(options.subjects):
        occurring |= subject(options.out, f"{i + 1:02d}", maps[i % len(maps)], i >= len(maps))
    beside = options.out / "derivatives" / "labels"
    rows = [f"{n}\t{NAMES.get(n, 'extra-cerebral tissue' if n >= 500 else 'grey matter')}" for n in sorted(occurring)]
    (beside / "dseg.tsv").write_text("index\tname\n" + "\n".join(rows) + "\n")
    (beside / "dataset_description.json").write_text(json.dumps(
        {"Name": "labels", "BIDSVersion": "1.8.0", "DatasetType": "derivative", "GeneratedBy": [{"Name": "label_cohort.py"}]}))


if __name__ == "__main__":
    main()
