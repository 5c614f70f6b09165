#!/usr/bin/env python3
"""Takes the tables of the full presets over into this folder and writes manifest.json.

    shakebed reproduce all --preset full --out OUT
    collect.py OUT

Of each recipe below that OUT holds: the tables of its studies, its claims with their verdicts, and what made them. Of a
run of some stages only (`--until control-claims`) their tables are taken over, and the others stay.
"""
import json
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
# recipe: file here -> file of the results
TABLES = {
    "quinn-hong-fig1": {
        "fig1-widths.csv": "widths/table.csv",
        "fig1-widths-rows.csv": "widths/rows.csv",
        "fig1-vacancies.csv": "vacancies/table.csv",
        "fig1-retained.csv": "retained/table.csv",
        "fig1-claims.csv": "claims/claims.csv",
        "fig1-order.csv": "order/table.csv",
        "fig1-control-claims.csv": "control-claims/claims.csv",
    },
    "quinn-hong-fig2": {
        "fig2-beds.csv": "beds/table.csv",
        "fig2-history.csv": "history/table.csv",
        "fig2-rows.csv": "rows/table.csv",
        "fig2-bottom.csv": "bottom/table.csv",
        "fig2-melting.csv": "melting/table.csv",
        "fig2-claims.csv": "claims/claims.csv",
        "fig2-controls.csv": "controls/table.csv",
        "fig2-higher.csv": "higher/table.csv",
        "fig2-control-claims.csv": "control-claims/claims.csv",
    },
    "quinn-hong-eq6": {
        "eq6-shaken.csv": "shaken/table.csv",
        "eq6-claims.csv": "claims/claims.csv",
        "eq6-repeated.csv": "repeated/table.csv",
        "eq6-weak.csv": "weak/table.csv",
        "eq6-control-claims.csv": "control-claims/claims.csv",
    },
    "quinn-hong-beyond": {
        "beyond-dissipation.csv": "dissipation/table.csv",
        "beyond-hot.csv": "hot/table.csv",
        "beyond-hot-velocities.csv": "hot/velocities.csv",
        "beyond-shaken.csv": "shaken/table.csv",
        "beyond-shaken-velocities.csv": "shaken/velocities.csv",
        "beyond-claims.csv": "claims/claims.csv",
        "beyond-controls.csv": "controls/table.csv",
        "beyond-control-claims.csv": "control-claims/claims.csv",
    },
    "quinn-hong-tc": {
        "tc-beds.csv": "beds/table.csv",
        "tc-claims.csv": "claims/claims.csv",
        "tc-bottom.csv": "bottom/table.csv",
        "tc-crystal.csv": "crystal/table.csv",
        "tc-control-claims.csv": "control-claims/claims.csv",
    },
    "temperature-map": {"temperature-map-beds.csv": "beds/table.csv"},
}


def taken_over(out, recipe, tables):
    """Copies the tables that are there; the recipe's row of the manifest."""
    run = json.loads((out / recipe / "manifest.json").read_text())
    if run["exit_code"] not in (0, 6):  # 6: a published number is not met, which is a result
        sys.exit(f"{recipe}: ended with {run['exit_code']}")
    files = []
    for here, there in tables.items():
        source = out / recipe / there
        if not source.exists():
            continue
        shutil.copyfile(source, HERE / here)
        cost = json.loads((source.parent / "cost.json").read_text())
        files.append({"file": here, "stage": source.parent.name, "cpu_seconds": round(cost["cpu_seconds"], 1)})
    return {
        "recipe": recipe,
        "preset": run["recipe"]["preset"],
        **{key: run[key] for key in ("shakebed", "git", "compiler", "build_type")},
        "finished": run["finished"],
        "files": files,
    }


def main():
    out = pathlib.Path(sys.argv[1])
    manifest = HERE / "manifest.json"
    rows = json.loads(manifest.read_text())["recipes"] if manifest.exists() else []
    for recipe, tables in TABLES.items():
        if not (out / recipe / "manifest.json").exists():
            continue
        row = taken_over(out, recipe, tables)
        new = {file["file"] for file in row["files"]}
        for old in rows:
            old["files"] = [file for file in old["files"] if file["file"] not in new]
        rows = [old for old in rows if old["files"]] + [row]
    rows.sort(key=lambda row: list(TABLES).index(row["recipe"]))
    what = ("Numbers of the full presets. cpu_seconds are those of the stage's last start: a study that was "
            "interrupted and went on counts only what came after.")
    manifest.write_text(json.dumps({"what": what, "recipes": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
