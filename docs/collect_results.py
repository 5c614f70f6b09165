#!/usr/bin/env python3
"""Takes over the results of record: collect_results.py OUT, the folder of `shakebed reproduce all --preset full --out OUT`.

Writes docs/results/<recipe>.json, and the leading figure as docs/results/<recipe>.svg, for every recipe that has claims.
The claims of Quinn and Hong's recipes are those taken over by reference-data/quinn-hong-2000/measured/collect.py.
Then build, since these files are part of the program, and write the pages: docs/collect_results.py --pages PROGRAM,
where PROGRAM is build/release/pipelines/shakebed. A test compares them.
"""
import csv
import json
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
KEPT = ("claim", "claimed", "measured", "verdict", "place", "measured_as", "note", "main")
QUINN_HONG = {"quinn-hong-fig1": "fig1", "quinn-hong-fig2": "fig2", "quinn-hong-eq6": "eq6",
              "quinn-hong-beyond": "beyond", "quinn-hong-tc": "tc"}


def write(recipe, source, claims, figure=None):
    record = {"source": source, "figure": figure, "claims": claims} if figure else {"source": source, "claims": claims}
    text = json.dumps(record, indent=1, ensure_ascii=False)
    (HERE / "results" / f"{recipe}.json").write_text(text + "\n")


def leading_figure(folder):
    """Copies the picture that the report begins with; its caption."""
    for results in sorted(folder.glob("*/chart.json")):
        for name, chart in json.loads(results.read_text()).items():
            if isinstance(chart, dict) and chart.get("lead"):
                shutil.copy(results.parent / f"{name}.svg", HERE / "results" / f"{folder.name}.svg")
                return {"file": f"{folder.name}.svg", "caption": chart.get("caption", "")}
    return None


def write_pages(program):
    recipes = sorted(path.parent.name for path in (HERE.parent / "pipelines/recipes").glob("*/figure.json"))
    for arguments, page in [([], "results.md")] + [([recipe], f"results/{recipe}.md") for recipe in recipes]:
        text = subprocess.run([program, "reproduce", *arguments, "--results"], check=True, capture_output=True).stdout
        (HERE / page).write_bytes(text)


def of_run(folder):
    manifest = json.loads((folder / "manifest.json").read_text())
    resolved = json.loads((folder / "resolved.json").read_text())
    stages = [stage.get("id") or "claims" for stage in resolved["stages"] if stage["stage"] == "claims"]
    claims = [claim for stage in stages for claim in json.loads((folder / stage / "claims.json").read_text())["claims"]]
    preset = resolved.get("$preset", "full")
    return f"preset {preset}, shakebed {manifest['shakebed']} ({manifest['git'][:12]})", \
        [{key: claim[key] for key in KEPT if key in claim} for claim in claims]


def measured_text(value, error):
    if not value:
        return "–"
    if not error and abs(float(value)) < 1e-10:
        return "below 1e-10"
    if not error or abs(float(error)) < 1e-12 * abs(float(value)):
        return f"{float(value):.4g}"
    return f"{float(value):.4g} ± {float(error):.2g}"


def of_table(path, mains):
    claims = []
    for row in csv.DictReader(path.open()):
        claim = {key: row[key] for key in ("claim", "claimed", "verdict", "place", "measured_as") if row.get(key)}
        claim["measured"] = measured_text(row["measured"], row["std_error"])
        if len(claims) in mains:
            claim["main"] = True
        claims.append(claim)
    return claims


def main():
    if sys.argv[1] == "--pages":
        return write_pages(sys.argv[2])
    out = pathlib.Path(sys.argv[1])
    for folder in sorted(out.iterdir()):
        if folder.name not in QUINN_HONG and (folder / "claims" / "claims.json").exists():
            write(folder.name, *of_run(folder), leading_figure(folder))
    measured = HERE.parent / "reference-data" / "quinn-hong-2000" / "measured"
    for recipe, short in QUINN_HONG.items():
        figure = json.loads((HERE.parent / "pipelines/recipes" / recipe / "figure.json").read_text())
        stage = next(stage for stage in figure["stages"] if stage["stage"] == "claims")
        mains = {i for i, claim in enumerate(stage["claims"]) if claim.get("main")}
        claims = of_table(measured / f"{short}-claims.csv", mains)
        controls = measured / f"{short}-control-claims.csv"
        if controls.exists():
            claims += of_table(controls, set())
        write(recipe, "preset full (reference-data/quinn-hong-2000/measured)", claims)


if __name__ == "__main__":
    main()
