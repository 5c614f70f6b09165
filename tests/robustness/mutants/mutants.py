#!/usr/bin/env python3
"""Puts one fault at a time into a copy of the source and asks the tests whether they notice.

  mutants.py choose --seed 1 --count 60        random faults, spread over the rooms, into the table
  mutants.py named faults.txt                  faults written by hand, into the table
  mutants.py run [--jobs 2] [--hours 8]        judges what waits; can be stopped and started again
  mutants.py report                            counts by room and the faults that no test noticed

The table (--table, default mutants.csv in the work folder) holds one fault a line with its state: waiting, noticed,
survived, not built, misplaced. The work folder (--work, default build/mutants) holds one copy of the source and one build
for each job. The standard library of Python 3.9 is enough.
"""

import argparse
import csv
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[3]
ROOMS = ("statistics", "sim", "fit", "ingest", "pipelines")
COLUMNS = ("id", "room", "file", "offset", "line", "kind", "before", "after", "state", "noticed_by", "seconds")

# Seconds after which a test program is stopped and the fault counts as noticed: several times what the slowest takes on
# a busy machine, all tests of a program and its quick ones.
TEST_TIMEOUT, QUICK_TIMEOUT = 400, 90
BUILD_TIMEOUT = 900

# Test programs by name: their place in the build. Those in tests/robustness/fuzz and the long ones are not used.
PROGRAMS = {
    "test_statistics": "tests/statistics/test_statistics",
    "test_sim": "tests/sim/test_sim",
    "test_fit": "tests/fit/test_fit",
    "test_ingest": "tests/ingest/test_ingest",
    "test_numbers": "tests/pipelines/test_numbers",
    "extract_numbers_test": "tests/pipelines/extract_numbers_test",
    "test_pipelines": "tests/pipelines/test_pipelines",
    "pipelines_images_test": "tests/pipelines/pipelines_images_test",
    "test_physics": "tests/physics/test_physics",
    "digits_test": "tests/robustness/digits_test",
    "test_robustness": "tests/robustness/test_robustness",
}
# Tests that take more than a second (release build, 24 November 2026): they run when the quick ones have noticed nothing.
SLOW = {
    "test_sim": ("Engine.GoesOn*", "Tiles.*", "MovingFloor.IsMetWhere*", "Engine.Foresees*", "Engine.SaysWhere*",
                 "Disks/EventQueueOrder*", "Engine.ReturnsAfter*", "ShellGrid*", "NarrowCell*"),
    "test_fit": ("FitHardCases.AnyProfile*", "Coverage.*", "Answer.OfAny*", "SimulatedProfiles.Repeats*", "CrossCheck*",
                 "Frames.Windows*", "FitHardCases.AHundred*", "Bounce.Nearly*", "Bias*"),
    "test_ingest": ("Survey*", "FinderBenchmark*", "ShakingFrequency.Noise*", "Finder.APacked*", "Rim*", "RealFrames*",
                    "HardCases.Half*", "HardCases.BeadsLit*", "HardCases.Saturated*", "HardCases.AFrame*",
                    "HardCases.DisksOfThreeHundred*", "Finder.Steps*", "Finder.Rows*", "MeasureBed.TheShakers*",
                    "MeasureBed.WithASink*", "MeasureBed.ASecond*", "Lens/*"),
    "test_numbers": ("StatedErrors*", "StudyNumbers*", "Tampering*", "Replicas*", "InferNumbers*"),
}
# The tests of a room first, then those of the rooms above.
ORDER = {
    "statistics": ("test_statistics", "test_sim", "test_fit", "test_ingest", "test_numbers", "test_pipelines"),
    "sim": ("test_sim", "test_physics", "test_numbers", "test_pipelines", "digits_test", "test_robustness"),
    "fit": ("test_fit", "test_numbers", "test_pipelines", "digits_test"),
    "ingest": ("test_ingest", "extract_numbers_test", "pipelines_images_test"),
    "pipelines": ("extract_numbers_test", "test_numbers", "test_pipelines", "pipelines_images_test", "test_robustness"),
}


def code_mask(text):
    """1 for every character that is code: no comment, string, character, preprocessor line or template head."""
    mask = bytearray(b"\1" * len(text))
    skipped = (r'//[^\n]*|/\*.*?\*/|R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\''
               r'|^[ \t]*#(?:[^\n\\]|\\.|\\\n)*|\btemplate\s*<[^\n]*|\bassert\([^\n]*|\bstatic_assert\([^;]*')
    for match in re.finditer(skipped, text, re.DOTALL | re.MULTILINE):
        mask[match.start():match.end()] = bytes(match.end() - match.start())
    return mask


def matching_parenthesis(text, start):
    depth = 0
    for place in range(start, min(len(text), start + 2000)):
        depth += {"(": 1, ")": -1}.get(text[place], 0)
        if depth == 0:
            return place
    return None


SWAPS = (
    ("comparison", r" (<=|>=|<|>|==|!=) ", {"<=": "<", "<": "<=", ">=": ">", ">": ">=", "==": "!=", "!=": "=="}),
    ("operator", r" ([-+*/]|[-+*/]=) ", {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+=", "*=": "/=",
                                         "/=": "*="}),
    ("operator", r" (&&|\|\|) ", {"&&": "||", "||": "&&"}),
    ("component", r"\.(x|y|z)\b(?!\()", {"x": "z", "y": "x", "z": "x"}),
    ("call", r"\bstd::(min|max|sin|cos|floor|ceil|lower_bound|upper_bound)\(",
     {"min": "max", "max": "min", "sin": "cos", "cos": "sin", "floor": "ceil", "ceil": "floor",
      "lower_bound": "upper_bound", "upper_bound": "lower_bound"}),
    ("call", r"\.(front|back|begin|end)\(\)(?=[;.\])]| [-+*/])", {"front": "back", "back": "front", "begin": "end",
                                                                "end": "begin"}),
    ("constant", r"\b(true|false)\b", {"true": "false", "false": "true"}),
    ("jump", r"\b(continue|break);", {"continue": "break", "break": "continue"}),
)


def changed_constants(number):
    """What a literal may become: one more for an integer, a quarter more for a real; zero for one half and one."""
    if re.fullmatch(r"\d+", number):
        return [str(int(number) + 1)] + ([str(int(number) - 1)] if int(number) > 0 else [])
    changed = [repr(float(number) * 1.25)]
    return changed + (["0.0"] if float(number) in (0.5, 1.0) else [])


def faults_of(text):
    """All faults (offset, kind, before, after) that may be put into the text of a file."""
    mask = code_mask(text)
    found = []

    def add(start, end, kind, after):
        if all(mask[start:end]) and text[start:end] != after:
            found.append((start, kind, text[start:end], after))

    for kind, pattern, table in SWAPS:
        for match in re.finditer(pattern, text):
            add(match.start(1), match.end(1), kind, table[match.group(1)])
    for match in re.finditer(r"(?<![\w.])(\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+|\d+)(?![\w.'])", text):
        for after in changed_constants(match.group(1)):
            add(match.start(1), match.end(1), "constant", after)
    for match in re.finditer(r"\bif (\()", text):
        end = matching_parenthesis(text, match.start(1))
        condition = text[match.start(1):end + 1] if end else ""
        if condition and ";" not in condition:
            add(match.start(1), end + 1, "condition", f"(!{condition})")
    for match in re.finditer(r"\bstd::sqrt(\()", text):
        add(match.start(), match.start(1), "call", "")
    for match in re.finditer(r"\w\((\w[\w.]*), (\w[\w.]*)(?=[,)])", text):
        if not re.match(r"(const|int|double|bool|std|auto|char|float|unsigned)\b", match.group(1)):
            add(match.start(1), match.end(2), "argument", f"{match.group(2)}, {match.group(1)}")
    for match in re.finditer(r"\[(\w+)\](?! *[({])", text):
        if re.fullmatch(r"[a-z]\w*", match.group(1)):
            add(match.start(1), match.end(1), "index", f"{match.group(1)} > 0 ? {match.group(1)} - 1 : 0")
    for match in re.finditer(r"^ +([\w.\[\]>-]+(?: [-+*/]?= [^;{}\n]+|\([^;{}\n]*\)));$", text, re.MULTILINE):
        if not match.group(1).startswith(("return", "throw", "delete")):
            add(match.start(1), match.end(1), "statement", "")
    return found


def source_files(room):
    return sorted(path for path in (SOURCE / room).rglob("*.[ch]pp"))


def choose(arguments):
    """Random faults: every room gets the same number, a file as many as it has places for one."""
    generator = random.Random(arguments.seed)
    rooms = [arguments.room] if arguments.room else list(ROOMS)
    rows = read_table(arguments.table)
    known = {(row["file"], row["offset"], row["after"]) for row in rows}
    for number, room in enumerate(rooms):
        places = []
        for path in source_files(room):
            text = path.read_text()
            places += [(path, text, fault) for fault in faults_of(text)]
        generator.shuffle(places)
        wanted = arguments.count // len(rooms) + (number < arguments.count % len(rooms))
        for path, text, (offset, kind, before, after) in places:
            name = str(path.relative_to(SOURCE))
            if wanted == 0:
                break
            if (name, str(offset), after) in known:
                continue
            wanted -= 1
            rows.append(dict(id=f"r{len(rows) + 1}", room=room, file=name, offset=str(offset),
                             line=str(text.count("\n", 0, offset) + 1), kind=kind, before=before, after=after,
                             state="waiting", noticed_by="", seconds=""))
    write_table(arguments.table, rows)


def read_named(path):
    """Faults written by hand: 'name file', then lines of '- before' and '+ after', then an empty line."""
    faults = []
    for block in re.split(r"\n\s*\n", path.read_text()):
        lines = [line for line in block.splitlines() if line.strip() and not line.startswith("#")]
        if not lines:
            continue
        name, file = lines[0].split()
        before = "\n".join(line[2:] for line in lines[1:] if line.startswith("- "))
        after = "\n".join(line[2:] for line in lines[1:] if line.startswith("+ "))
        faults.append((name, file, before, after))
    return faults


def named(arguments):
    rows = read_table(arguments.table)
    known = {row["id"]: row for row in rows}
    for name, file, before, after in read_named(arguments.file):
        text = (SOURCE / file).read_text()
        placed = text.count(before) == 1
        offset = text.find(before)
        row = dict(id=name, room=file.split("/")[0], file=file, offset=str(offset),
                   line=str(text.count("\n", 0, max(0, offset)) + 1), kind="named", before=before, after=after,
                   state="waiting" if placed else "misplaced", noticed_by="", seconds="")
        if not placed:
            print(f"{name}: its text stands {text.count(before)} times in {file}", file=sys.stderr)
        if name not in known:
            rows.append(row)
        elif arguments.again and known[name]["state"] != "noticed" or known[name]["after"] != after:
            known[name].update(row)
    write_table(arguments.table, rows)


def read_table(path):
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write_table(path, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(f"{path}.new", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    os.replace(f"{path}.new", path)


def run_limited(command, seconds, **options):
    """The exit code and the output of a command and its children, None for the code where the time ran out."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                               start_new_session=True, **options)
    try:
        output, _ = process.communicate(timeout=seconds)
        return process.returncode, output
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return None, process.communicate()[0]


def steps_of(room):
    """Test programs in their order with the tests to run, the quick ones of a program before its slow ones."""
    steps = []
    for program in ORDER[room]:
        slow = ":".join(SLOW.get(program, ()))
        steps += [(program, f"-{slow}"), (program, slow)] if slow else [(program, "*")]
    return steps


class Bench:
    """One copy of the source with its build."""

    def __init__(self, work, number):
        self.tree = work / f"tree-{number}"
        self.build = self.tree / "build/release"  # as in the source: a compiler cache then knows the files

    def prepare(self, programs):
        names = subprocess.run(["git", "-C", str(SOURCE), "ls-files", "-z", "--cached", "--others",
                                "--exclude-standard"], check=True, capture_output=True, text=True).stdout
        wanted = {name for name in names.split("\0") if name and (SOURCE / name).is_file()}
        for name in wanted:
            self.copy(name)
        for path in self.tree.rglob("*"):
            name = str(path.relative_to(self.tree))
            if path.is_file() and name not in wanted and not name.startswith("build/"):
                path.unlink()
        if not (self.build / "build.ninja").exists():
            self.configure()
        for program in programs:
            code, output = self.make(program)
            if code != 0:
                sys.exit(f"{program} is not built without a fault:\n{output[-3000:]}")

    # The release build, for the tests take minutes where nothing is optimised; one file a unit in the rooms that are
    # otherwise compiled many files at once, so that a fault costs one file.
    def configure(self):
        own = self.tree / "build/one_file_a_unit.cmake"
        own.parent.mkdir(parents=True, exist_ok=True)
        own.write_text("cmake_language(DEFER CALL set_target_properties shakebed_statistics shakebed_fit"
                       " shakebed_formats shakebed_pipelines shakebed_images PROPERTIES UNITY_BUILD OFF)\n")
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        subprocess.run(["cmake", "-G", "Ninja", "-S", str(self.tree), "-B", str(self.build),
                        "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=8",
                        f"-DCMAKE_PROJECT_shakebed_INCLUDE={own}", "-DSHAKEBED_PYTHON=OFF", "-DSHAKEBED_INSTALL=OFF",
                        "-DSHAKEBED_BENCH=OFF", *launcher], check=True, stdout=subprocess.DEVNULL)

    def copy(self, name):
        source, target = SOURCE / name, self.tree / name
        if not target.exists() or target.read_bytes() != source.read_bytes():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
            os.utime(target)

    def make(self, program):
        return run_limited(["ninja", "-C", str(self.build), "-j1", program], BUILD_TIMEOUT)

    def judge(self, row, depth):
        path = self.tree / row["file"]
        text = path.read_text()
        offset = int(row["offset"])
        if text[offset:offset + len(row["before"])] != row["before"]:
            return "misplaced", ""
        path.write_text(text[:offset] + row["after"] + text[offset + len(row["before"]):])
        try:
            return self.judge_changed(row["room"], depth)
        finally:
            path.write_text(text)

    def judge_changed(self, room, depth):
        for program, tests in steps_of(room)[:depth]:
            code, _ = self.make(program)
            if code != 0:
                return "not built", ""
            code, output = run_limited([str(self.build / PROGRAMS[program]), "--gtest_fail_fast", "--gtest_brief=1",
                                        f"--gtest_filter={tests}"],
                                       QUICK_TIMEOUT if tests.startswith("-") else TEST_TIMEOUT, cwd=self.build)
            if code is None:
                return "noticed", f"{program} (did not end)"
            if code != 0:
                failed = re.findall(r"^\[  FAILED  \] ([\w.]+/?\w*)", output, re.MULTILINE)
                return "noticed", failed[0] if failed else f"{program} (ended with {code})"
        return "survived", ""


def run(arguments):
    rows = read_table(arguments.table)
    waiting = [row for row in rows if row["state"] == "waiting" and arguments.room in (None, row["room"])]
    ends = time.monotonic() + 3600 * arguments.hours
    lock = threading.Lock()

    def work(number):
        bench = Bench(arguments.work, number)
        bench.prepare(dict.fromkeys(name for row in waiting for name, _ in steps_of(row["room"])[:arguments.depth]))
        while True:
            with lock:
                if not waiting or time.monotonic() > ends:
                    return
                row = waiting.pop(0)
            begin = time.monotonic()
            row["state"], row["noticed_by"] = bench.judge(row, arguments.depth)
            row["seconds"] = f"{time.monotonic() - begin:.0f}"
            print(f"{row['id']} {row['file']}:{row['line']} {row['state']} {row['noticed_by']} {row['seconds']} s",
                  flush=True)
            with lock:
                write_table(arguments.table, rows)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(arguments.jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def report(arguments):
    rows = read_table(arguments.table)
    print("| room | judged | noticed | survived | not built |\n|---|---|---|---|---|")
    for room in ROOMS:
        states = [row["state"] for row in rows if row["room"] == room]
        judged = states.count("noticed") + states.count("survived")
        print(f"| {room} | {judged} | {states.count('noticed')} | {states.count('survived')} |"
              f" {states.count('not built')} |")
    for row in rows:
        if row["state"] == "survived":
            print(f"{row['id']} {row['file']}:{row['line']} {row['kind']}: {row['before']!r} -> {row['after']!r}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=SOURCE / "build/mutants")
    parser.add_argument("--table", type=Path)
    commands = parser.add_subparsers(dest="command", required=True)
    chosen = commands.add_parser("choose")
    chosen.add_argument("--seed", type=int, required=True)
    chosen.add_argument("--count", type=int, required=True)
    chosen.add_argument("--room", choices=ROOMS)
    by_hand = commands.add_parser("named")
    by_hand.add_argument("file", type=Path)
    by_hand.add_argument("--again", action="store_true", help="judge those again that no test noticed")
    judged = commands.add_parser("run")
    judged.add_argument("--jobs", type=int, default=1)
    judged.add_argument("--hours", type=float, default=8)
    judged.add_argument("--depth", type=int, help="only so many steps of a room's order")
    judged.add_argument("--room", choices=ROOMS)
    commands.add_parser("report")
    arguments = parser.parse_args()
    arguments.work = arguments.work.resolve()
    arguments.table = arguments.table or arguments.work / "mutants.csv"
    {"choose": choose, "named": named, "run": run, "report": report}[arguments.command](arguments)


if __name__ == "__main__":
    main()
