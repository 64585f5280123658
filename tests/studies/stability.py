# SPDX-License-Identifier: GPL-3.0-or-later
"""stability: verdicts on the points of stability_suite, a map per sheet, faults.csv, summary.json.

points.csv: a row per answer; seeded.csv: the same with one operator of the product made wrong;
guards.csv: what the guards cost (bench_guards). docs/stability.md derives the bounds.
"""
from . import chart
from .checks import Check, at_most, every_check_holds, print_checks, summary_json
from .common import Parser, write_file
from .rows import Table, csv_text

TITLES = {
    "penalty": "contact penalty", "material": "material", "mesh": "bad elements",
    "load": "large displacement; weak support", "data": "data and prior",
    "contact": "warm start from the wrong contact", "elements": "elements near incompressibility",
    "consolidation": "one step of consolidation"}
NEEDED = ("sheet", "fault", "parameter", "x", "row", "answered", "warned", "status", "difference", "bound", "unit",
          "must_warn", "objection", "reason")
MEANINGS = {"green": "accurate", "yellow": "answered with a warning", "grey": "refused with a reason",
            "red": "wrong without saying so"}
MARKS = {"green": {"marker": "o", "color": chart.GREEN},
         "yellow": {"marker": "^", "color": chart.YELLOW, "markeredgecolor": chart.INK},
         "grey": {"marker": "s", "color": chart.GREY},
         "red": {"marker": "x", "color": chart.VERMILLION, "markeredgewidth": 3}}
FAULTS = ("sign", "normal", "scale")  # tests/stability/stability_point.hpp
LOG_RATIO = 30.0  # wider than this and an axis is logarithmic


def judge(point):
    """green: answered, within the bound of its sweep; yellow: answered with a warning, in status or
    reason; grey: refused, with a reason; red: wrong without a warning - outside the bound, an objection
    of the reference, a warning that is missing, or no reason."""
    if not point["reason"] and point["status"] != "solved":
        return "red"
    if point["answered"] != "1":
        return "grey"
    if point["warned"] == "1":
        return "yellow"
    if point["must_warn"] == "1" or point["objection"]:
        return "red"
    return "green" if point.number("difference") <= point.number("bound") else "red"


def count(points, verdict):
    return sum(judge(point) == verdict for point in points)


def seeded_faults(seeded, sheets):
    """[(sheet, fault, answers without a warning, red of them, rows with any, rows with a red one, the
    others' names)]. A fault is found when every row that answers without a warning turns red, and there
    is one."""
    runs = []
    for sheet, fault in ((sheet, fault) for sheet in sheets for fault in FAULTS):
        silent = seeded.where(sheet=sheet, fault=fault, answered="1", warned="0")
        rows = {f"{parameter}: {row}": count(of_row, "red")
                for (parameter, row), of_row in silent.groups("parameter", "row").items()}
        missed = sorted(name for name, red in rows.items() if red == 0)
        runs.append((sheet, fault, len(silent), sum(rows.values()), len(rows), len(rows) - len(missed),
                     "; ".join(missed)))
    return runs


def checks(points, faults, guards, folder):
    """guards: their table, or None for a part of the sweeps, which has no check over all of them."""
    command = f"build/release/bin/stability_suite --out {folder}"
    found = []
    sheets = points.groups("sheet")
    for sheet, of_sheet in sheets.items():
        red = count(of_sheet, "red")
        found.append(Check(f"stability, {sheet}: points wrong without saying so, of {len(of_sheet)}", red, "0", red == 0,
                           f"{command} --sheet {sheet}"))
    for sheet in dict.fromkeys(run[0] for run in faults):
        of_sheet = [run for run in faults if run[0] == sheet]
        right = sum(rows > 0 and red_rows == rows for _, _, _, _, rows, red_rows, _ in of_sheet)
        found.append(Check(f"stability, {sheet}: seeded faults found (sign, normal, scale)", right, str(len(of_sheet)),
                           right == len(of_sheet), f"{command} --sheet {sheet}"))
    if guards is not None:
        # A product that refuses everything is never wrong.
        green = 100.0 * count(points, "green") / len(points) if len(points) else 0.0
        found.append(Check("stability: points answered accurately and without a warning, %", green, ">= 50", green >= 50.0,
                           command))
        share = guards.where(name="share_percent").mean("value")
        found.append(at_most("guards: share of an update of the default head, %", share, 3.0, "",
                             "build/release/bin/bench_guards"))
    return found


def draw(sheet, points, path):
    """A panel per parameter, a line per row: what was asked."""
    panels = points.groups("parameter")
    rows = {name: of_panel.values("row") for name, of_panel in panels.items()}
    width, total = 10.5, 0.75 + sum(0.28 * len(of_panel) + 0.75 for of_panel in rows.values())
    fig, axes = chart.figure("Stability: " + TITLES.get(sheet, sheet), rows=len(panels), size=(width, total))
    fig.set_layout_engine("none")
    axes = [axes] if len(panels) == 1 else list(axes)
    top = total - 0.75
    for ax, (name, of_panel) in zip(axes, panels.items()):
        height = 0.28 * len(rows[name])
        ax.set_position([0.26, (top - height) / total, 0.71, height / total])
        top -= height + 0.75
        for verdict in MARKS:  # red last, so that nothing hides it
            there = of_panel.where(lambda point: judge(point) == verdict)
            ax.plot(there.numbers("x"), [rows[name].index(point["row"]) for point in there], linestyle="none",
                    markersize=7, clip_on=False, label=f"{count(points, verdict)} {MEANINGS[verdict]}", **MARKS[verdict])
        x = of_panel.numbers("x")
        ax.set_yticks(range(len(rows[name])), rows[name])
        ax.set_ylim(len(rows[name]) - 0.5, -0.5)
        chart.label(ax, name, "", log_x=x.min() > 0 and x.max() > LOG_RATIO * x.min())
    chart.legend(axes[0], loc="lower left", bbox_to_anchor=(-0.35, 1.0), ncols=4, handletextpad=0.1)
    chart.save(fig, path)


def main(arguments):
    parser = Parser("stability", "Verdicts on the points of stability_suite, maps and summary.json.")
    parser.add_argument("--dir", default="out/stability", help="folder of points.csv and seeded.csv; results go there")
    parser.add_argument("--partial", action="store_true", help="only a part was swept: no check over all sheets")
    options = parser.parse_args(arguments)
    folder = options.dir
    points, seeded = (Table.read(f"{folder}/{name}.csv", NEEDED) for name in ("points", "seeded"))
    guards = None if options.partial else Table.read(f"{folder}/guards.csv", ("name", "value"))
    for sheet, of_sheet in points.groups("sheet").items():
        draw(sheet, of_sheet, f"{folder}/{sheet}.png")
    for point in points.where(lambda point: judge(point) == "red"):
        print(f"  red: {point['parameter']} = {point['x']}, {point['row']}: {point['status']}, difference "
              f"{point.number('difference'):.3g}, bound {point.number('bound'):.3g} {point['unit']}; "
              f"{point['objection']}; {point['reason']}")
    # The coarse grid seeds nothing.
    faults = seeded_faults(seeded, points.values("sheet") if seeded.rows or not options.partial else [])
    columns = ("sheet", "fault", "answers", "red", "rows", "red_rows", "missed")
    write_file(f"{folder}/faults.csv", csv_text(columns, faults))
    found = checks(points, faults, guards, folder)
    write_file(f"{folder}/summary.json", summary_json(found))
    print_checks(found)
    print(", ".join(f"{count(points, verdict)} {verdict}" for verdict in MARKS))
    return every_check_holds(found)
