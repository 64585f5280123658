# SPDX-License-Identifier: GPL-3.0-or-later
import sqlite3

import pytest

import brainshift


def test_files_that_are_no_surgery_are_named(tmp_path):
    with pytest.raises(brainshift.Error, match="no such file"):
        brainshift.Surgery(tmp_path / "missing.surgery")
    text = tmp_path / "text.surgery"
    text.write_text("no database " * 100)
    with pytest.raises(brainshift.Error, match="text.surgery: file is not a database"):
        brainshift.Surgery(text)
    other = tmp_path / "other.surgery"
    with sqlite3.connect(other) as database:
        database.execute("CREATE TABLE meta(key, value)")
    with pytest.raises(brainshift.Error, match="no surgery file of version 2"):
        brainshift.Surgery(other)


def test_nothing_is_written_beside_a_file(tmp_path, head):
    with brainshift.Surgery(head / "joint.surgery") as surgery:
        observations = list(surgery.observations())
    assert [o.source for o in observations] == ["ius", "stereopsis", "tracks"]
    assert sorted(path.name for path in head.iterdir()) == ["joint.surgery", "model.h5"]


def test_a_damaged_record_is_a_protocol_error(tmp_path, head):
    damaged = tmp_path / "damaged.surgery"
    damaged.write_bytes((head / "joint.surgery").read_bytes())
    with sqlite3.connect(damaged) as database:
        database.execute("UPDATE record SET payload = substr(payload, 1, 30)")
    with brainshift.Surgery(damaged) as surgery, pytest.raises(brainshift.ProtocolError):
        list(surgery.observations())
