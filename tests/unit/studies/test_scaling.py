# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of a preparation by one process and by two, and what they are held to."""
import numpy as np
import pytest

from studies.scaling import ROWS, UPDATES, Power, Split

NODES = np.array([5e3, 1e4, 2e4, 4e4, 9.4e4])


def row(nodes, processes, work_s, peak_bytes, load=1.0):
    values = {"edge_mm": 1e6 / nodes, "nodes": nodes, "processes": processes, "threads": 1, "total_s": work_s, "work_s": work_s,
              "peak_bytes": peak_bytes, "sent_bytes": 1e3 * nodes, "file_bytes": 1e4 * nodes, "load": load}
    return ",".join(str(values.get(column, 1)) for column in ROWS) + "\n"


def write(records, time_ratio, memory_ratio, load=1.0, update_mm=1e-10):
    text = "".join(row(n, 1, 1e-6 * n ** 1.8, 1e3 * n ** 1.4, load)
                   + row(n, 2, time_ratio * 1e-6 * n ** 1.8, memory_ratio * 1e3 * n ** 1.4, load) for n in NODES)
    records.write("rows.csv", ",".join(ROWS) + "\n" + text)
    records.write("updates.csv", ",".join(UPDATES) + "\n" + "".join(
        f"1,{n:.0f},2,{update_mm},8,1e-14,1e-13,1,{1e-3 * n}\n" for n in NODES))


def test_a_power_is_found_and_has_no_band_without_scatter():
    found = Power.fit(NODES, 3e-5 * NODES ** 1.7)
    assert (found.factor, found.power) == pytest.approx((3e-5, 1.7))
    assert found.band(1e6) == pytest.approx(1.0)
    assert np.isnan(Power.fit(NODES[:2], NODES[:2]).band(1e6))


def test_the_band_holds_most_values_of_a_scattered_power():
    random, held = np.random.default_rng(3), 0
    for _ in range(400):
        found = Power.fit(NODES, NODES ** 1.5 * np.exp(0.1 * random.normal(size=len(NODES))))
        value, band = 1e6 ** 1.5 * np.exp(0.1 * random.normal()), found.band(1e6)
        held += found.at(1e6) / band <= value <= found.at(1e6) * band
    assert 0.92 <= held / 400 <= 0.98


def test_what_is_shared_and_what_is_split_are_told_apart():
    shared, split = 2.0 * NODES, 1e-3 * NODES ** 1.8
    found = Split.fit(NODES, shared + split, shared + split / 2)
    assert found.shared.power == pytest.approx(1.0)
    assert found.at(1e6, 8) == pytest.approx(2e6 + 1e-3 * 1e6 ** 1.8 / 8)


@pytest.mark.parametrize("time, memory, update_mm, status", [(0.6, 0.55, 1e-10, 0), (0.7, 0.55, 1e-10, 1), (0.6, 0.7, 1e-10, 1),
                                                             (0.6, 0.55, 1e-7, 1)])
def test_every_bound_is_held(records, time, memory, update_mm, status):
    write(records, time, memory, update_mm=update_mm)
    assert records.run("scaling")[0] == status
    assert (records.path / "million.csv").exists() and (records.path / "scaling.png").exists()


def test_the_clock_is_no_bound_where_other_work_had_the_cores(records):
    write(records, 0.6, 0.55, load=8.0)
    assert records.run("scaling")[0] == 0
    assert "time" not in "".join(line for line in records.text("checks.csv").splitlines() if "<= 0.65" in line)
