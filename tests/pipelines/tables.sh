#!/usr/bin/env bash
# Every CSV that a run writes, read by numpy without options: the columns that its metadata describe, in their order,
# numbers where they have a unit. And docs/examples/plot_sweep.py on the sweep beside it.
# usage: tables.sh SHAKEBED EXAMPLES   (exit 77: no numpy here)
set -eu
shakebed=$(realpath "$1")
examples=$(realpath "$2")
python=
for one in python3 /usr/bin/python3; do
  "$one" -c 'import numpy, matplotlib' 2>/dev/null && { python=$one; break; }
done
[ -n "$python" ] || { echo "SKIPPED: numpy or matplotlib is not installed (Debian: python3-numpy, python3-matplotlib)"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat >study.json <<'J'
{ "name": "study", "stages": [
  { "stage": "simulate", "id": "bed", "disks": { "count": 60, "diameter": "3 mm", "restitution": 0.8 },
    "box": { "width": "18.9 mm", "sides": { "kind": "hard", "restitution": 0.8 } },
    "floor": { "motion": "sinusoidal", "gamma": 3, "frequency": "20 Hz", "restitution": 0.8 },
    "settle": "0.5 s", "measure": "1 s", "replicas": 2, "frames": { "count": 16, "phases": 8 },
    "observe": ["order", "velocities", "displacement", "pressure", "phases"] },
  { "stage": "study", "id": "beds", "replicas": 2,
    "parameter": { "name": "bath_T", "values": [0.5, 2], "set": ["/stages/bath/bath/temperature"] },
    "stages": [
      { "stage": "simulate", "id": "bath", "units": "reduced", "disks": { "count": 60, "restitution": 1 },
        "box": { "width": 10.3, "sides": "periodic" }, "floor": { "motion": "still" },
        "bath": { "kind": "langevin", "temperature": 1, "rate": 0.1, "interval": 0.1 },
        "settle": 5, "measure": 20, "observe": ["velocities"] } ],
    "collect": { "T": { "at": "/bath/temperature_x" } },
    "tables": { "velocities": { "at": "/bath/velocities.csv", "key": "height" } } } ] }
J
"$shakebed" init starter.json >/dev/null
"$shakebed" run starter.json --out starter --preset quick --set /stages/bed/frames/count=8 --quiet >/dev/null 2>&1 || [ $? = 6 ]
"$shakebed" run study.json --out study --quiet >/dev/null 2>&1
"$shakebed" run "$examples/sweep.json" --out rise --preset quick --quiet >/dev/null 2>&1
cat >read.py <<'P'
import json, pathlib, sys, numpy

files = [f for out in ("starter", "study", "rise") for f in sorted(pathlib.Path(out).rglob("*.csv"))
         if ".shakebed" not in f.parts]
wrong = 0
for f in files:
    described = [c["name"] for c in json.load(open(f"{f}-metadata.json"))["tableSchema"]["columns"]]
    table = numpy.genfromtxt(f, delimiter=",", names=True, dtype=None, encoding="utf-8")
    lines = open(f).read().splitlines()
    faults = []
    if list(table.dtype.names) != described:
        faults.append(f"columns {table.dtype.names}, described {described}")
    if table.size != len(lines) - 1:
        faults.append(f"{table.size} rows of {len(lines) - 1}")
    for name in table.dtype.names:
        cells = [line.split(",")[described.index(name)] for line in lines[1:]] if name in described else []
        if table[name].dtype.kind == "f" and numpy.count_nonzero(numpy.isnan(table[name])) != cells.count(""):
            faults.append(f"{name} has cells that are no number")
    if faults:
        wrong += 1
        print(f, *faults, sep="\n  ")
kinds = {f.name for f in files}
for name in ("profile.csv", "disks.csv", "curve.csv", "velocities.csv", "pressure.csv", "table.csv", "sweep.csv"):
    if name not in kinds:
        wrong += 1
        print("no", name, "was written")
heights = numpy.genfromtxt("study/bed/profile.csv", delimiter=",", names=True)["height"][:3]
if not numpy.all(numpy.diff(heights) > 0):
    wrong += 1
    print("heights of a profile:", heights)
print(f"{len(files)} tables read by numpy" + (f"; {wrong} WRONG" if wrong else ""))
sys.exit(1 if wrong else 0)
P
"$python" read.py
MPLBACKEND=Agg "$python" "$examples/plot_sweep.py" rise/sweep.csv rise.png
[ "$(head -c 4 rise.png | tail -c 3)" = PNG ] || { echo "FAILED: plot_sweep.py drew nothing"; exit 1; }
