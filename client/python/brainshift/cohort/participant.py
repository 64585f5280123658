# SPDX-License-Identifier: Apache-2.0
"""One subject: prepare, play, score, report.

    OUT/sub-01/[ses-a/]sub-01_case.yaml                   the case that was prepared; .json: what it is from
    OUT/sub-01/[ses-a/]sub-01_desc-jointsagseed1_result.json   one surgery, as soon as it is scored
    OUT/sub-01/[ses-a/]sub-01_report.html                 pictures and tables of `brainshift report`
    OUT/sub-01/[ses-a/]sub-01_surgeries.tsv, .json        its rows; written last
    OUT/sub-01/[ses-a/]sub-01_leftout.json                instead: why the subject cannot run
    OUT/.work/                                            locks and unfinished work

A run that was cut off goes on after the last file that it finished: brainshiftd's checkpoint, the
model, every surgery. A lock per subject lets several runs share OUT; the second one waits, and then
finds the work done. A result carries a fingerprint of everything it depends on (the content of the
inputs, settings, options, programs): one of another fingerprint is refused, not replaced.
"""
from __future__ import annotations

import hashlib
import json
import os
import re
from dataclasses import dataclass, field
from typing import Any

from . import case, layout, measures, nifti
from .files import (Path, Refused, copy, digest, drop_temporaries, locked, read_json, remove, table_text, write,
                    write_json, write_table)
from .programs import Failed, Programs

BIDS_VERSION = "1.8.0"
CASE_OWN = ("case_id", "images")
NO_ESTIMATE = "no observation was answered with an estimate"  # of brainshift replay: the data are to blame
NOT_KEPT = ("trace", "hypotheses", "case_file", "surgery_file", "field_file")  # paths and inner steps


@dataclass(frozen=True)
class Request:
    bids: Path
    output: Path
    programs: Programs
    scenarios: tuple[str, ...]
    seeds: tuple[int, ...]
    adverse: str = ""
    method: str = "condensed"
    boundary: str = "contact"
    settings: Path | None = None
    edge_mm: float | None = None
    simulated_tumour: bool = False
    filters: dict[str, str] = field(default_factory=dict)
    memory_gib: float | None = None


@dataclass(frozen=True)
class Outcome:
    unit: layout.Unit
    status: str  # done, left out, failed
    text: str

    @property
    def line(self) -> str:
        return f"{self.unit.name}: {self.status}: {self.text}" if self.status != "done" else f"{self.unit.name}: {self.text}"


@dataclass(frozen=True)
class Surgery:
    name: str
    seed: int | None
    tag: str
    fingerprint: str
    recording: layout.Recording | None = None


def describe(request: Request) -> None:
    """dataset_description.json and .bidsignore of the derivative, unless they are there."""
    file, ignored = request.output / "dataset_description.json", request.output / ".bidsignore"
    if file.exists():
        found = read_json(file)
        makers = found.get("GeneratedBy") if isinstance(found, dict) else None
        if not isinstance(makers, list) or not any(isinstance(m, dict) and m.get("Name") == "brainshift" for m in makers):
            raise Refused(f"{file} is not brainshift's: choose a folder of its own")
    elif (request.output / "participants.tsv").exists():
        raise Refused(f"{request.output} holds another dataset: choose a folder of its own")
    with locked(request.output / ".work" / "dataset.lock"):
        for name in (file.name, ignored.name):
            drop_temporaries(request.output, name)
        if not ignored.exists():
            write(ignored, "".join(line + "\n" for line in (
                "# No names in BIDS for a surgery's result or a mechanical case.", ".work/", "group_*", "compare_*",
                "**/*_case.*", "**/*_result.json", "**/*_surgeries.*", "**/*_report.html", "**/*_leftout.json")))
        if not file.exists():
            write_json(file, {
                "Name": "brainshift: simulated and recorded surgeries, with the estimate of the brain's shift",
                "BIDSVersion": BIDS_VERSION, "DatasetType": "derivative",
                "GeneratedBy": [{"Name": "brainshift", "Version": request.programs.identity.split()[-2],
                                 "Description": "brainshift-bids; research software, no medical device"}],
                "SourceDatasets": [{"URL": request.bids.resolve().as_uri()}]})


def fingerprint(parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def run(request: Request, unit: layout.Unit) -> Outcome:
    """Everything that is not done yet. Never raises for a subject: its outcome says what happened."""
    folder = request.output / unit.folder
    left_out = folder / f"{unit.name}_leftout.json"
    with locked(request.output / ".work" / f"{unit.name}.lock") as held:
        try:
            text = _run_locked(request, unit, folder, held)
            left_out.unlink(missing_ok=True)
            return Outcome(unit, "done", text)
        except Refused as refused:
            write_json(left_out, {"ParticipantId": f"sub-{unit.subject}", "SessionId": _session(unit), "Reason": str(refused)})
            return Outcome(unit, "left out", str(refused))
        except (Failed, OSError) as failure:
            return Outcome(unit, "failed", str(failure))


def _session(unit: layout.Unit) -> str | None:
    return f"ses-{unit.session}" if unit.session else None


def _run_locked(request: Request, unit: layout.Unit, folder: Path, held: int) -> str:
    drop_temporaries(folder)
    inputs = layout.inputs(request.bids, unit, request.output, request.filters)
    settings = case.sections(request.settings, (*CASE_OWN, "tumour")) if request.settings else {}
    plan = case.sections(inputs.plan, CASE_OWN) if inputs.plan else {}
    nifti.content(inputs.image)  # a clear word of our own for what is not there
    same = fingerprint([request.programs.identity, digest(inputs.image), _of(inputs.brain), _of(inputs.tumour),
                        {**settings, **plan}, request.edge_mm, request.simulated_tumour])
    surgeries = _surgeries(request, inputs, same)
    results = {s.tag: folder / f"{unit.name}_desc-{s.tag}_result.json" for s in surgeries}
    for surgery in surgeries:
        file = results[surgery.tag]
        if file.exists() and read_json(file)["Fingerprint"] != surgery.fingerprint:
            raise Refused(f"{file.name} is from other inputs, settings or programs: remove it, or choose another folder")
    table, html = folder / f"{unit.name}_surgeries.tsv", folder / f"{unit.name}_report.html"
    every = sorted(folder.glob(f"{unit.name}_desc-*_result.json"))
    if html.exists() and all(file.exists() for file in results.values()) and _written(table, every):
        return f"{len(results)} {'surgery was' if len(results) == 1 else 'surgeries were'} done"

    work = request.output / ".work" / f"{unit.name}-{same}"
    work.mkdir(parents=True, exist_ok=True)
    drop_temporaries(work)
    text, told = case.build(unit.name, inputs, settings, plan, request.edge_mm, request.simulated_tumour, work,
                            request.memory_gib)
    case_file = work / "case.yaml"
    if case_file.exists() and case_file.read_text(encoding="utf-8") != text:  # other paths, another --mem-mb
        for file in work.glob("*.h5*"):
            file.unlink()
    write(case_file, text)
    problems = _play(request, surgeries, results, work, unit, held)
    surgeries = [surgery for surgery in surgeries if results[surgery.tag].exists()]
    if not surgeries:
        remove(work)
        raise Refused(problems[0])

    call = request.programs.call
    pages = [work / s.tag / "report.json" for s in surgeries]
    call(request.programs.tool, "report", *pages, "--out", "page", folder=work, held=held)
    write_json(folder / f"{unit.name}_case.json", {
        "Description": "case that was prepared; the image of the brain may be made from the segmentation",
        "Sources": [f"bids::{_relative(file, request.bids)}" for file in _files(inputs)],
        "Model": _model(results[surgeries[0].tag]), **told})
    copy(case_file, folder / f"{unit.name}_case.yaml")
    copy(work / "page" / "report.html", html)
    every = sorted(folder.glob(f"{unit.name}_desc-*_result.json"))
    write_table(table, measures.SURGERIES, _rows(every))
    remove(work)
    if problems:
        raise Refused(f"{len(problems)} of {len(results)} surgeries: {'; '.join(problems)}")
    return f"{len(surgeries)} {'surgery' if len(surgeries) == 1 else 'surgeries'} played"


def _play(request: Request, surgeries: list[Surgery], results: dict[str, Path], work: Path, unit: layout.Unit,
          held: int) -> list[str]:
    """Every surgery whose scored replay is not in the work folder or not among the results. What was refused."""
    call, programs = request.programs.call, request.programs
    model = work / "model.h5"
    if not model.exists():
        part = work / "part.h5"
        try:
            call(programs.daemon, "prepare", "--case", "case.yaml", "--out", part.name, folder=work, held=held)
        except (Refused, Failed):
            checkpoint = work / (part.name + ".partial")
            if not checkpoint.exists():
                raise
            checkpoint.unlink()  # of a run that was killed while it wrote: once more, from the start
            call(programs.daemon, "prepare", "--case", "case.yaml", "--out", part.name, folder=work, held=held)
        os.replace(part, model)
    missing = [s for s in surgeries if not (work / s.tag).is_dir() or not results[s.tag].exists()]
    if not missing:
        return []
    problems = []
    with programs.serving(Path("model.h5"), work) as endpoint:
        for surgery in missing:
            done = work / surgery.tag
            if not done.is_dir():
                part = Path(f"{surgery.tag}.part")  # in the work folder, where programs run
                remove(work / part)
                (work / part).mkdir()
                try:
                    recorded = _recorded(request, surgery, part, work, held)
                    call(programs.tool, "replay", recorded, "--endpoint", endpoint, "--boundary", request.boundary,
                         "--method", request.method, "--report", part / "report.json", folder=work, held=held)
                except (Refused, Failed) as problem:
                    if isinstance(problem, Failed) and NO_ESTIMATE not in str(problem):
                        raise
                    problems.append(f"{surgery.name}: {problem}")
                    continue
                os.replace(work / part, done)
            if results[surgery.tag].exists():
                continue  # played again for the pictures of the report
            runs = [{k: v for k, v in r.items() if k not in NOT_KEPT} for r in read_json(done / "report.json")]
            write_json(results[surgery.tag], {
                "ParticipantId": f"sub-{unit.subject}", "SessionId": _session(unit), "Surgery": surgery.name,
                "Seed": surgery.seed, "Kind": "recorded" if surgery.recording else "simulated",
                "Programs": programs.identity, "Fingerprint": surgery.fingerprint, "Runs": runs})
    return problems


def _recorded(request: Request, surgery: Surgery, part: Path, work: Path, held: int) -> Path:
    """The surgery file to play: simulated, imported, or the recorded one."""
    target, tool = part / "s.surgery", request.programs.tool
    if surgery.recording is None:
        adverse = ["--adverse", request.adverse] if request.adverse else []
        request.programs.call(tool, "simulate", "--case", "case.yaml", "--scenario", surgery.name.partition("+")[0], *adverse,
                              "--seed", surgery.seed, "--out", target, folder=work, held=held)
    elif surgery.recording.options:
        options = [text for pair in surgery.recording.options.items() for text in (pair[0], pair[1].resolve())]
        request.programs.call(tool, "import", *options, "--model", "model.h5", "--out", target, folder=work, held=held)
    else:
        copy(surgery.recording.file, work / target)
    return target


def _surgeries(request: Request, inputs: layout.Inputs, same: str) -> list[Surgery]:
    how = [same, request.method, request.boundary]
    suffix = f"+{request.adverse}" if request.adverse else ""
    made = [Surgery(name + suffix, seed, f"{_tag(name + suffix)}seed{seed}", fingerprint([*how, name, request.adverse, seed]))
            for name in request.scenarios for seed in request.seeds]
    for recording in inputs.recordings:
        content = [digest(file) for file in (recording.file, *recording.options.values())]
        made.append(Surgery(recording.name, None, f"rec{_tag(recording.name)}", fingerprint([*how, recording.name, content]),
                            recording))
    if not made:
        raise Refused("nothing to play: no recording of this subject, and --scenario none")
    tags = [surgery.tag for surgery in made]
    for surgery in made:
        if tags.count(surgery.tag) > 1:
            raise Refused(f"two surgeries would be called desc-{surgery.tag}: {surgery.name} is one of them")
    return made


def _tag(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]", "", name)


def _of(labels: layout.Labels | None) -> object:
    if labels is None:
        return None
    nifti.content(labels.file)
    return [digest(labels.file), labels.labels]


def _files(inputs: layout.Inputs) -> list[Path]:
    files = [inputs.image, inputs.brain.file, *([inputs.tumour.file] if inputs.tumour else []),
             *([inputs.plan] if inputs.plan else [])]
    return list(dict.fromkeys([*files, *(recording.file for recording in inputs.recordings)]))


def _relative(file: Path, bids: Path) -> str:
    return file.relative_to(bids).as_posix()


def _model(result: Path) -> Any:
    return read_json(result)["Runs"][0].get("model_id")


def _rows(results: list[Path]) -> list[dict[str, object]]:
    return sorted((row for file in results for row in measures.rows(read_json(file))), key=measures.order)


def _written(table: Path, results: list[Path]) -> bool:
    """Whether the table is the one of these results. It is written after all else of a subject."""
    return table.exists() and table.read_text(encoding="utf-8") == table_text(list(measures.SURGERIES), _rows(results))
