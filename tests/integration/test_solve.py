# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift solve` as a user runs it: the worked examples of docs/solve.md against their closed forms, and every bad problem
file refused with one line."""
import json
import tempfile
from pathlib import Path

import pytest
from programs import SOURCE, brainshift, good, refused, write

EXAMPLES = SOURCE / "docs" / "examples" / "solve"
HEADING = "name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm,contact_pressure_pa"
UX, UY, UZ, CONTACT_PRESSURE = 3, 4, 5, 6  # of a probe's row


class Solved:
    """What solve wrote. probes: name to x, y, z, ux, uy, uz, contact pressure; with time steps also time and pore pressure,
    step after step."""

    def __init__(self, problem):
        with tempfile.TemporaryDirectory(prefix="brainshift-") as name:
            vtu, csv = Path(name) / "u.vtu", Path(name) / "p.csv"
            done = good(brainshift("solve", "--problem", problem, "--out", vtu, "--probes", csv, "--json"))
            self.summary, self.err, self.vtu = json.loads(done.stdout), done.stderr, vtu.read_bytes()
            heading, *rows = csv.read_text().splitlines()
        assert heading in (HEADING, HEADING + ",time_s,pore_pressure_pa")
        self.probes = {}
        for row in rows:
            name, *numbers = row.split(",")
            self.probes.setdefault(name, []).extend(map(float, numbers))


def within(exact, percent):
    return pytest.approx(exact, rel=percent / 100.0, abs=0.0)


def test_thick_sphere_expands_as_lames_formula():
    solved = Solved(EXAMPLES / "thick_sphere.yaml")
    assert solved.probes["inner"][UX] == within(0.285705, 3.0)
    assert solved.probes["outer"][UZ] == within(0.0714429, 3.0)
    assert solved.summary["warnings"] == []
    assert solved.summary["min_jacobian"] > 0.9


def test_signorini_block_is_compressed_uniformly():
    solved = Solved(EXAMPLES / "signorini_block.yaml")
    assert solved.probes["bottom"][UZ] == within(-0.5, 1.0)
    assert solved.probes["bottom"][CONTACT_PRESSURE] == within(150.0, 1.0)
    assert solved.probes["side"][UX] == within(0.15, 1.0)
    assert solved.summary["contact"][0]["force_n"][2] == within(0.015, 1.0)
    for name in (b'"displacement"', b'"stress_pa"', b'"von_mises_pa"', b'"contact_pressure_pa"'):
        assert name in solved.vtu


def test_layered_column_sags_as_the_one_dimensional_solution():
    solved = Solved(EXAMPLES / "layered_column.yaml")
    assert solved.probes["interface"][UZ] == within(-2.280046125, 1e-6)
    assert solved.probes["top"][UZ] == within(-4.486542375, 1e-6)


def test_consolidating_column_follows_terzaghi():
    """p = q sum 4 / ((2m+1) pi) sin(...) exp(...) and its settlement at T = 0.5 (tests/verification/terzaghi_test.cpp); 8
    elements over the height."""
    solved = Solved(EXAMPLES / "consolidating_column.yaml")
    row, steps = 9, 40
    bottom, top = solved.probes["bottom"], solved.probes["top"]
    assert len(bottom) == row * steps
    assert bottom[row - 1] == within(100.0, 3.0)  # at first the fluid carries the load
    assert bottom[-2] == pytest.approx(6.0, rel=0.0, abs=1e-9)
    assert bottom[-1] == within(37.08, 3.0)
    assert top[-1] == 0.0
    assert top[len(top) - row + UZ] == within(-1.528, 2.0)
    assert solved.summary["element"] == "p1"
    assert solved.summary["probes"][0]["pore_pressure_pa"] == pytest.approx(bottom[-1], rel=0.0, abs=1e-6)
    assert b'"pore_pressure_pa"' in solved.vtu


# ---------- bad problem files ----------

GOOD_PROBLEM = f"""\
mesh:
  file: {EXAMPLES / "signorini_block.msh"}
  element: p2
materials:
  tissue:
    youngs_modulus_pa: 3000.0
    poisson_ratio: 0.3
regions:
  block: tissue
conditions:
  held:
    on: bottom
    displacement_mm: [0, 0, 0]
  push:
    on: top
    pressure_pa: 10.0
probes:
  middle: [5, 5, 5]
"""

# name: (text of the good problem, what replaces it, the key that the refusal names)
BAD_PROBLEMS = {
    "UnknownGroup": ("on: top", "on: lid", "conditions.push.on = lid"),
    "UnknownRegion": ("block: tissue", "brain: tissue", "regions.brain"),
    "RegionWithoutMaterial": ("  block: tissue\n", "  {}\n", "regions"),
    "MissingMaterial": ("block: tissue", "block: bone", "regions.block = bone"),
    "NegativeModulus": ("3000.0", "-3000.0", "materials.tissue.youngs_modulus_pa"),
    "TwoModuli": ("poisson_ratio: 0.3", "poisson_ratio: 0.3\n    shear_modulus_pa: 1.0", "materials.tissue.youngs_modulus_pa"),
    "Incompressible": ("0.3", "0.5", "materials.tissue.poisson_ratio = 0.5"),
    "NearlyIncompressible": ("0.3", "0.49995", "materials.tissue.poisson_ratio"),
    "NoSupport": ("displacement_mm: [0, 0, 0]", "displacement_z_mm: 0.0",
                  "conditions: the body is not held: 3 of its 6 rigid motions are free"),
    "NothingHeld": ("  held:\n    on: bottom\n    displacement_mm: [0, 0, 0]\n", "",
                    "conditions: the body is not held: 6 of its 6"),
    "WrongElement": ("element: p2", "element: hex8", "mesh.element = hex8"),
    "UnknownKey": ("pressure_pa", "presure_pa", "conditions.push.presure_pa"),
    "UnknownSection": ("probes:", "probe:", "probe"),
    "TwoKinds": ("pressure_pa: 10.0", "pressure_pa: 10.0\n    displacement_x_mm: 1.0", "conditions.push"),
    "MissingMesh": ("signorini_block.msh", "none.msh", "mesh.file"),
    "UnreadableMesh": (str(EXAMPLES / "signorini_block.msh"), "no_mesh.msh", "mesh.file"),
    "NotFinite": ("pressure_pa: 10.0", "pressure_pa: .nan", "conditions.push.pressure_pa"),
    "ProbeOutside": ("[5, 5, 5]", "[5, 5, 15]", "probes.middle"),
    "Contradiction": ("pressure_pa: 10.0", "displacement_mm: [0, 0, 1]\n  again:\n    on: top\n    displacement_z_mm: 2.0",
                      "conditions.again prescribes 2 mm"),
    "EmptySelector": ("probes:", "groups:\n  far:\n    box: {min_mm: [90, 0, 0], max_mm: [91, 1, 1]}\nprobes:", "groups.far"),
    "GroupNamedTwice": ("probes:", "groups:\n  top:\n    box: {min_mm: [0, 0, 0], max_mm: [9, 9, 9]}\nprobes:", "groups.top"),
    "ObstacleThatIsNone": ("probes:", "contact:\n  floor: {on: bottom, surface: floor.stl}\nprobes:", "contact.floor.surface"),
    "NegativeRadius": ("probes:",
                       "contact:\n  ball:\n    on: bottom\n    sphere: {centre_mm: [0, 0, -9], radius_mm: -1}\nprobes:",
                       "contact.ball.sphere.radius_mm"),
    "TimeStepsWithQuadraticElements": ("probes:", "time:\n  steps_s: [0.1, 0.2]\nprobes:", "mesh.element = p2"),
    "ContactWithTimeSteps": ("element: p2",
                             "element: p1\ntime: {steps_s: [1.0]}\ncontact:\n  floor:\n    on: bottom\n"
                             "    plane: {point_mm: [0, 0, 0], normal: [0, 0, 1]}",
                             "contact.floor"),
    "NegativeTimeStep": ("probes:", "time:\n  steps_s: [0.1, -0.2]\nprobes:", "time.steps_s"),
    "PorePressure": ("pressure_pa: 10.0", "pore_pressure_pa: 10.0", "conditions.push.pore_pressure_pa"),
}


@pytest.mark.parametrize("change", BAD_PROBLEMS.values(), ids=BAD_PROBLEMS)
def test_a_bad_problem_file_exits_two_with_one_line_that_names_the_key(folder, change):
    replaced, replacement, says = change
    assert replaced in GOOD_PROBLEM
    problem = write(folder / "bad.yaml", GOOD_PROBLEM.replace(replaced, replacement, 1))
    write(folder / "no_mesh.msh", "not a mesh")
    write(folder / "floor.stl", "not a surface")
    (folder / "out").mkdir()
    refused(brainshift("solve", "--problem", problem, "--out", folder / "out" / "u.vtu"), "bad.yaml", says)
    assert not any((folder / "out").iterdir()), "something half-written was left"


def test_the_table_starts_from_one_that_solves(folder):
    solved = Solved(write(folder / "good.yaml", GOOD_PROBLEM))
    assert solved.probes["middle"][UZ] < 0.0
    assert solved.err == ""


def test_linear_elements_that_lock_are_flagged(folder):
    text = GOOD_PROBLEM.replace("p2", "p1", 1).replace("0.3", "0.49", 1)
    solved = Solved(write(folder / "locks.yaml", text))
    assert len(solved.summary["warnings"]) == 1
    assert "locks" in solved.summary["warnings"][0]
    assert "warning: element p1 locks" in solved.err


def test_help_of_solve_teaches_and_missing_options_are_named():
    shown = good(brainshift("solve", "--help"))
    assert "--problem" in shown.stdout and "Examples:" in shown.stdout
    bare = brainshift("solve", "--problem", "p.yaml")
    assert bare.returncode == 2
    assert "--out" in bare.stderr
