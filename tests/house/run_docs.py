#!/usr/bin/env python3
"""Runs the documents. Each page of the tutorial and of the how-to has a fresh folder in which its blocks are run in order:

  console  lines after "$ " are run; the lines below are what must be printed, up to numbers; "..." alone stands for any
           lines, at the end of a line for the rest of it. Numbers of an answer (lines that begin with "fit" and name T/(m g)) must agree
           to 3 % or one unit of their last digit
  json     a recipe, a stage, or a part of a recipe: checked by `shakebed validate`
  python   run
  sh       run
  yaml     parsed; its lines that call shakebed are run

A comment above a block changes this: <!-- file: NAME --> saves it; <!-- needs: MODULE ... --> skips it where Python has no such
module; <!-- exit: 6 --> expects that exit code; <!-- not run: why --> leaves it out. <!-- page: long --> makes the page one of
the long set; <!-- page needs: PROGRAM ... --> skips it where a program is missing.

usage: run_docs.py PROGRAM REPOSITORY quick|long [PAGE ...]    (exit 1: a page is wrong)
"""
import functools
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

PARTS = ("docs/tutorial", "docs/how-to", "docs/explanation")
CHECKED = {"console", "json", "python", "sh", "yaml"}


def blocks_of(text):
    """(line, language, directives, lines) of each fenced block."""
    found, directives, fence, held, first, language = [], {}, None, [], 0, ""
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"(\s*)```(\w*)\s*$", line)
        if fence is None and mark:
            fence, language, first, held = mark.group(1), mark.group(2), number, []
        elif fence is not None and line.strip() == "```":
            found.append((first, language, directives, held))
            fence, directives = None, {}
        elif fence is not None:
            held.append(line.removeprefix(fence))
        else:
            comment = re.match(r"<!--\s*([\w ]+?):\s*(.*?)\s*-->", line)
            if comment:
                directives[comment.group(1)] = comment.group(2)
            elif line.strip():
                directives = {}
    return found


def shape(line):
    """A line without its numbers and its units of time."""
    line = re.sub(r"[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?", "#", line.rstrip())
    return re.sub(r"# (?:ms|s|min|h)\b", "# s", line)


def same_answer(want, printed):
    """Whether the numbers of an answer are the same, to 3 % or one of the last digit."""
    if not (want.startswith("fit") and "T/(m g)" in want):
        return True
    number = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
    for one, other in zip(re.findall(number, want), re.findall(number, printed)):
        last = 10.0 ** -len(one.partition("e")[0].partition(".")[2])
        if abs(float(one) - float(other)) > max(0.03 * abs(float(other)), 1.01 * last):
            return False
    return True


def is_progress(line):
    return re.match(r"\s+[\w-]+: +#? ?\d* *%", line) or re.match(r"\s+[\w-]+: +\d+ %", line)


def matches(expected, printed):
    """The first line of `expected` that is not there, or None."""
    printed = [line for line in printed if line.strip() and not is_progress(line)]
    expected = [line for line in expected if line.strip()]

    def fits(i, j):
        if i == len(expected):
            return j == len(printed)
        want = expected[i]
        if want.strip() == "...":
            return any(fits(i + 1, k) for k in range(j, len(printed) + 1))
        if j == len(printed):
            return False
        if want.endswith("..."):
            same = shape(printed[j]).startswith(shape(want[:-3]).rstrip())
        else:
            same = shape(want) == shape(printed[j])
        same = same and same_answer(want, printed[j])
        furthest[0] = max(furthest[0], i + same)
        return same and fits(i + 1, j + 1)

    furthest = [0]
    if fits(0, 0):
        return None
    return expected[furthest[0]] if furthest[0] < len(expected) else "(nothing more)"


@functools.cache
def python_with(modules):
    """The first Python that has the modules; a user's own may have none of Debian's."""
    for python in ("python3", "/usr/bin/python3"):
        if subprocess.run([python, "-c", f"import {modules}"], capture_output=True).returncode == 0:
            return shutil.which(python)
    return None


class Page:
    def __init__(self, name, text, program, root, folder):
        self.name, self.text, self.folder, self.root = name, text, folder, root
        self.faults, self.skipped, self.run_blocks = [], [], 0
        python = python_with("numpy, matplotlib") or sys.executable
        bin_folder = folder / ".bin"
        bin_folder.mkdir()
        (bin_folder / "shakebed").symlink_to(program)
        (bin_folder / "python3").symlink_to(python)
        module = pathlib.Path(program).parent.parent / "python"
        self.environment = dict(os.environ, PATH=f"{bin_folder}:{os.environ['PATH']}", MPLBACKEND="Agg", COLUMNS="200",
                                PYTHONPATH=f"{module}:{os.environ.get('PYTHONPATH', '')}", SHAKEBED_SOURCE=str(root),
                                GITHUB_STEP_SUMMARY=str(folder / "step-summary.md"))

    def shell(self, command):
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=900)
        return done.returncode, done.stdout

    def fault(self, line, text):
        self.faults.append(f"{self.name}:{line}: {text}")

    def console(self, line, lines, directives):
        command, expected = None, []
        steps = []
        for text in lines:
            if text.startswith("$ "):
                steps.append((text[2:], []))
            elif text.startswith("> ") and steps:
                steps[-1] = (steps[-1][0] + "\n" + text[2:], steps[-1][1])
            elif steps:
                steps[-1][1].append(text)
        if not steps:
            self.fault(line, "a console block without \"$ \"")
        for number, (command, expected) in enumerate(steps):
            code, printed = self.shell(command)
            wanted = int(directives.get("exit", 0)) if number == len(steps) - 1 else 0
            if code != wanted:
                self.fault(line, f"exit code {code} of: {command}\n{printed}")
                return
            missing = matches(expected, printed.splitlines())
            if missing is not None:
                self.fault(line, f"{command}\n  expected: {missing}\n  printed:\n    " + printed.replace("\n", "\n    "))

    def json_block(self, line, lines):
        try:
            value = json.loads("\n".join(lines))
        except json.JSONDecodeError as error:
            self.fault(line, f"no JSON by itself: {error}")
            return
        starter = self.folder / ".starter.json"
        if not starter.exists():
            self.shell("shakebed init .starter.json")
        recipe = json.loads(starter.read_text())
        if "stages" in value and "stage" not in value:  # a study has both
            recipe = value
        elif "stage" in value:
            kinds = [stage["stage"] for stage in recipe["stages"]]
            if value["stage"] in kinds:
                recipe["stages"][kinds.index(value["stage"])] = value
            else:
                recipe["stages"].append(value)
        else:
            recipe.update(value)
        (self.folder / ".block.json").write_text(json.dumps(recipe))
        code, printed = self.shell("shakebed validate .block.json")
        if code != 0:
            self.fault(line, f"not a valid recipe:\n{printed}")

    def yaml_block(self, line, lines):
        try:
            import yaml
        except ImportError:
            self.skipped.append(f"{self.name}:{line}: python3-yaml is not installed")
            return
        def commands(value, key=""):
            if isinstance(value, dict):
                for inner_key, inner in value.items():
                    yield from commands(inner, inner_key)
            elif isinstance(value, list):
                for inner in value:
                    yield from commands(inner, key)
            elif key in ("run", "script"):
                yield from str(value).splitlines()
        found = [c for c in commands(yaml.safe_load("\n".join(lines))) if c.startswith(("shakebed ", "cat results"))]
        if not found:
            self.fault(line, "calls nothing")
        for command in found:
            code, printed = self.shell(command)
            if code != 0:
                self.fault(line, f"exit code {code} of: {command}\n{printed}")
        for path in re.findall(r"results/bed/[\w./-]+\.(?:html|md|xml)", "\n".join(lines)):
            if not (self.folder / path).exists():
                self.fault(line, f"{path} was not written")

    def run(self):
        for line, language, directives, lines in blocks_of(self.text):
            if language not in CHECKED:
                continue
            if "not run" in directives:
                self.skipped.append(f"{self.name}:{line}: {directives['not run']}")
                continue
            missing = [m for m in directives.get("needs", "").split()
                       if self.shell(f"python3 -c 'import {m}'")[0] != 0]
            if missing:
                self.skipped.append(f"{self.name}:{line}: Python has no module {', '.join(missing)}")
                continue
            self.run_blocks += 1
            if "file" in directives:
                (self.folder / directives["file"]).write_text("\n".join(lines) + "\n")
            if language == "console":
                self.console(line, lines, directives)
            elif language == "json":
                self.json_block(line, lines)
            elif language == "yaml":
                self.yaml_block(line, lines)
            elif language == "python" and "file" not in directives:
                (self.folder / ".block.py").write_text("\n".join(lines) + "\n")
                code, printed = self.shell("python3 .block.py")
                if code != 0:
                    self.fault(line, printed)
            elif language == "sh" and "file" not in directives:
                code, printed = self.shell("set -e\n" + "\n".join(lines))
                if code != int(directives.get("exit", 0)):
                    self.fault(line, f"exit code {code}:\n{printed}")


def end_daemons(folder):
    """Ends what a page started in the background and left: the numbers in its files "pids"."""
    for file in folder.glob("*/pids"):
        for pid in file.read_text().split():
            try:
                if os.readlink(f"/proc/{pid}/cwd").startswith(str(folder)):
                    os.kill(int(pid), signal.SIGTERM)
            except OSError:
                pass


def notices_faults():
    assert matches(["a: done in 0.5 s"], ["  a:  31 % measuring, 4.5 s left", "a: done in 12 ms"]) is None
    assert matches(["a: done"], ["b: done"]) == "a: done"
    assert matches(["w: x ..."], ["w: x 5 y"]) is None and matches(["w: y ..."], ["w: x"]) is not None
    assert matches(["...", "end"], ["1", "2", "end"]) is None and matches(["..."], []) is None
    assert matches(["a"], ["a", "b"]) is not None
    found = blocks_of("<!-- file: a.json -->\n```json\n{}\n```\ntext\n\n```sh\nls\n```\n")
    assert [(b[1], b[2]) for b in found] == [("json", {"file": "a.json"}), ("sh", {})], found


def main():
    notices_faults()
    program, root, chosen = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]
    only = sys.argv[4:]
    files = [file for part in PARTS for file in sorted((root / part).glob("*.md"))] + [root / "README.md"]
    faults, skipped, total = [], [], 0
    for file in files:
        name, text = file.relative_to(root).as_posix(), file.read_text()
        if only and not any(part in name for part in only):
            continue
        if not only and ("<!-- page: long -->" in text) != (chosen == "long"):
            continue
        if not any(b[1] in CHECKED for b in blocks_of(text)):
            continue
        absent = [p for needed in re.findall(r"<!-- page needs: (.*?) -->", text) for p in needed.split()
                  if not shutil.which(p, path=os.environ["PATH"] + ":/usr/sbin:/sbin")]
        if absent:
            skipped.append(f"{name}: {', '.join(absent)} not installed")
            continue
        with tempfile.TemporaryDirectory(prefix="shakebed-docs.", ignore_cleanup_errors=True) as folder:
            page = Page(name, text, program, root, pathlib.Path(folder))
            begin = time.monotonic()
            try:
                page.run()
            finally:
                end_daemons(pathlib.Path(folder))
            print(f"{name}: {page.run_blocks} blocks, {time.monotonic() - begin:.0f} s", *page.faults, sep="\n", flush=True)
        faults += page.faults
        skipped += page.skipped
        total += page.run_blocks
    for line in skipped:
        print("SKIPPED:", line)
    print(f"{total} blocks run, {len(skipped)} skipped, {len(faults)} wrong")
    return 1 if faults or total == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
