# SPDX-License-Identifier: GPL-3.0-or-later
"""ablations.py: on committed rows and docs/ablations.md, and on tables made by hand."""
import math

import pytest

from made_up import DOCS, SOURCE, Verdicts, committed, judged, run, table_of, text_of
from studies import ablations
from studies.ablations import ALL_DATA, ALONE, EVERYTHING
from studies.common import InputError
from studies.rows import Table

FOLDER = DOCS / "ablations"


def row(variant, truth="mesh", data="tumour", seed=1, tumour=1.0, coverage=0.9):
    """A patient per seed. Craniotomy and brain have ten times the tumour's error."""
    return {"head": "h", "patient": seed, "truth": truth, "seed": seed, "variant": variant, "data": data,
            "status": "converged", "nodes": 100, "initial_mm": 5, "tumour_mm": tumour, "cppd_mm": 10 * tumour,
            "initial_field_mm": 9, "field_mm": 10 * tumour, "coverage_90": coverage, "quality": "good", "update_ms": ""}


def refused(variant, seed):
    return row(variant, seed=seed) | {"status": "refused", "tumour_mm": "", "cppd_mm": "", "field_mm": "",
                                      "coverage_90": ""}


def found(rows, variant, measure="tumour", group=EVERYTHING, data=ALONE):
    variants = table_of(rows).groups("variant")
    return next((one for one in ablations.differences(variants["default"], variants[variant])
                 if (one.measure, one.group, one.data) == (measure, group, data)), None)


def made_up():
    """Contact halves the error; the rank does nothing; a higher rank is better by a third."""
    rows = []
    for seed in range(1, 9):
        noise = 1e-4 * seed
        rows += [row("default", seed=seed), row("fixed", seed=seed, tumour=2 + noise),
                 row("low-rank", seed=seed, tumour=1 + noise), row("high-rank", seed=seed, tumour=0.67 - noise)]
    return rows


def test_committed_rows_give_the_committed_checks_and_page():
    rows = Table.read(FOLDER / "rows.csv")
    held, page = ablations.held_parts(rows), (DOCS / "ablations.md").read_text()
    assert len(rows) > 5000
    assert judged(lambda record: ablations.judge(rows, held, record)) == committed("ablations")
    assert ablations.parts_table(held) in page and ablations.left_out_list() in page
    assert ablations.short_rows(rows) == (FOLDER / "rows.csv").read_text()


def test_every_variant_of_the_program_is_described():
    described = [variant for parts in ablations.PARTS.values() for variant, *_ in parts]
    program = (SOURCE / "tests" / "ablations" / "parts.cpp").read_text()
    assert all(f'"{variant}"' in program for variant in described)
    published = set(Table.read(FOLDER / "rows.csv").values("variant"))
    assert {"default", *described} == published
    with pytest.raises(InputError, match="variant no-luck is not described"):
        ablations.held_parts(table_of([row("default"), row("no-luck")]))


def test_a_truth_belongs_to_one_group():
    assert ablations.group_of("gap") == ablations.group_of("tracker") == "one ingredient"
    assert ablations.group_of("all") == "all ingredients" and ablations.group_of("consistency") == "consistency"
    assert ablations.group_of("joint-mixed") == "joint-mixed"
    assert all(ablations.group_of(truth) in ablations.GROUPS
               for truth in Table.read(FOLDER / "rows.csv").values("truth"))


def test_pairs_are_of_the_same_surgery_and_the_same_data():
    rows = [row("default", tumour=1.0), row("default", data="tumour+cortex", tumour=0.5),
            row("default", "gap", seed=2, tumour=2.0), row("default", "gap", seed=3, tumour=100.0),  # without a pair
            row("fixed", tumour=1.5), row("fixed", data="tumour+cortex", tumour=0.75),
            row("fixed", "gap", seed=2, tumour=4.0)]
    alone = found(rows, "fixed", group="one ingredient")
    assert alone.patients == 2
    assert alone.of_default == pytest.approx(math.sqrt(1.0 * 2.0), abs=1e-12)  # geometric means
    assert alone.of_variant == pytest.approx(math.sqrt(1.5 * 4.0), abs=1e-12)
    assert alone.change() == pytest.approx(math.sqrt(3.0) - 1.0, abs=1e-12)
    # Of gap the tumour alone is the last.
    assert found(rows, "fixed", data=ALL_DATA).of_default == pytest.approx(math.sqrt(0.5 * 2.0), abs=1e-12)
    assert found(rows, "fixed", group="resection", data=ALL_DATA) is None


def test_surgeries_of_one_patient_are_one_sample():
    """Seeds of a truth first, then the truths of a patient, then the patients."""
    rows = []
    for patient, truth, seed, tumour in ((1, "mesh", 1, 4.0), (1, "mesh", 2, 16.0), (1, "gap", 1, 2.0), (2, "mesh", 1, 1.0)):
        rows += [{**row("default", truth, seed=seed), "patient": patient},
                 {**row("fixed", truth, seed=seed, tumour=tumour), "patient": patient}]
    one = found(rows, "fixed")
    assert one.patients == 2
    assert one.of_variant == pytest.approx(2 ** 1.0, abs=1e-12)  # patient 1: 2^((3 + 1) / 2); patient 2: 1
    assert found([{**one, "patient": 1} for one in rows], "fixed") is None


def test_refused_updates_are_no_pairs():
    rows = [row("default", seed=seed) for seed in (1, 2, 3)]
    rows += [row("fixed", seed=1, tumour=2), refused("fixed", 2), row("fixed", seed=3, tumour=2)]
    assert found(rows, "fixed").patients == 2


def test_an_update_with_less_data_is_held_against_the_last_one():
    rows = [one for seed in (1, 2) for one in (row("default", seed=seed),
                                               row("default", data="tumour+cortex", seed=seed, tumour=0.25),
                                               row("no-cortex", seed=seed))]
    assert found(rows, "no-cortex", data=ALL_DATA).change() == pytest.approx(3)
    assert found(rows, "no-cortex").change() == pytest.approx(0)


def test_a_difference_counts_when_it_is_both_sure_and_large():
    rows = []
    for seed in range(1, 9):
        noise = 1e-4 * seed
        rows += [row("default", seed=seed), row("fixed", seed=seed, tumour=1.01 + noise),  # sure, and 1 %
                 row("no-medium", seed=seed, tumour=1.5 + noise),  # sure, and 50 %
                 row("low-rank", seed=seed, tumour=9 if seed == 8 else 1)]  # 100 %, by one surgery
    assert [found(rows, variant).counts() for variant in ("fixed", "no-medium", "low-rank")] == [False, True, False]


def test_of_the_interval_departures_from_nine_tenths_are_compared():
    rows = [row(variant, seed=seed, coverage=coverage) for seed in (1, 2)
            for variant, coverage in (("default", 0.88), ("fixed", 0.97))]
    assert found(rows, "fixed", "interval").change() == pytest.approx(0.05)


def test_a_part_buys_what_is_worse_without_it_and_an_added_one_what_is_better_with_it():
    held = {one.name: one for one in ablations.held_parts(table_of(made_up()))}
    contact, rank = held["contact"], held["a higher rank"]
    assert len(contact.buys) == len(rank.buys) == 12 and not contact.costs and not rank.costs
    assert contact.buys == sorted(contact.buys, key=lambda one: -round(abs(one.change()), 9))  # the largest first
    worse = [{**one, "variant": {"fixed": "high-rank", "high-rank": "fixed"}.get(one["variant"], one["variant"])}
             for one in made_up()]
    held = {one.name: one for one in ablations.held_parts(table_of(worse))}
    assert len(held["contact"].costs) == len(held["a higher rank"].costs) == 12 and not held["contact"].buys


def test_the_table_says_what_a_part_buys_and_that_another_buys_nothing():
    text = ablations.parts_table(ablations.held_parts(table_of(made_up())))
    assert ("| contact | boundary condition fixed | 2.00 | 2.00 | 2.00 | 2.00 | – | 12 of 16; tumour, all surgeries, "
            "tumour alone: 1.00 → 2.00 mm | nothing |") in text
    assert "1.00 | 1.00 | 1.00 | 1.00 | – | nothing | nothing |" in text
    assert "| a higher rank (off by default) |" in text


def test_short_rows_give_the_same_table():
    rows = table_of(made_up())
    again = Table.parse(ablations.short_rows(rows), "short")
    assert ablations.parts_table(ablations.held_parts(again)) == ablations.parts_table(ablations.held_parts(rows))


def test_a_part_of_the_default_that_buys_nothing_is_red():
    rows = table_of(made_up())
    verdicts = Verdicts(lambda record: ablations.judge(rows, ablations.held_parts(rows), record))
    begin = "ablations,{}: combinations in which it buys something,"
    assert any(line.startswith(begin.format("contact") + "12,>= 2 (of 16; it costs something in 0),1,")
               for line in verdicts.lines)
    assert any(line.startswith(begin.format("rank") + "0,>= 2 (of 16; it costs something in 0),0,")
               for line in verdicts.lines)
    assert any(line.startswith(begin.format("a higher rank") + "12,shown; of 16; it costs something in 0,,")
               for line in verdicts.lines)
    assert any(line.startswith("ablations,calculix: ") for line in verdicts.left_out)


def test_the_command_writes_all_and_ends_with_1_for_a_part_that_buys_nothing(tmp_path):
    (tmp_path / "rows-h.csv").write_text(text_of(made_up()))
    done = run("ablations", "--dir", tmp_path)
    assert done.returncode == 1 and "FAILS  ablations: rank: combinations" in done.stdout
    assert (tmp_path / "page.md").read_text().startswith("| part | changed |")
    for name in ("ablations-tumour.png", "ablations-craniotomy.png", "rows.csv", "tables.md", "summary.json"):
        assert (tmp_path / name).stat().st_size > 500


def test_a_missing_column_is_bad_input_in_one_line(tmp_path):
    (tmp_path / "rows-h.csv").write_text(text_of([{k: v for k, v in one.items() if k != "field_mm"} for one in made_up()]))
    done = run("ablations", "--dir", tmp_path)
    assert (done.returncode, done.stderr) == (2, f"studies ablations: {tmp_path}/rows-h.csv: has no column field_mm\n")
