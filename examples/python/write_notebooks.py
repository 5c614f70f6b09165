"""Writes five_minutes.ipynb and temperature_against_gamma.ipynb: the cells of the .py files, run, with what they print.

    python3 write_notebooks.py [--check]      --check: writes nothing, fails where a notebook would change
"""

import contextlib
import io
import json
import sys
from pathlib import Path

names = ("five_minutes", "temperature_against_gamma")


def cells_of(text):
    """(kind, lines) of every cell of a file with "# %%" lines."""
    kind, lines = "code", []
    for line in text.splitlines():
        if line.startswith("# %%"):
            if lines:
                yield kind, lines
            kind, lines = ("markdown" if "[markdown]" in line else "code"), []
        else:
            lines.append(line)
    yield kind, lines


def stripped(kind, lines):
    if kind == "markdown":
        lines = [line[2:] if line.startswith("# ") else line.lstrip("#") for line in lines]
    return "\n".join(lines).strip("\n")


def source(text):
    return [line + "\n" for line in text.splitlines()[:-1]] + text.splitlines()[-1:]


def notebook(path):
    """The notebook of a file; its cells run one after the other in one namespace."""
    cells, space = [], {"__name__": "__main__"}
    for kind, lines in cells_of(path.read_text(encoding="utf-8")):
        text = stripped(kind, lines)
        cell = {"cell_type": kind, "id": f"cell-{len(cells)}", "metadata": {}, "source": source(text)}
        if kind == "code":
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(text, path.name, "exec"), space)
            output = {"name": "stdout", "output_type": "stream", "text": source(printed.getvalue())}
            cell.update(execution_count=None, outputs=[output] if printed.getvalue() else [])
        cells.append(cell)
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    document = {"cells": cells, "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}}, "nbformat": 4,
                "nbformat_minor": 5}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    here = Path(__file__).resolve().parent
    for name in names:
        text, file = notebook(here / f"{name}.py"), here / f"{name}.ipynb"
        if "--check" not in sys.argv:
            file.write_text(text, encoding="utf-8")
        elif not file.is_file() or file.read_text(encoding="utf-8") != text:
            sys.exit(f"{file} is not what its cells print now: run write_notebooks.py")
