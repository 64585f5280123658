# SPDX-License-Identifier: Apache-2.0
"""What a BIDS folder holds of a subject.

    sub-01/[ses-a/]anat/*_T1w.nii[.gz]                          the image
    derivatives/*/sub-01/[ses-a/]anat/*_desc-brain_mask.nii.gz  the brain; else a *_dseg.nii.gz
    ...                              *_label-lesion_mask.nii.gz the tumour (lesion, tumor, tumour; also _roi);
                                                                else names in a _dseg.tsv, else desc-tumor_dseg
    ...                              *_plan.yaml                sections of the case: craniotomy, gravity, ...
    ...                              *_surgery.surgery          a recorded surgery, played as it is
    ...                              *_landmarks.csv, .tag      landmarks before and during surgery
    ...                              *_us.igs.mha, .mha, .nrrd  a recording of tracked ultrasound, with
                                                                *_contours.csv or .json or *_seeds.csv,
                                                                *_registration.txt or *_fiducials.csv, *_device.xml

BIDS has no names for the last four: these are this program's own. They may lie in the subject's own
folder too. Files in another space than the image's (space-MNI152...) do not count.
"""
from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field

from .files import Path, Refused, read_json

OWN_SPACES = {"", "T1w", "orig", "individual", "native", "anat", "scanner"}
TUMOUR = re.compile(r"tumou?r|lesion|enhancing|necro|glio|metast", re.IGNORECASE)
NOT_BRAIN = re.compile(r"skull|bone|skin|scalp|background|air$|eye|optic-?nerve|muscle|fat$|extra-?cerebral|^unknown|"
                       r"soft-?tissue|^bg$", re.IGNORECASE)


def entities(path: Path) -> dict[str, str]:
    """key-value parts of a name; the suffix under "suffix", without extension."""
    *pairs, suffix = path.name.split(".")[0].split("_")
    found = {key: value for key, _, value in (pair.partition("-") for pair in pairs)}
    return {**found, "suffix": suffix}


@dataclass(frozen=True)
class Unit:
    """A subject, or one session of a subject."""
    subject: str
    session: str | None

    @property
    def name(self) -> str:
        return f"sub-{self.subject}" + (f"_ses-{self.session}" if self.session else "")

    @property
    def folder(self) -> Path:
        return Path(f"sub-{self.subject}", *([f"ses-{self.session}"] if self.session else []))


@dataclass
class Labels:
    """Labels of a segmentation; none: every voxel above 0."""
    file: Path
    labels: tuple[int, ...] = ()


@dataclass
class Recording:
    name: str
    file: Path
    options: dict[str, Path] = field(default_factory=dict)  # of `brainshift import`; none: a surgery file


@dataclass
class Inputs:
    image: Path
    brain: Labels
    tumour: Labels | None
    plan: Path | None
    recordings: list[Recording]


def check_dataset(bids: Path) -> None:
    """What every reader of BIDS may rely on. Not a validator."""
    if not bids.is_dir():
        raise Refused(f"{bids} is no folder")
    file = bids / "dataset_description.json"
    if not file.is_file():
        raise Refused(f"{file} is missing: is {bids} a BIDS dataset? (--skip-bids-validator reads it anyhow)")
    described = read_json(file)
    for key in ("Name", "BIDSVersion"):
        if not isinstance(described, dict) or not isinstance(described.get(key), str):
            raise Refused(f"{file}: {key} is missing (--skip-bids-validator reads it anyhow)")


def units(bids: Path, labels: list[str], sessions: list[str]) -> list[Unit]:
    """Subjects and sessions, sorted. Labels may begin with sub-, sessions with ses-; none means all."""
    there = sorted(folder.name[4:] for folder in bids.glob("sub-*") if folder.is_dir())
    if not there:
        raise Refused(f"{bids} has no folder sub-*")
    asked = [label.removeprefix("sub-") for label in labels] or there
    for label in asked:
        if label not in there:
            raise Refused(f"--participant-label {label}: {bids} has {len(there)} subjects, not this one")
    wanted, found = [s.removeprefix("ses-") for s in sessions], []
    for subject in sorted(set(asked)):
        folders = sorted(f.name[4:] for f in (bids / f"sub-{subject}").glob("ses-*") if f.is_dir())
        found += [Unit(subject, s) for s in folders if not wanted or s in wanted] if folders else [Unit(subject, None)]
    if not found:
        raise Refused(f"--session-label {' '.join(wanted)}: none of the subjects has it")
    return found


def with_anatomy(bids: Path, found: list[Unit]) -> list[Unit]:
    """Without sessions that have no T1w, for subjects of which another session has one."""
    has = {unit: bool(images(bids, unit)) for unit in found}
    some = {unit.subject for unit, there in has.items() if there}
    return [unit for unit in found if has[unit] or unit.subject not in some]


def images(bids: Path, unit: Unit) -> list[Path]:
    return sorted(file for file in (bids / unit.folder / "anat").glob("*_T1w.nii*")
                  if file.name.endswith((".nii", ".nii.gz")) and entities(file).get("space", "") in OWN_SPACES)


def _belongs(file: Path, image: dict[str, str]) -> bool:
    """Every entity that the image and the file both name has one value; the file's space is the image's."""
    own = entities(file)
    return own.get("space", "") in OWN_SPACES and own.get("sub") == image["sub"] and all(
        own[key] == value for key, value in image.items() if key in own and key not in ("suffix", "desc", "label", "res"))


def _beside(bids: Path, unit: Unit, output: Path) -> list[Path]:
    """Files about the subject outside of the raw image's own: its folder, and every derivative but ours."""
    roots = [bids, *sorted(folder for folder in (bids / "derivatives").glob("*") if folder.is_dir())]
    found: list[Path] = []
    for root in roots:
        if root.resolve() == output.resolve():
            continue
        subject = root / f"sub-{unit.subject}"
        found += sorted(subject.rglob(f"sub-{unit.subject}_*"))
    return [file for file in found if not file.is_dir()]


def _only(unit: Unit, what: str, files: list[Path], bids: Path) -> Path | None:
    if len(files) > 1:
        raise Refused(f"{len(files)} files could be the {what}: "
                      f"{', '.join(str(file.relative_to(bids)) for file in files[:4])} (--filter chooses)")
    return files[0] if files else None


def named_labels(segmentation: Path) -> dict[int, str]:
    """index and name of the _dseg.tsv that goes with a segmentation: beside it, or above it by inheritance."""
    name = segmentation.name.split(".")[0] + ".tsv"
    own = segmentation.with_name(name)
    desc = entities(segmentation).get("desc")
    shared = [f"desc-{desc}_dseg.tsv"] if desc else []
    above = [folder / n for folder in list(segmentation.parents)[:4] for n in [*shared, "dseg.tsv"]]
    for table in [own, *above]:
        if table.is_file():
            try:
                with open(table, newline="", encoding="utf-8") as stream:
                    rows = list(csv.DictReader(stream, delimiter="\t"))
                return {int(row["index"]): row["name"] or "" for row in rows}
            except (KeyError, TypeError, ValueError):
                raise Refused(f"{table.name}: columns index (whole numbers) and name are needed") from None
    return {}


def inputs(bids: Path, unit: Unit, output: Path, filters: dict[str, str]) -> Inputs:
    """Everything of one subject, or one sentence that says what is missing or ambiguous."""
    chosen = {key: value for key, value in filters.items()}

    def passes(file: Path) -> bool:
        own = entities(file)
        return all(own.get(key, value) == value for key, value in chosen.items())

    t1w = [file for file in images(bids, unit) if passes(file)]
    if not t1w:
        where = bids / unit.folder / "anat"
        raise Refused(f"no {unit.folder / 'anat'}/*_T1w.nii[.gz]" + ("" if where.is_dir() else " (no folder anat)"))
    files = [file for file in _beside(bids, unit, output) if passes(file)]
    # Of the head's own images: those of folders func, dwi and perf and regions of an atlas are others' masks.
    anatomy = [f for f in files if f.parent.name == "anat" and "atlas" not in entities(f)]
    masks = [f for f in anatomy if re.search(r"_mask\.nii(\.gz)?$", f.name)
             and "brain" in (entities(f).get("desc"), entities(f).get("label"))]
    maps = [f for f in anatomy if re.search(r"_dseg\.nii(\.gz)?$", f.name)]
    if len(t1w) > 1:
        meant = [image for image in t1w if any(
            {k: v for k, v in entities(file).items() if k not in ("desc", "suffix", "space", "res", "label")}
            == {k: v for k, v in entities(image).items() if k not in ("suffix",)} for file in [*masks, *maps])]
        t1w = meant if len(meant) == 1 else t1w
    image = _only(unit, "T1w image", t1w, bids)
    assert image is not None
    about = entities(image)
    masks, maps = ([file for file in group if _belongs(file, about)] for group in (masks, maps))

    tumour_maps = [f for f in maps if TUMOUR.search(entities(f).get("desc", ""))]
    plain = [f for f in maps if f not in tumour_maps]
    mask = _only(unit, "brain mask", masks, bids)
    segmentation = None if mask and len(plain) > 1 else _only(unit, "segmentation", plain, bids)
    names = named_labels(segmentation) if segmentation else {}
    if mask:
        brain = Labels(mask)
    elif segmentation:
        brain = Labels(segmentation, tuple(sorted(k for k, n in names.items() if k and not NOT_BRAIN.search(n))))
    else:
        raise Refused("no brain: neither *_desc-brain_mask.nii.gz nor *_dseg.nii.gz in the image's space, in the "
                      "subject's folder or in derivatives/*/")

    lesions = [f for f in anatomy if re.search(r"_(mask|roi)\.nii(\.gz)?$", f.name) and _belongs(f, about)
               and TUMOUR.search(entities(f).get("label", "") + "_" + entities(f).get("desc", ""))]
    tumour: Labels | None = None
    if lesions:
        tumour = Labels(_only(unit, "tumour", lesions, bids) or lesions[0])
    elif tumour_maps:
        file = _only(unit, "tumour", tumour_maps, bids) or tumour_maps[0]
        tumour = Labels(file, tuple(sorted(k for k, n in named_labels(file).items() if k and TUMOUR.search(n))))
    elif segmentation and any(TUMOUR.search(name) for name in names.values()):
        tumour = Labels(segmentation, tuple(sorted(k for k, n in names.items() if TUMOUR.search(n))))
    plan = _only(unit, "plan", [f for f in files if f.name.endswith("_plan.yaml") and _belongs(f, about)], bids)
    return Inputs(image, brain, tumour, plan, _recordings([f for f in files if _belongs(f, about)]))


def _recordings(files: list[Path]) -> list[Recording]:
    found = []
    for file in files:
        stem, suffix = file.name.split(".")[0].rpartition("_")[::2]
        extension = file.name[len(stem) + 1 + len(suffix):]
        name = "_".join(part for part in stem.split("_") if not part.startswith(("sub-", "ses-"))) or suffix
        if suffix == "surgery" and extension == ".surgery":
            found.append(Recording(name, file))
        elif suffix == "landmarks" and extension in (".csv", ".tag"):
            found.append(Recording(name, file, {"--landmarks": file}))
        elif suffix == "us" and extension in (".igs.mha", ".mha", ".nrrd"):
            options = {"--recording": file}
            for option, endings in (("--contours", ("_contours.csv", "_contours.json")), ("--seeds", ("_seeds.csv",)),
                                    ("--registration", ("_registration.txt",)), ("--fiducials", ("_fiducials.csv",)),
                                    ("--device", ("_device.xml",))):
                beside = [file.with_name(stem + ending) for ending in endings]
                options |= {option: path for path in beside if path.is_file()}
            found.append(Recording(name, file, options))
    names = [recording.name for recording in found]
    for recording in found:
        if names.count(recording.name) > 1:
            raise Refused(f"two recordings are called {recording.name}: {recording.file.name} is one of them")
    return found
