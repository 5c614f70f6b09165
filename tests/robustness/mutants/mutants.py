#!/usr/bin/env python3
"""Puts one fault at a time into a copy of the source and asks the tests whether they notice.

  mutants.py choose --seed 1 --count 60        random faults, spread over the rooms, into the table
  mutants.py named faults.txt                  faults written by hand, into the table
  mutants.py run [--jobs 2] [--hours 8]        judges what waits; can be stopped and started again
  mutants.py report                            counts by room and the faults that no test noticed

The table (--table, default mutants.csv in the work folder) holds one fault a line with its state: waiting, noticed, not at
first (the quickest tests of the room did not notice it), survived, noticed by a long test, survived the long tests, not
built, not in a program, misplaced. The work folder
(--work, default build/mutants) holds programs for each job, linked from a finished release build (--build). The standard
library of Python 3.9 is enough.
"""

import argparse
import csv
import functools
import json
import os
import random
import re
import resource
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

RESULTS = SOURCE / "tests/robustness/results/mutants.csv"  # of earlier runs

BUILD_TIMEOUT = 3600  # seconds, on a busy machine

# Not asked: it limits the memory of the program, to which the size of the shared libraries here adds.
NOT_ASKED = ("Faults.MemoryIsShort",)

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
    "test_robustness": "tests/robustness/test_robustness",
}
# Programs of long tests alone; asked with --part long, together with the long tests of the others.
LONG_PROGRAMS = {
    "test_reproduction": "tests/reproduction/test_reproduction",
    "followed_advice_test": "tests/pipelines/followed_advice_test",
}
# Programs with the tests of a room.
OWN = {
    "statistics": ("test_statistics",),
    "sim": ("test_sim",),
    "fit": ("test_fit",),
    "ingest": ("test_ingest", "extract_numbers_test"),
    "pipelines": ("test_numbers", "extract_numbers_test", "test_pipelines"),  # the first two start no program
}
# Programs that the recorded results are made with, beside the command line; and the groups of results for each room.
TOOLS = {
    "draw_pictures": "tests/recorded/draw_pictures",
    "say_mistakes": "tests/recorded/say_mistakes",
}
RECORDED = {
    "statistics": ("beds", "tables"),
    "sim": ("beds", "shipped"),
    "fit": ("tables", "commands", "pictures"),
    "ingest": ("pictures", "strangers"),
    "pipelines": ("commands", "beds", "pictures", "tables", "mistakes", "shipped"),
}
# Those of the long tests that are likely to show a fault of the room: asked before the others.
LONG_RECORDED = {
    "statistics": ("options_of_tables", "options_of_beds"),
    "sim": ("options_of_beds",),
    "fit": ("options_of_tables", "options_of_beds"),
    "ingest": ("options_of_pictures", "many_strangers"),
    "pipelines": ("options_of_tables", "options_of_pictures", "options_of_beds"),
}
# What is asked last of a fault that no other test has noticed: commands that end with 0, or with 77 where they are skipped.
LAST = {
    "pipelines": (("house.reference", ("python3", "SOURCE/docs/write_reference.py", "PROGRAM", "--check")),
                  ("docs.quick", ("python3", "SOURCE/tests/house/run_docs.py", "PROGRAM", "SOURCE", "quick"))),
}
# The tests of a room first, then those of the rooms above.
ORDER = {
    "statistics": ("test_statistics", "test_sim", "test_fit", "test_ingest", "test_numbers", "test_pipelines"),
    "sim": ("test_sim", "test_physics", "test_numbers", "test_pipelines", "test_robustness"),
    "fit": ("test_fit", "test_numbers", "test_pipelines"),
    "ingest": ("test_ingest", "extract_numbers_test", "pipelines_images_test"),
    "pipelines": ("test_numbers", "extract_numbers_test", "test_pipelines", "pipelines_images_test", "test_robustness"),
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
    chosen = []
    for number, room in enumerate(rooms):
        places = []
        for path in source_files(room):
            if not path.name.endswith(arguments.suffix or ""):
                continue
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
            chosen.append(dict(id="", room=room, file=name, offset=str(offset),
                               line=str(text.count("\n", 0, offset) + 1), kind=kind, before=before, after=after,
                               state="waiting", noticed_by="", seconds=""))
    generator.shuffle(chosen)  # the first of them are a sample, too
    for row in chosen:
        row["id"] = f"r{len(rows) + 1}"
        rows.append(row)
    write_table(arguments.table, rows)


def read_named(path):
    """Faults written by hand: 'name file', then lines of '- before' and '+ after', then an empty line. Each with the
    line where it begins."""
    faults, block = [], []
    for number, line in enumerate([*path.read_text().splitlines(), ""], 1):
        if line.strip():
            block += [] if line.startswith("#") else [(number, line)]
        elif block:
            name, file = block[0][1].split()
            before = "\n".join(text[2:] for _, text in block[1:] if text.startswith("- "))
            after = "\n".join(text[2:] for _, text in block[1:] if text.startswith("+ "))
            faults.append((name, file, before, after, block[0][0]))
            block = []
    return faults


def named(arguments):
    """Writes them into the table. Those whose text does not stand exactly once in its file are said, and the exit code
    is then 1."""
    rows = read_table(arguments.table)
    known = {row["id"]: row for row in rows}
    misplaced = 0
    for name, file, before, after, at in read_named(arguments.file):
        text = (SOURCE / file).read_text() if (SOURCE / file).exists() else ""
        placed = text.count(before) == 1
        offset = text.find(before)
        row = dict(id=name, room=file.split("/")[0], file=file, offset=str(offset),
                   line=str(text.count("\n", 0, max(0, offset)) + 1), kind="named", before=before, after=after,
                   state="waiting" if placed else "misplaced", noticed_by="", seconds="")
        if not placed:
            misplaced += 1
            print(f"{arguments.file}:{at}: {name} is misplaced: its text stands {text.count(before)} times in {file}, "
                  "not once", file=sys.stderr)
        if name not in known:
            rows.append(row)
        elif (not placed or known[name]["state"] in ("waiting", "misplaced")
              or arguments.again and known[name]["state"] != "noticed"
              or any(known[name][column] != row[column] for column in ("file", "before", "after"))):
            known[name].update(row)
    write_table(arguments.table, rows)
    sys.exit(1 if misplaced else 0)


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


def run_limited(command, seconds, cpu_seconds=None, **options):
    """The exit code, the output and the CPU seconds of a command and its children; None for the code where the time ran
    out. cpu_seconds: what each of its processes may use."""
    limit = (lambda: resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 5))) if cpu_seconds else None
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                               start_new_session=True, preexec_fn=limit, **options)
    try:
        output, _ = process.communicate(timeout=seconds)
        code = process.returncode
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        code, output = None, process.communicate()[0]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return code, output, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


class Bench:
    """The programs of a finished release build, linked once more against shared libraries, of which the first holds the
    objects of one fault. What the other libraries hold of the same functions is then not called."""

    def __init__(self, work, base, number):
        self.base = base
        self.home = Path(re.search(r"^CMAKE_HOME_DIRECTORY:INTERNAL=(.*)$", (base / "CMakeCache.txt").read_text(),
                                   re.MULTILINE).group(1))
        self.built = Path(re.search(r"^# For build in directory: (.*)$", (base / "CMakeCache.txt").read_text(),
                                    re.MULTILINE).group(1))  # another one, if the build was copied
        self.work = work / f"bench-{number}"
        self.overlay = self.work / "overlay"
        self.fault = self.work / "lib/libfault.so"
        self.cpu = 0.0
        self.fit, self.unfit = set(), set()  # tests that pass, and that fail, without a fault

    # --- linking -----------------------------------------------------------------------------------------------------
    def here(self, command):
        """A command of the build, for the place where the build is now and for this source."""
        command = command.replace(str(self.built), "@BUILT@").replace(f"{self.home}/", f"{SOURCE}/")
        command = re.sub(rf"{re.escape(str(self.home))}(?![\w/-])", str(SOURCE), command)
        return command.replace("@BUILT@", str(self.base))

    def run(self, command, seconds=BUILD_TIMEOUT):
        code, output, cpu = run_limited(command if isinstance(command, list) else ["sh", "-c", command], seconds,
                                        cwd=self.base)
        self.cpu += cpu
        return code, output

    def must(self, command):
        code, output = self.run(command)
        if code != 0:
            sys.exit(f"{command}\n{output[-3000:]}")

    def prepare(self, programs):
        log, first = self.base / ".ninja_log", self.work / "prepared"
        if log.exists() and (not first.exists() or first.stat().st_mtime < log.stat().st_mtime):
            shutil.rmtree(self.work, ignore_errors=True)  # linked from the objects of an earlier build, or in part
        for name in ("bin", "lib/shakebed", "objects"):
            (self.work / name).mkdir(parents=True, exist_ok=True)
        shutil.rmtree(self.overlay, ignore_errors=True)
        targets = [*programs.values(), "pipelines/shakebed", "shakebed_images"]
        self.read_links(targets)
        self.read_sources()
        self.shared = {}  # archive: the shared library that takes its place, and its objects
        for archive, objects in self.archives.items():
            if re.match(r"(statistics|sim|fit|ingest|pipelines)/", archive):
                self.shared[archive] = (Path(archive).stem, objects)
        objects_of = lambda output: [word for word in self.links[output].split() if word.endswith(".o")]
        self.groups = {"libimage_stages": objects_of("pipelines/libshakebed_images.so"),
                       "libprogram": objects_of("pipelines/shakebed")}
        if not first.exists():
            of_program = [self.compile_again(one, lambda text: text.replace("-fPIE", "-fPIC"))
                          for one in self.groups["libprogram"]]
            self.link_libraries([*self.shared.values(), ("libimage_stages", self.groups["libimage_stages"]),
                                 ("libprogram", of_program)])
        self.no_fault()
        for output in self.links:
            if output in targets or output.endswith("/libshakebed_images.so"):
                self.link(output)
        first.touch()

    def read_links(self, targets):
        """How the build makes archives and links programs."""
        lines = subprocess.run(["ninja", "-C", str(self.base), "-t", "commands", *targets], check=True,
                               capture_output=True, text=True).stdout.splitlines()
        self.archives, self.links = {}, {}  # archive: objects; program: command
        for line in lines:
            archive, program = re.search(r"/ar qc (\S+) +(.*?) && ", line), re.search(r" -o (\S+) ", line)
            if line.startswith(": &&") and archive:
                self.archives[archive.group(1)] = archive.group(2).split()
            elif line.startswith(": &&") and program:
                self.links[program.group(1)] = line[len(": && "):].rsplit(" && :", 1)[0]

    def in_source(self, path):
        """A path of the source the build is of, as the source has it; None for other paths and generated ones."""
        inside = path.startswith(f"{self.home}/") and not path.startswith(f"{self.built}/")
        return path[len(str(self.home)) + 1:] if inside else None

    def read_sources(self):
        """Which object a source belongs to, how that is compiled, and which objects include a header."""
        self.compiled, self.sources, self.depends = {}, {}, {}
        for entry in json.loads((self.base / "compile_commands.json").read_text()):
            output = re.search(r" -o (\S+)", entry["command"]).group(1)
            self.compiled[output] = entry["command"]
            unit = re.search(r" -c (\S+)$", entry["command"]).group(1)
            files = [unit]
            if "/Unity/" in unit:
                files = re.findall(r'#include "(.*?)"', Path(unit.replace(str(self.built), str(self.base))).read_text())
            for file in files:
                if self.in_source(file):
                    self.sources.setdefault(self.in_source(file), output)
        output = None
        for line in subprocess.run(["ninja", "-C", str(self.base), "-t", "deps"], check=True, capture_output=True,
                                   text=True).stdout.splitlines():
            if not line.startswith(" "):
                output = line.split(":")[0]
            elif self.in_source(line.strip()):
                self.depends.setdefault(self.in_source(line.strip()), []).append(output)

    def link_libraries(self, libraries):
        """Twice: each names those whose functions it calls, for a fault brings libraries into programs that have not
        all of these."""
        made = []
        for _ in range(2):
            for name, objects in libraries:
                self.must(["c++", "-shared", "-o", f"{self.work}/lib/{name}.new", f"-Wl,-soname,{name}.so", *objects,
                           "-Wl,--as-needed", *(one for one in made if not one.endswith(f"/{name}.so")),
                           *self.others(), f"-Wl,-rpath,{self.work}/lib"])
            for name, _ in libraries:
                os.replace(f"{self.work}/lib/{name}.new", f"{self.work}/lib/{name}.so")
            made = [f"{self.work}/lib/{name}.so" for name, _ in libraries]

    def others(self):
        """Libraries of others, as the programs name them."""
        return sorted({word for command in self.links.values() for word in command.split()
                       if re.search(r"^/usr/lib/.*\.so|^-l", word)})

    def compile_again(self, name, change):
        """An object of the build with other flags."""
        output = self.work / "objects" / name.replace("/", "+")
        if not output.exists():
            command = re.sub(r" -c \S+$", f" -c {self.unit(name)}", change(self.here(self.compiled[name])))
            self.must(re.sub(r" -o \S+", f" -o {output}", command))
        return str(output)

    def link_words(self, output):
        """The objects and libraries of a program, with shared libraries for static ones."""
        words = []
        for word in self.links[output].split()[1:]:
            if word in self.shared:
                words.append(f"lib/{self.shared[word][0]}.so")
            elif word.endswith("libshakebed_test_program.a"):
                words += [self.own_program(name) for name in self.archives[word]]
            elif output.endswith(".so") and word.endswith(".o"):
                words.append(word)  # the module; nothing names its entry, so it would not ask for a library
            elif word in self.groups["libimage_stages"] or word in self.groups["libprogram"]:
                group = "libimage_stages" if word in self.groups["libimage_stages"] else "libprogram"
                words.append(f"lib/{group}.so")
            elif word.endswith(".o") and "-DSHAKEBED_PROGRAM=" in self.compiled.get(word, ""):
                words.append(self.own_program(word))
            else:
                words.append(word)
        def place(word):  # objects, libraries of the tests, shared libraries, libraries of others
            if re.match(r"/usr/lib|-l", word):
                return 3
            return 2 if word.startswith("lib/") else 1 if word.endswith(".a") else 0

        return sorted(words, key=place)

    def own_program(self, name):
        mine = str(self.work / "bin/shakebed")
        return self.compile_again(name, lambda text: re.sub(r'(-DSHAKEBED_PROGRAM=\\")[^\\]*', rf"\g<1>{mine}", text))

    def link(self, output, replaced=()):
        """Links a program or the module, with the objects of `replaced` in place of its own."""
        target = self.work / ("lib/shakebed" if output.endswith(".so") else "bin") / Path(output).name
        if not replaced and target.exists():
            return
        words = [dict(replaced).get(word, word) for word in self.link_words(output)]
        place = words.index("-o")
        words[place + 1] = str(target)
        # All of ours, also those that the program itself does not call: libfault.so may.
        words = [f"-Wl,--no-as-needed {self.work / word} -Wl,--as-needed"
                 if word.startswith("lib/lib") and (self.work / word).exists() else word for word in words]
        words = [word for word in words if word != "-Wl,-z,defs"]
        words += [f"-Wl,-rpath,{self.work}/lib", f"-Wl,-rpath-link,{self.work}/lib", "-Wl,-z,lazy"]
        if not output.endswith(".so"):
            words.insert(0, f"-Wl,--no-as-needed {self.fault} -Wl,--as-needed")
            # Before the fault, which may hold the main() of the program.
            words[0:0] = [word for word in words if word.endswith("/libgtest_main.a")]
        self.must("c++ " + " ".join(words))

    def no_fault(self):
        if not (self.work / "objects/none.so").exists():
            (self.work / "objects/none.cpp").write_text("")
            self.must(["c++", "-shared", "-o", str(self.work / "objects/none.so"), "-Wl,-soname,libfault.so",
                       str(self.work / "objects/none.cpp")])
        shutil.copy(self.work / "objects/none.so", self.fault)

    # --- one fault ---------------------------------------------------------------------------------------------------
    def compile(self, name, source, output):
        """Compiles `source`, a part of the object `name` or all of it, so that files of the overlay come first."""
        command = self.here(self.compiled[name]).replace("-fPIE", "-fPIC") if name in self.groups["libprogram"] else \
            self.here(self.compiled[name])
        command = re.sub(r" -c \S+$", f" -c {source}", re.sub(r" -o \S+", f" -o {output}", command))
        command = command.replace(" -I", f" -I{self.overlay} -I", 1)
        if name.endswith("run_scene.cpp.o"):
            command = command.replace(" -O3 ", " -O1 ")  # half the time; the same results
        return self.run(("ccache " if shutil.which("ccache") else "") + command)

    def unit(self, name):
        """The source of an object, for this source tree."""
        unit = Path(re.search(r" -c (\S+)$", self.compiled[name]).group(1).replace(str(self.built), str(self.base)))
        if "/Unity/" not in str(unit):
            return self.here(str(unit))
        copy = self.work / "objects" / (name.replace("/", "+") + ".cxx")
        copy.write_text(self.here(unit.read_text()))
        return str(copy)

    def build(self, file):
        """Builds what a fault in `file`, which is in the overlay, changes: None or what the compiler says."""
        parts, programs = [], {}
        if file.endswith(".cpp"):
            if file not in self.sources:
                return "is in no program"
            name = self.sources[file]
            parts = [(name, str(self.overlay / file))]
        else:
            for name in self.depends.get(file, []):
                owner = [output for output, command in self.links.items() if f" {name} " in command
                         and output.startswith("tests/")]
                if owner and name not in self.groups["libimage_stages"]:
                    programs.setdefault(owner[0], []).append(name)
                elif any(name in objects for _, objects in self.shared.values()) or \
                        any(name in objects for objects in self.groups.values()):
                    parts.append((name, self.unit(name)))
        objects = []
        for number, (name, source) in enumerate(parts):
            output = str(self.work / f"objects/fault-{number}.o")
            code, text = self.compile(name, source, output)
            if code != 0:
                return text or "time"
            objects.append(output)
        # Of the images module the program knows no function until it loads it: the fault's own must find the others.
        own = {group for group, names in self.groups.items() if any(name in names for name, _ in parts)}
        libraries = {self.work / f"lib/{library}.so" for library in own | {one for one, _ in self.shared.values()}}
        self.must(["c++", "-shared", "-o", str(self.fault), "-Wl,-soname,libfault.so", "-Wl,--as-needed", *objects,
                   *map(str, libraries), *self.others(), f"-Wl,-rpath,{self.work}/lib"])
        for output, names in programs.items():
            replaced = {}
            for name in names:
                changed = str(self.work / "objects" / (name.replace("/", "+") + ".fault.o"))
                code, text = self.compile(name, self.unit(name), changed)
                if code != 0:
                    return text or "time"
                replaced[str(self.work / "objects" / name.replace("/", "+"))
                         if "-DSHAKEBED_PROGRAM=" in self.compiled[name] else name] = changed
            self.changed_programs.append(output)
            os.replace(self.program(output), self.sound(Path(output).name))
            self.link(output, tuple(replaced.items()))
        return None

    def program(self, output):
        return self.work / "bin" / Path(output).name

    def sound(self, name):
        """Where a program is kept meanwhile whose own objects hold the fault."""
        return self.work / "objects" / f"{name}.sound"

    def start(self, program, tests, usual, sound=False):
        """The CPU may be used for several times what is usual; the machine may be busy with other things."""
        path = self.sound(program) if sound and self.sound(program).exists() else self.work / "bin" / program
        return run_limited([str(path), "--gtest_fail_fast", "--gtest_brief=1",
                            "--gtest_filter=" + ":".join(tests)], 600 + 60 * usual, cpu_seconds=20 + int(4 * usual),
                           cwd=self.work / "bin")

    def without_fault(self, row, ask):
        """What `ask` says without the fault. A file that is compiled alone may round differently from one that is compiled
        with others: with `row` its file takes the place of the fault, as it is."""
        aside = self.fault.with_suffix(".aside")
        os.replace(self.fault, aside)
        self.no_fault()
        if row is not None and row["file"].endswith(".cpp"):
            shutil.copy(SOURCE / row["file"], self.overlay / row["file"])
            self.build(row["file"])
        said = ask()
        os.replace(aside, self.fault)
        return said

    def is_fit(self, program, test, usual):
        """Whether a test that failed passes without the fault. Asked once a test."""
        if test not in self.fit:
            code, _, cpu = self.without_fault(None, lambda: self.start(program, [test], usual, sound=True))
            self.cpu += cpu
            (self.fit if code == 0 else self.unfit).add(test)
        return test in self.fit

    def judge(self, row, times, part):
        """(state, test that noticed) of a fault. Part: see groups_of()."""
        text = (SOURCE / row["file"]).read_text()
        offset = int(row["offset"])
        if text[offset:offset + len(row["before"])] != row["before"]:
            return "misplaced", ""
        changed = self.overlay / row["file"]
        changed.parent.mkdir(parents=True, exist_ok=True)
        changed.write_text(text[:offset] + row["after"] + text[offset + len(row["before"]):])
        self.changed_programs = []
        try:
            said = self.build(row["file"])
            if said is not None:
                return ("not in a program" if said == "is in no program" else "not built"), ""
            return self.ask(row, times, part)
        finally:
            shutil.rmtree(self.overlay)
            self.no_fault()
            for output in self.changed_programs:
                os.replace(self.sound(Path(output).name), self.program(output))

    def ask_long(self, row):
        """The long tests of the programs of the room and of those above, and those that start the program: recorded
        results first, then the quickest. Of other tests (packages, browsers' libraries, fuzzing) none is asked."""
        before = self.cpu
        for name, command, usual in long_tests(self, row["room"]):
            if self.limit and self.cpu - before > self.limit:
                return "survived the long tests", f"{name} and what follows were not asked"
            if name in self.unfit:
                continue
            asked = functools.partial(self.passes, command, usual)
            if asked():
                continue
            if self.without_fault(row, asked):
                return "noticed by a long test", name
            print(f"{name} fails without the fault: not used", flush=True)
            if not self.without_fault(None, asked):
                self.unfit.add(name)
        return "survived the long tests", ""

    def passes(self, command, usual):
        """Whether it ends well, or is skipped. `usual`: the CPU seconds that it takes."""
        code, output, cpu = run_limited(command, 600 + 60 * usual, cwd=self.work / "bin")
        self.cpu += cpu
        if "symbol lookup error" in output:
            sys.exit(f"{command} is not loaded:\n{output[-3000:]}")
        return code in (0, 77)

    def ask(self, row, times, part):
        if part == "long":
            return self.ask_long(row)
        spent = 0
        for program, tests, usual in groups_of(row, times, part, remembered_tests(row, self.remembered)):
            if self.limit and spent > self.limit:
                return "survived", f"{program} and what follows were not asked"
            tests = [test for test in tests if test not in self.unfit]
            while tests:
                code, output, cpu = self.start(program, tests, usual)
                self.cpu += cpu
                spent += cpu
                if code == 0:
                    break
                failed = re.findall(r"^\[  FAILED  \] ([\w./]+)", output, re.MULTILINE)
                if code == 127:
                    sys.exit(f"{program} is not loaded:\n{output[-3000:]}")
                if code is None or code == -signal.SIGXCPU or not failed:
                    how = "did not end" if code in (None, -signal.SIGXCPU) else f"ended with {code}"
                    return "noticed", f"{program} ({how})"
                if self.is_fit(program, failed[0], usual):
                    return "noticed", failed[0]
                print(f"{failed[0]} fails without a fault: not used", flush=True)
                tests = [test for test in tests if test not in self.unfit]
        likely = RECORDED[row["room"]]
        others = [group for group in quick_records(self.base) if group not in likely]
        for groups in ([likely] if part in ("first", "all") else []) + ([others] if part in ("rest", "all") else []):
            changed = self.changed_record(row, groups)
            if changed:
                return "noticed", changed
        if part == "first":
            return "not at first", ""
        for name, command in LAST.get(row["room"], ()):
            code, output = self.run([word.replace("PROGRAM", str(self.work / "bin/shakebed"))
                                     .replace("SOURCE", str(SOURCE)) for word in command], 1200)
            if code not in (0, 77):
                return "noticed", name
        return "survived", ""


    def record_is_same(self, group):
        tools = self.work / "bin"
        return self.passes(["python3", str(SOURCE / "tests/recorded/recorded.py"), "--tools", str(tools),
                            str(tools / "shakebed"), group], 5)

    def changed_record(self, row, groups):
        """The first group of recorded results that a fault changes, and that is as recorded without it; "" for none."""
        for group in groups:
            if self.record_is_same(group):
                continue
            if self.without_fault(row, functools.partial(self.record_is_same, group)):
                return f"recorded.{group}"
            print(f"recorded.{group} differs without the fault: not used", flush=True)
        return ""


@functools.cache
def quick_records(base):
    """The groups of recorded results that are no long tests."""
    listed = subprocess.run(["ctest", "--test-dir", str(base), "-L", "recorded", "-LE", "long", "--show-only=json-v1"],
                            check=True, capture_output=True, text=True).stdout
    return [test["name"].removeprefix("recorded.") for test in json.loads(listed)["tests"]]


def quick_filter(base, program):
    """What the quick tests of a program are, as --gtest_filter has it."""
    folder, name = (base / program).parent, Path(program).name
    used = (folder / "CTestTestfile.cmake").read_text()  # files of earlier configurations may be left
    for path, pattern in ((folder / f"{name}[1]_include.cmake", r"TEST_FILTER \[==\[(.*?)\]==\]"),
                          (folder / f"{name}_quick_suites.cmake", r'set\(filter "(.*?)"\)')):
        if path.name in used:
            found = re.search(pattern, path.read_text())
            if found and found.group(1):
                return found.group(1)
    return "*"


def long_tests(bench, room):
    """(name, command, usual seconds) of the long tests that a fault of a room is put to: recorded results first, of them
    the likely ones, and then the quickest."""
    listed = json.loads(subprocess.run(["ctest", "--test-dir", str(bench.base), "-L", "long", "--show-only=json-v1"],
                                       check=True, capture_output=True, text=True).stdout)["tests"]
    costs = recorded_costs(bench)
    programs = {str(bench.base / place): bench.work / "bin" / name
                for name, place in {**PROGRAMS, **LONG_PROGRAMS}.items()
                if name in (*LONG_PROGRAMS, *OWN[room], *ORDER[room])}
    programs[str(bench.base / "pipelines/shakebed")] = bench.work / "bin/shakebed"
    found = []
    for test in listed:
        command = [str(programs.get(word, word)) for word in test["command"]]
        if command != test["command"]:
            found.append((test["name"], command, costs.get(test["name"], 60.0)))
    likely = [f"recorded.{group}" for group in LONG_RECORDED[room]]
    return sorted(found, key=lambda one: (not one[0].startswith("recorded."), one[0] not in likely, one[2]))


def recorded_costs(bench):
    """Seconds of every test without a fault, as ctest has written them down: of a suite, and of the tests that its last
    output names."""
    costs = {}
    log = bench.base / "Testing/Temporary/LastTest.log"
    if log.exists():
        for name, milliseconds in re.findall(r"\[ +OK \] ([\w./]+).* \((\d+) ms\)", log.read_text(errors="replace")):
            costs[name] = int(milliseconds) / 1000
    for name in ("Testing/Temporary/CTestCostData.txt", "CTestCostData.txt"):
        if (bench.base / name).exists():
            for line in (bench.base / name).read_text().splitlines():
                words = line.split()
                if len(words) == 3:
                    costs[words[0]] = float(words[2])
    return costs


def usual_times(bench):
    """Seconds of every quick test without a fault, as ctest has written them down: {program: {test: seconds}}."""
    costs = recorded_costs(bench)
    times = {}
    for program, place in PROGRAMS.items():
        listed = subprocess.run([str(bench.work / "bin" / program), "--gtest_list_tests",
                                 f"--gtest_filter={quick_filter(bench.base, place)}"], check=True, capture_output=True,
                                text=True).stdout
        suites, suite = {}, None
        for line in listed.splitlines():
            line = line.split("#")[0].rstrip()
            if line.endswith(".") and not line.startswith(" "):
                suite = suites.setdefault(line, [])
            elif line.startswith("  ") and suite is not None:
                suite.append(line.strip())
        times[program] = {}
        for suite, tests in suites.items():
            shared = costs.get(suite[:-1], 0.3 * len(tests)) / max(1, len(tests))
            for test in tests:
                if "DISABLED_" not in suite + test and suite + test not in NOT_ASKED:
                    times[program][suite + test] = costs.get(suite + test, shared)
    return times


def likely_suites(file):
    """Suites of the tests that include the header beside the file, or that bear its name."""
    stem = Path(file).with_suffix("")
    found = set()
    for path in (SOURCE / "tests").rglob("*.cpp"):
        text = path.read_text(errors="replace")
        if f'"{stem}.hpp"' in text or re.fullmatch(rf"(test_)?{stem.name}(_numbers|_number)?(_test)?", path.stem):
            found.update(re.findall(r"\b(?:TEST|TEST_F|TEST_P|TYPED_TEST)\((\w+),", text))
    return found


def remembered_tests(row, rows):
    """Tests that noticed this fault before, and those that noticed others in the same file."""
    noticed = [other for other in rows if other["state"] == "noticed" and other["file"] == row["file"]]
    same = {other["noticed_by"] for other in noticed if (other["before"], other["after"]) == (row["before"], row["after"])}
    return same, {other["noticed_by"] for other in noticed} - same


def groups_of(row, times, part, remembered=((), ())):
    """Lists of tests to be run one after the other, (program, tests, usual seconds). First those that noticed this fault
    or one of the same file before, the likely ones of the room that take up to two seconds, the others of up to 0.3 s;
    then, unless only this part is wanted, the others of the room, then those of the programs above, the quickest first."""
    likely = likely_suites(row["file"])
    own = OWN[row["room"]]
    ranked = {}
    for place, program in enumerate(dict.fromkeys(own + ORDER[row["room"]])):
        for test, seconds in times[program].items():
            suite = test.split(".")[0]
            likely_one = suite in likely or any(piece in likely for piece in suite.split("/"))
            band = next(number for number, limit in enumerate((0.3, 2, 8, 1e9)) if seconds <= limit)
            if program == "pipelines_images_test":
                band = 3  # its tests share one run
            known = next((place for place, tests in enumerate(remembered) if test in tests), None)
            first = program in own and band < (2 if likely_one else 1) or known is not None and band < 3
            if part in ("first", "all") and first or part in ("rest", "all") and not first:
                rank = (-1, known, 0) if known is not None else (0, not likely_one, band) if first else \
                    (1, program not in own, band)
                ranked.setdefault((rank, place, program), []).append((test, seconds))
    return [(program, [test for test, _ in tests], sum(seconds for _, seconds in tests))
            for (_, _, program), tests in sorted(ranked.items())]


def run(arguments):
    rows = read_table(arguments.table)
    states = {"first": ("waiting",), "rest": ("not at first",), "all": ("waiting", "not at first"),
              "long": ("survived",)}[arguments.part]
    waiting = [row for row in rows if row["state"] in states and arguments.room in (None, row["room"])
               and (arguments.suffix is None or row["file"].endswith(arguments.suffix))
               and (arguments.only is None or row["id"] in arguments.only)]
    ends = time.monotonic() + 3600 * arguments.hours
    lock = threading.Lock()
    benches = [Bench(arguments.work, arguments.build, number) for number in range(arguments.jobs)]
    for bench in benches:
        bench.limit = arguments.limit
        bench.remembered = read_table(RESULTS) + rows
        bench.prepare({**PROGRAMS, **TOOLS, **(LONG_PROGRAMS if arguments.part == "long" else {})})
    times = {} if arguments.part == "long" else usual_times(benches[0])

    def work(bench):
        while True:
            with lock:
                if not waiting or time.monotonic() > ends:
                    return
                row = waiting.pop(0)
            part = "rest" if row["state"] == "not at first" else arguments.part
            bench.cpu = 0.0
            state, noticed_by = bench.judge(row, times, part)
            spent = float(row["seconds"] or 0) + bench.cpu
            print(f"{row['id']} {row['file']}:{row['line']} {state} {noticed_by} {bench.cpu:.0f} s", flush=True)
            row.update(state=state, noticed_by=noticed_by)
            with lock:  # the table may have been changed meanwhile
                now = read_table(arguments.table)
                for other in now:
                    if other["id"] == row["id"]:
                        other.update(state=state, noticed_by=noticed_by, seconds=f"{spent:.0f}")
                write_table(arguments.table, now)

    threads = [threading.Thread(target=work, args=(bench,)) for bench in benches]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def report(arguments):
    rows = read_table(arguments.table)
    columns = ("noticed", "noticed by a long test", "not at first", "survived", "survived the long tests", "not built",
               "waiting")
    print(f"| room | {' | '.join(columns)} |\n|{'---|' * (len(columns) + 1)}")
    for room in ROOMS:
        states = [row["state"] for row in rows if row["room"] == room]
        counts = [states.count(state) for state in columns]
        print(f"| {room} | {' | '.join(map(str, counts))} |")
    for row in rows:
        if row["state"] in ("not at first", "survived", "survived the long tests"):
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
    chosen.add_argument("--suffix", help="only faults in files that end so, .cpp or .hpp")
    by_hand = commands.add_parser("named")
    by_hand.add_argument("file", type=Path)
    by_hand.add_argument("--again", action="store_true", help="judge those again that no test noticed")
    judged = commands.add_parser("run")
    judged.add_argument("--jobs", type=int, default=1)
    judged.add_argument("--hours", type=float, default=8)
    judged.add_argument("--build", type=Path, default=SOURCE / "build/release", help="a finished release build")
    judged.add_argument("--part", choices=("first", "rest", "all", "long"), default="all",
                        help="only the quickest tests of the fault's room; only the others; the long tests, of faults "
                             "that survived (wants the target by_hand built)")
    judged.add_argument("--limit", type=float, help="CPU seconds after which no further tests are asked of a fault")
    judged.add_argument("--suffix", help="only faults in files that end so, .cpp or .hpp")
    judged.add_argument("--only", nargs="+", help="only these faults")
    judged.add_argument("--room", choices=ROOMS)
    commands.add_parser("report")
    arguments = parser.parse_args()
    arguments.work = arguments.work.resolve()
    if getattr(arguments, "build", None):
        arguments.build = arguments.build.resolve()
    arguments.table = arguments.table or arguments.work / "mutants.csv"
    {"choose": choose, "named": named, "run": run, "report": report}[arguments.command](arguments)


if __name__ == "__main__":
    main()
