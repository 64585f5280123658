# SPDX-License-Identifier: Apache-2.0
"""The case file of a subject: what the dataset says, what settings and plan say, and defaults for the rest.

Precedence, by top-level section of a case file (config/cases/colin27.yaml): the subject's plan, the
cohort's settings, then these defaults:

    craniotomy   where the ray from the brain's centre through the tumour's leaves the brain; a tumour
                 below the centre is opened from the side, one within 10 mm of it from above
    gravity      into the opening: the opening is uppermost
    brainstem    the lowest 6 mm of label 16 (FreeSurfer's brainstem), else of the column of 12 mm about
                 the middle of the brain; its mean, radius 14 mm
    condensed    deadline_ms 600000: results of a cohort must not depend on how busy the machine was

A case is JSON inside YAML, which YAML allows.
"""
from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import numpy.typing as npt

from . import nifti
from .files import Path, Refused
from .layout import Inputs, Labels

Mask = npt.NDArray[np.bool_]
Point = npt.NDArray[np.float64]
SECTION = re.compile(r"^([A-Za-z_][\w]*):")
BRAINSTEM = 16  # FreeSurfer


def sections(file: Path, forbidden: tuple[str, ...]) -> dict[str, str]:
    """Top-level sections of a YAML file as text."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        raise Refused(f"{file}: {error}") from None
    found: dict[str, str] = {}
    name = ""
    for number, line in enumerate(lines, 1):
        begins = SECTION.match(line)
        if begins:
            name = begins[1]
            if name in forbidden:
                raise Refused(f"{file}, line {number}: {name} is the subject's own and stands in no such file")
            if name in found:
                raise Refused(f"{file}, line {number}: {name} is there twice")
            found[name] = line
        elif name:
            found[name] += "\n" + line
        elif line.strip() and not line.lstrip().startswith("#") and line.strip() != "---":
            raise Refused(f"{file}, line {number}: a section of a case is expected, e.g. 'gravity:'")
    return found


def select(labels: Labels) -> tuple[Mask, nifti.Image]:
    image = nifti.read(labels.file)
    inside: Mask = np.isin(image.values, labels.labels) if labels.labels else image.values > 0
    if not inside.any():
        which = f"label {', '.join(map(str, labels.labels))}" if labels.labels else "voxel above 0"
        raise Refused(f"{labels.file.name} has no {which}")
    return inside, image


def inside(points: Point, mask: Mask, to_voxel: Point) -> Mask:
    index = np.rint(points @ to_voxel[:3, :3].T + to_voxel[:3, 3]).astype(int)
    valid: Mask = np.all((index >= 0) & (index < mask.shape), axis=1)
    found = np.zeros(len(points), dtype=bool)
    found[valid] = mask[tuple(index[valid].T)]
    return found


def exit_point(mask: Mask, affine: Point, start: Point, direction: Point) -> Point | None:
    """The last point of the ray inside the mask, in steps of half a millimetre up to 250 mm."""
    ray = start + np.arange(0.0, 250.0, 0.5)[:, None] * direction
    hit = np.flatnonzero(inside(ray, mask, np.linalg.inv(affine)))
    return ray[hit[-1]] if len(hit) else None


def outward(centre: Point, tumour: Point) -> Point:
    direction = tumour - centre
    direction[2] = max(direction[2], 0.0)
    length = float(np.linalg.norm(direction))
    return direction / length if length > 10.0 else np.array([0.0, 0.0, 1.0])


def rounded(point: Point) -> list[float]:
    return [round(float(x), 2) + 0.0 for x in point]


def build(name: str, inputs: Inputs, settings: dict[str, str], plan: dict[str, str], edge_mm: float | None,
          simulated_tumour: bool, folder: Path, memory_gib: float | None = None) -> tuple[str, dict[str, Any]]:
    """The case file's text, and what was decided and why. Writes a mask of the brain into the folder where
    the dataset has none. Refuses what no case can be made of."""
    own = {**settings, **plan}
    mask, image = select(inputs.brain)
    points = image.points(mask)
    size = points.max(axis=0) - points.min(axis=0)
    if size.max() < 60.0 or size.max() > 300.0:
        raise Refused(f"{inputs.brain.file.name}: a brain of {size[0]:.0f} x {size[1]:.0f} x {size[2]:.0f} mm")
    brain_file = inputs.brain.file
    if inputs.brain.labels:
        brain_file = folder / "brain.nii.gz"
        nifti.write_mask(brain_file, mask, image)
    centre: Point = points.mean(axis=0)
    told: dict[str, Any] = {}
    case: dict[str, Any] = {"case_id": name, "images": {"mri": str(inputs.image), "brain": str(brain_file)}}
    if edge_mm is not None and "mesh" not in own:
        case["mesh"] = {"generate": {"edge_mm": edge_mm}}

    about: Point | None = None
    if "tumour" in own:
        told["Tumour"] = "plan"
    elif inputs.tumour is not None:
        tumour, grid = select(inputs.tumour)
        about = grid.points(tumour).mean(axis=0)
        labels = list(inputs.tumour.labels) or [int(v) for v in np.unique(grid.values[tumour]) if v > 0]
        case["tumour"] = {"label_volume": {"file": str(inputs.tumour.file), "label": labels}}
        told["Tumour"] = f"{inputs.tumour.file.name}, labels {labels}"
    elif simulated_tumour:
        # Right, behind and above the brain's centre, 60 % of the way to its surface.
        direction = np.array([0.74, -0.44, 0.5]) / np.linalg.norm([0.74, -0.44, 0.5])
        surface = exit_point(mask, image.affine, centre, direction)
        depth = float(np.linalg.norm(surface - centre)) if surface is not None else 0.0
        if depth < 20.0:
            raise Refused(f"{inputs.brain.file.name}: no place for a simulated tumour, {depth:.0f} mm from centre to surface")
        place = centre + 0.6 * depth * direction
        about = place
        case["tumour"] = {"ellipsoid": {"centre_mm": rounded(place), "semi_axes_mm": [round(min(12.0, 0.3 * depth), 2)] * 3}}
        told["Tumour"] = "simulated"
    else:
        raise Refused("no tumour: no *_label-lesion_mask.nii.gz, no such label in a segmentation, none in a _plan.yaml "
                      "(--simulated-tumour places one)")

    if "craniotomy" not in own or "gravity" not in own:
        if about is None:
            raise Refused("the plan states a tumour: it must state craniotomy and gravity too")
        up = outward(centre, np.array(about))
        opening = exit_point(mask, image.affine, about, up)
        if opening is None:
            raise Refused("the tumour's middle lies outside the brain, and so does all that is above it")
        if "craniotomy" not in own:
            along = [0.0, 1.0, 0.0] if abs(up[1]) < 0.9 else [1.0, 0.0, 0.0]
            case["craniotomy"] = {"centre_mm": rounded(opening), "long_axis_direction": along}
            told["Craniotomy"] = "lateral of the tumour, as seen from the brain's centre"
        if "gravity" not in own:
            case["gravity"] = {"direction": rounded(-up)}
            told["Gravity"] = "the opening is uppermost"
    if "brainstem" not in own:
        stem = image.points(image.values == BRAINSTEM) if not inputs.brain.labels or BRAINSTEM in inputs.brain.labels else points
        if len(stem) < 50:
            stem = points[np.abs(points[:, 0] - centre[0]) < 12.0]
        low = stem[stem[:, 2] < stem[:, 2].min() + 6.0].mean(axis=0)
        case["brainstem"] = {"centre_mm": rounded(low), "radius_mm": 14.0}
        told["Brainstem"] = "lowest part of the brain about its middle"
    if "condensed" not in own:
        case["condensed"] = {"deadline_ms": 600000.0, **({"memory_limit_gib": memory_gib} if memory_gib else {})}
    for section in ("Craniotomy", "Gravity", "Brainstem"):
        key = section.lower()
        told.setdefault(section, "plan" if key in plan else "settings")
    text = "".join(f"{key}: {json.dumps(value)}\n" for key, value in case.items() if key not in own)
    return text + "".join(block.rstrip() + "\n" for _, block in sorted(own.items())), told
