# SPDX-License-Identifier: GPL-3.0-or-later
"""Every bad input exits 2 with one line on stderr that names the file, key or set and the value, prints nothing to stdout and
leaves nothing behind. One input for each way into a refusal; the readers' own tests have the other kinds of bad files."""
import os
import stat
import struct

import pytest
from programs import COARSE_CASE, HEAD, LOCAL, brainshift, brainshiftd, coarse_case, good, refused, run, serve, write


def nifti(value):
    """A NIfTI-1 volume of 8-bit voxels of 4 mm, all of one value."""
    size = 20
    data = bytearray(352)

    def put(at, form, *numbers):
        struct.pack_into("<" + form, data, at, *numbers)

    put(0, "i", 348)
    put(40, "4h", 3, size, size, size)
    put(70, "hh", 2, 8)  # unsigned char
    put(80, "3f", 4.0, 4.0, 4.0)
    put(108, "f", 352.0)
    put(123, "b", 2)  # mm
    put(254, "h", 1)
    for axis in range(3):
        put(280 + 16 * axis + 4 * axis, "f", 4.0)
        put(280 + 16 * axis + 12, "f", -40.0)
    put(344, "3s", b"n+1")
    return bytes(data) + bytes([value]) * size**3


def msh(edge, inverted=False, flat=False):
    """Gmsh 2.2 text: a block of cubes of the given edge length in the file's unit, each cut into Kuhn's six tetrahedra, all
    along its diagonal: they fit from cube to cube."""
    cells = 6
    side = range(cells + 1)

    def node(i, j, k):
        return 1 + i + (cells + 1) * (j + (cells + 1) * k)

    nodes = [f"{node(i, j, k)} {edge * i} {edge * j} {0.0 if flat else edge * k}" for k in side for j in side for i in side]
    orders = ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2))
    tets = []
    for cell in range(cells**3):
        for index, order in enumerate(orders):
            at = [cell % cells, cell // cells % cells, cell // cells // cells]
            corners = [node(*at)]
            for axis in order:
                at[axis] += 1
                corners.append(node(*at))
            if (index >= 3) != (inverted and len(tets) == 100):
                corners[2], corners[3] = corners[3], corners[2]
            tets.append(f"{len(tets) + 1} 4 2 1 1 " + " ".join(map(str, corners)))
    return "\n".join(["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes)), *nodes, "$EndNodes", "$Elements",
                      str(len(tets)), *tets, "$EndElements", ""])


def changed(*changes):
    """The coarse case with lines replaced."""
    return lambda folder: write(folder / "bad.yaml", coarse_case(*changes))


def mesh_from(file):
    """A ready mesh instead of the generated one."""
    return ("mesh", "generate", f"file: {file}"), ("mesh", "edge_mm", "")


def with_brain(content):
    return lambda folder: changed(("images", "brain", f"brain: {write(folder / 'mask.nii', content)}"))(folder)


def with_mesh(content):
    return lambda folder: changed(*mesh_from(write(folder / "mesh.msh", content)))(folder)


# name: (makes the case file in a folder and returns it, what the refusal names)
BAD_CASES = {
    "NoCaseFile": (lambda folder: folder / "none.yaml", ["none.yaml"]),
    "CaseFileThatIsNoYaml": (lambda folder: write(folder / "bad.yaml", "a: [1, 2\nb"), ["bad.yaml"]),
    "MissingImage": (changed(("images", "brain", "brain: /nonexistent/brain.nii.gz")), ["/nonexistent/brain.nii.gz"]),
    "ImageThatIsNone": (with_brain("not an image"), ["mask.nii"]),
    "MaskWithoutComponent": (with_brain(nifti(0)), ["brain"]),
    "UnknownKey": (changed(("mesh", "edge_mm", "edge_cm: 1.2")), ["bad.yaml", "edge_cm"]),
    "EdgeInMetres": (changed(("mesh", "edge_mm", "edge_mm: 0.012")), ["bad.yaml", "edge_mm", "0.012"]),
    "TumourOutsideTheBrain": (changed(("tumour", "centre_mm", "centre_mm: [470.0, -45.0, 2.0]")), ["tumour"]),
    "CraniotomyThatSelectsNoNode": (changed(("craniotomy", "long_axis_mm", "long_axis_mm: 1.0"),
                                            ("craniotomy", "short_axis_mm", "short_axis_mm: 1.0")), ["craniotomy"]),
    "MissingMesh": (changed(*mesh_from("/nonexistent/mesh.msh")), ["/nonexistent/mesh.msh"]),
    "InvertedTetrahedron": (with_mesh(msh(25.0, inverted=True)), ["mesh.msh"]),
    "FlatTetrahedra": (with_mesh(msh(25.0, flat=True)), ["mesh.msh"]),
    "MeshInMetres": (with_mesh(msh(0.025)), ["mesh.msh"]),
    "MeshFreeToFloat": (lambda folder: write(folder / "bad.yaml", coarse_case() + "\ncontact:\n  slave_depth_mm: 300.0\n"),
                        ["fixed"]),
}


@pytest.mark.parametrize("bad", BAD_CASES.values(), ids=BAD_CASES)
def test_bad_input_exits_two_with_one_line(folder, bad):
    assert HEAD.exists(), "Debian's mricron-data is not installed"
    make, says = bad
    case = make(folder)
    (folder / "out").mkdir()
    done = brainshiftd("prepare", "--case", case, "--out", folder / "out" / "m.h5", "--json")
    refused(done, *says)
    assert done.stdout == ""
    assert not any((folder / "out").iterdir()), "something half-written was left"


# ---------- usage ----------


def test_bad_usage_exits_two_with_one_line(folder):
    config = write(folder / "daemon.yaml", LOCAL)
    unknown = write(folder / "unknown.yaml", "enpoint: tcp://127.0.0.1:*\n")
    no_folder = write(folder / "folder.yaml", "journal_dir: /nonexistent/journal\n")
    garbage = write(folder / "garbage.h5", "not a model")
    prepare, serve_here = ("prepare", "--case", COARSE_CASE), ("serve", "--config", config)
    for arguments, says in (
            ((), "subcommand"),
            (("prepare", ), "--case"),
            (prepare, "--out"),
            ((*prepare, "--out", "m.h5", "--fast"), "--fast"),
            ((*prepare, "--out", "/nonexistent/m.h5"), "/nonexistent"),
            ((*prepare, "--out", folder), "folder"),
            ((*prepare, "--out", garbage), "garbage.h5: is there and is no model file"),
            (("serve", ), "--config"),
            (("serve", "--config", folder / "none.yaml"), "none.yaml"),
            (("serve", "--config", unknown), "enpoint"),
            (("serve", "--config", no_folder), "/nonexistent/journal"),
            ((*serve_here, "--model", folder / "none.h5"), "none.h5"),
            ((*serve_here, "--model", garbage), "garbage.h5"),
            ((*serve_here, "--endpoint", "nonsense"), "nonsense"),
    ):
        done = brainshiftd(*arguments, limit_s=30.0)
        refused(done, says)
        assert done.stdout == "", arguments


def test_endpoints_that_may_not_serve_are_refused_in_one_line(folder):
    """Each would make the daemon serve nobody, or everybody, or end a file."""
    config = write(folder / "daemon.yaml", LOCAL)
    open_to_all = write(folder / "open.yaml", "endpoint: tcp://0.0.0.0:*\n")
    keyless = write(folder / "keyless.yaml", "endpoint: tcp://0.0.0.0:*\nallow_remote: true\n")
    patient = write(folder / "patient.h5", "model")
    for file, endpoint, says in (
            (config, "inproc://x", "inproc://x"),
            (config, "tcp://0.0.0.0:*", "allow_remote"),
            (config, "tcp://*:*", "allow_remote"),
            (config, "ipc://@x", "ipc://@x"),
            (config, f"ipc://{patient}", "no socket"),
            (config, f"ipc://{folder / 'no' / 's'}", "does not exist"),
            (keyless, None, "security.secret_key is missing"),
            (open_to_all, None, "open.yaml"),
    ):
        where = () if endpoint is None else ("--endpoint", endpoint)
        refused(brainshiftd("serve", "--config", file, *where, limit_s=30.0), says)
    assert patient.is_file()


def test_keys_that_others_may_use_are_refused_in_one_line(folder):
    secret = folder / "daemon.secret"
    good(brainshift("keys", "make", "daemon", "--dir", folder))
    good(brainshift("keys", "add", "--allow", folder / "list", "--role", "owner", folder / "daemon.public"))
    config = LOCAL + "security:\n  secret_key: daemon.secret\n  allow_list: list\n"
    with serve(folder, config) as daemon:
        assert daemon.address.startswith("tcp://")
        assert daemon.end() == 0
    secret.chmod(0o644)
    refused(brainshiftd("serve", "--config", folder / "daemon.yaml", limit_s=30.0), "daemon.secret", "mode 644", "chmod 600")
    refused(brainshift("keys", "check", secret), "daemon.secret", "mode 644")
    refused(brainshift("keys", "make", "daemon", "--dir", folder), "daemon.secret", "never overwritten")


def test_the_socket_of_an_ipc_endpoint_is_for_the_owner_alone(folder):
    with serve(folder, f"endpoint: ipc://{folder / 'socket'}\n") as daemon:
        assert daemon.address.startswith("ipc://")
        assert stat.S_IMODE((folder / "socket").stat().st_mode) == 0o600
        # A second daemon does not take the endpoint over.
        second = brainshiftd("serve", "--config", folder / "daemon.yaml", limit_s=30.0)
        assert second.returncode == 1
        assert "another process listens" in second.stderr
        assert daemon.end() == 0


def test_help_teaches_and_version_tells():
    shown = good(brainshiftd("--help")).stdout
    assert "prepare" in shown and "serve" in shown and "Examples:" in shown
    for command in ("prepare", "serve"):
        assert "Examples:" in good(brainshiftd(command, "--help")).stdout
    assert good(brainshiftd("--version")).stdout.startswith("brainshiftd ")


def test_a_command_of_the_other_program_is_handed_over():
    assert "Model file to write" in good(brainshift("prepare", "--help")).stdout
    assert "Tables, pictures" in good(brainshiftd("report", "--help")).stdout


def test_a_slip_is_understood(folder):
    refused(brainshift("repaly", folder / "s.surgery"), "did you mean replay?")
    refused(brainshiftd("prepar", "--case", "c.yaml"), "did you mean prepare?")
    for program in (brainshift, brainshiftd):  # never from one to the other and back
        refused(program("dance"), "unknown command \"dance\": must be one of init, ", program="brainshift")


def test_bad_usage_of_the_client_exits_two_with_one_line(folder):
    for arguments in (
            (),
            ("dance", ),
            ("simulate", "--case", COARSE_CASE, "--scenario", "none", "--out", folder / "s.surgery"),
            ("replay", folder / "none.surgery", "--report", folder / "r.json"),
            ("report", folder / "none.json", "--out", folder / "report"),
    ):
        refused(brainshift(*arguments, limit_s=30.0))


# Every option that names an output.
NONE, GOOD = "none", "good.json"
RECONSTRUCT = ("brainshift", "stereo", "reconstruct", "--left", NONE, "--right", NONE, "--calibration", NONE, "--pose", NONE)
OUTPUTS = (
    ("brainshiftd", "prepare", "--case", NONE, "--out"),
    ("brainshift", "simulate", "--case", NONE, "--scenario", "paper", "--out"),
    ("brainshift", "replay", NONE, "--report"),
    ("brainshift", "replay", NONE, "--report", GOOD, "--latency-csv"),
    ("brainshift", "solve", "--problem", NONE, "--out"),
    ("brainshift", "solve", "--problem", NONE, "--out", GOOD, "--probes"),
    ("brainshift", "import", "--recording", NONE, "--out"),
    ("brainshift", "stereo", "calibrate", "--left", NONE, "--right", NONE, "--square-mm", "5", "--out"),
    (*RECONSTRUCT, "--out"),
    (*RECONSTRUCT, "--out", GOOD, "--disparity-png"),
    ("brainshift", "stereo", "observe", "--surface", NONE, "--model", NONE, "--sd-mm", "1", "--out"),
)


def test_a_bad_output_is_refused_before_the_work_with_option_and_path(folder):
    """The inputs do not exist: the outputs are looked at first."""
    pipe = folder / "pipe"
    os.mkfifo(pipe, 0o600)
    for command in OUTPUTS:
        program, *arguments = [folder / word if word in (NONE, GOOD) else word for word in command]
        for path in ("/dev/null", pipe, folder, folder / "no" / "out", "/proc/out"):
            refused(run(program, *arguments, path, limit_s=30.0), f"{arguments[-1]}: {path}: ")
    assert pipe.is_fifo()
    assert os.path.exists("/dev/null") and stat.S_ISCHR(os.stat("/dev/null").st_mode)
    assert not (folder / GOOD).exists()


def test_a_reports_folder_is_looked_at_before_the_work(folder):
    file = write(folder / "file", "")
    for path in (file, file / "below", "/dev/null"):
        refused(brainshift("report", folder / "none.json", "--out", path, limit_s=30.0), f"--out: {path}: ")
