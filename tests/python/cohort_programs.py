# SPDX-License-Identifier: GPL-3.0-or-later
"""Stand-ins for brainshiftd and brainshift that answer at once: what brainshift-bids does around them is tested.

A replay's numbers follow from case and seed. Every replay adds a line to replays.log beside the programs. A case
that holds `refuse: me` is refused, one that holds `fail: me` fails.
"""
import stat

SCRIPT = r'''#!/usr/bin/python3 -SE
import hashlib, json, os, pathlib, re, signal, sys
name, args = os.path.basename(sys.argv[0]), sys.argv[1:]
given = dict(zip(args[1:], args[2:]))
def say(status, text):
    sys.exit((sys.stderr.write(f"{name}: {text}\n"), status)[1])
if args == ["--version"]:
    print(name, "0.1.0")
elif args[0] == "prepare":
    case = pathlib.Path(given["--case"]).read_text()
    if "refuse: me" in case: say(2, "case.yaml: refuse: not a section")
    if "fail: me" in case: say(1, "out of memory")
    case = "\n".join(line for line in case.splitlines() if not line.startswith("images:"))
    pathlib.Path(given["--out"]).write_text(re.sub(', "memory_limit_gib": [0-9.]+', "", case))  # a bound alone
elif args[0] == "serve":
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    print("listening on", given["--endpoint"], flush=True)
    while True: signal.pause()
elif args[0] == "simulate":
    if given["--scenario"] == "nonsense": say(2, "--scenario nonsense: no such scenario")
    with open(given["--out"], "x") as out: out.write(given["--scenario"] + " " + given["--seed"])
elif args[0] == "import":
    with open(given["--out"], "x") as out: out.write("recorded 0")
elif args[0] == "replay":
    surgery = pathlib.Path(args[1]).read_text()
    if surgery.startswith("broken"): say(2, f"{args[1]}: not a surgery file")
    model = pathlib.Path("model.h5").read_text()
    draw = int(hashlib.sha256((surgery + model).encode()).hexdigest()[:6], 16) / 0xffffff
    worse = 2.0 if "worse: true" in model else 1.0
    runs = [{"boundary": b, "method": given["--method"], "model_id": "m", "updates": 3, "recovery_pct": 100 - 10 * worse * draw,
             "quality": {"worst": "good", "counts": {"unusable": 0}}, "coverage_90": 0.9, "prepare_s": os.getpid() / 7,
             "error_mm": {"initial": {"mean": 2.0}, "cross": {"mean": 0.2 * worse * draw}}, "trace": [1]}
            for b in (["contact", "fixed"] if given["--boundary"] == "both" else [given["--boundary"]])]
    pathlib.Path(given["--report"]).write_text(json.dumps(runs))
    with open(os.path.join(os.path.dirname(sys.argv[0]), "replays.log"), "a") as log: log.write(given["--report"] + "\n")
elif args[0] == "report":
    out = pathlib.Path(given["--out"]); out.mkdir(exist_ok=True)
    (out / "report.html").write_text("".join(pathlib.Path(a).read_text() for a in args[1:args.index("--out")]))
else:
    say(2, "bad usage")
'''


def make(folder):
    folder.mkdir()
    for name in ("brainshiftd", "brainshift"):
        file = folder / name
        file.write_text(SCRIPT)
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return folder
