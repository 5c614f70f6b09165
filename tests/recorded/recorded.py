#!/usr/bin/env python3
"""Everything that small runs write, compared with what an earlier revision wrote.

usage: recorded.py [--write] [--tools FOLDER] SHAKEBED GROUP...
  compares, with exit code 1 if anything differs
  --write   writes the records anew: read the difference before it is committed
  --tools   the folder with draw_pictures and say_mistakes, which drawn pictures and mistakes need

GROUP is a folder of `runs`. Each file in it is a run:
  NAME.json       a recipe
  NAME.commands   commands, one a line
  NAME.shipped    the shipped recipe NAME, its preset `quick`, with times of beds multiplied by the factor in this file
  NAME.mistakes   a recipe, whose options take wrong values, one after the other
  NAME.options    names of recipes of other groups, whose options take other values, one after the other
  NAME.drawn      drawn pictures and the options of `fit-images` for them, one picture a line
The record of a run, `records/GROUP/NAME.txt`, has one line for the numbers of each object, for each column of its tables,
for each chart and page, and all that the program says. Options that take other values have two lines each. It does not
say that a number is right, as the other tests do. It says that it has changed.
"""
import argparse
import csv
import difflib
import hashlib
import itertools
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
RELATIVE = 1e-6  # differences of numbers between machines and compilers are smaller, and those of faults larger
OF_PIXELS = 1e-4  # the same of what is found in pictures: OpenCV's filters differ by rounding with the processor
PIXEL_GROUPS = {"pictures", "strangers", "many_strangers", "options_of_pictures"}
ABSOLUTE = 1e-9  # the same, of the largest of several means: a mean of nearly 0 is a difference of larger numbers
NUMBER = re.compile(r"(?<![\w#.])[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w.]*\w)", re.IGNORECASE)
SHOWN = 30  # differing lines
TIMES = {"settle", "measure", "ramp", "hold", "best_measure"}
REFUSED = 3  # exit code of a recipe that cannot be run
WRONG = ["-1", "1e12", "text"]  # values of options, each wrong for most of them

# Written by the clock, the machine, or the revision.
NOT_RECORDED = {"cost.json", ".record", "manifest.json", "ro-crate-metadata.json", "resolved.json", "summary.json"}
OF_PICTURES = {"extract.json", "disks.csv", "disk_details.csv", "profile.csv", "frames.csv"}  # the rest is as elsewhere
AS_TEXT = {"film.json"}  # very many numbers
TEXTS = {".md", ".html", ".svg", ".gp", ".dat", ".txt"}
VARYING = [
    (re.compile(r"<script.*?</script>", re.DOTALL), "SCRIPT"),
    (re.compile(r"data:[\w/+-]+;base64,[\w+/=]+"), "DATA"),
    (re.compile(r"\b\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d)?Z?)?"), "DATE"),
    (re.compile(r"(?<![.\w])[0-9a-f]{12,64}(-dirty)?(?![.\w])"), "FINGERPRINT"),
    (re.compile(r"(g\+\+|clang) [\d.]+"), "COMPILER"),
    (re.compile(r"<!-- times -->.*?<!-- /times -->"), "TIME"),
    (re.compile(r"^Time: .*$", re.MULTILINE), "TIME"),
    (re.compile(r"\d+ bytes +[\d.]+ (ms|s|min)$", re.MULTILINE), "BYTES TIME"),
    (re.compile(r"\bdone in [\d.]+ ?(ms|s|min)$", re.MULTILINE), "done in TIME"),
]


def digest(text):
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def shown(value):
    return "0" if value == 0 else f"{value:.9g}"


def summary(values):
    """Mean, mean size, and a mean whose weights differ from place to place, so that an exchange is seen."""
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return "none"
    weighted = sum(value * math.fmod((k + 1) * 0.6180339887498949, 1) for k, value in enumerate(values)
                   if math.isfinite(value))
    return f"{len(known)}: " + " ".join(shown(x / len(known)) for x in
                                        (math.fsum(known), math.fsum(map(abs, known)), weighted))


def of_text(text):
    text = without_varying(text)
    numbers = [float(number) for number in NUMBER.findall(text)]
    return f"words {digest(NUMBER.sub('#', text))}, numbers {summary(numbers)}"


def of_json(document):
    """One line for the numbers of an object, one for each list of numbers, and one for all words."""
    words = []

    def numbers_of(value, place):
        if isinstance(value, dict):
            own = [f"{key}={shown(value[key])}" for key in value if is_number(value[key])]
            if own:
                yield f"  {place} {' '.join(own)}"
            for key in value:
                if not is_number(value[key]):
                    yield from numbers_of(value[key], f"{place}/{key}")
        elif isinstance(value, list) and value and all(is_number(x) for x in value):
            yield f"  {place} {summary(value)}"
        elif isinstance(value, list):
            for k, element in enumerate(value):
                yield from numbers_of(element, f"{place}/{k}")
        else:
            words.append(f"{place} {value}")

    yield from numbers_of(document, "")
    yield f"  {of_text(chr(10).join(words))}"


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def of_table(lines):
    rows = list(csv.reader(lines))
    if not rows:
        return
    for k, name in enumerate(rows[0]):
        cells = [row[k] if k < len(row) else "" for row in rows[1:]]
        try:
            yield f"  {name} {summary([float(cell) if cell else math.nan for cell in cells])}"
        except ValueError:
            yield f"  {name} {of_text(' '.join(cells))}"


def of_disks(text):
    """Columns of an extended XYZ file: all frames one after the other."""
    rows = [line.split() for line in text.splitlines()]
    wide = max((len(row) for row in rows), default=0)
    for k in range(wide):
        values = []
        for row in rows:
            try:
                values.append(float(row[k]))
            except (ValueError, IndexError):
                pass
        if values:
            yield f"  column {k} {summary(values)}"


def is_recorded(path):
    return path.is_file() and path.name not in NOT_RECORDED and path.suffix in TEXTS | {".json", ".csv", ".extxyz"}


def of_file(path, name):
    if not is_recorded(path):
        return
    yield name
    if path.suffix == ".json" and path.name not in AS_TEXT and not path.name.endswith("-metadata.json"):
        yield from of_json(json.loads(path.read_text()))
    elif path.suffix == ".csv":
        with path.open(newline="") as lines:
            yield from of_table(lines)
    elif path.suffix == ".extxyz":
        yield from of_disks(path.read_text())
    else:
        yield f"  {of_text(path.read_text())}"


def of_folder(folder, wanted):
    links = {path for path in folder.rglob("*") if path.is_symlink()}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not links & {path, *path.parents} and (not wanted or path.name in wanted):
            yield from of_file(path, path.relative_to(folder).as_posix())


def without_varying(text):
    for pattern, word in VARYING:
        text = pattern.sub(word, text)
    return text


def said(done, folder):
    """Lines of both streams, without those that show the progress within a stage."""
    for stream in (done.stderr, done.stdout):
        for line in without_varying(stream.replace(f"{folder}/", "")).splitlines():
            if not re.match(r" *[\w-]+: +\d+ % ", line):
                yield f"> {line}"


def start(shakebed, words, folder):
    environment = dict(os.environ, LC_ALL="C.UTF-8", OMP_NUM_THREADS="1", COLUMNS="120")
    return subprocess.run([shakebed, *words], cwd=folder, capture_output=True, text=True, env=environment, timeout=300,
                          check=False)


def shortened(value, factor):
    """A recipe whose beds are simulated for shorter times, in all its presets."""
    if isinstance(value, list):
        return [shortened(element, factor) for element in value]
    if not isinstance(value, dict):
        return value
    return {key: times(element, factor) if re.split("/|~1", key)[-1] in TIMES else shortened(element, factor)
            for key, element in value.items()}


def times(duration, factor):
    number, _, unit = str(duration).partition(" ")
    return f"{float(number) * factor:g} {unit}" if unit else float(number) * factor


def parts_of(option):
    return [option, *option.get("anyOf", []), *option.get("oneOf", [])]


def options_of(schema, place=""):
    """Pointers to all options below a part of the schema, and what it says of them."""
    for name, option in schema.get("properties", {}).items():
        yield f"{place}/{name}", option
        for part in parts_of(option):
            yield from options_of(part, f"{place}/{name}")


def schema_of(schema, stage):
    """The part of the schema that describes a stage: units decide between two for most kinds."""
    for part in schema["properties"]["stages"]["items"]["allOf"]:
        conditions = json.dumps(part["if"])
        if part["then"]["properties"]["stage"]["const"] == stage["stage"] and \
                ('"not"' in conditions) == (stage.get("units") != "reduced"):
            return part["then"]
    sys.exit(f"the schema has no stage {stage['stage']}")


def mistakes(shakebed, say, source, folder):
    """What is said of wrong values, beside what is said of the recipe itself. Options of several stages are tried once."""
    schema = json.loads(start(shakebed, ["schema"], folder).stdout)
    (folder / "recipe.json").write_text(source.read_text())
    changes, tried = ["/name=options"], set()
    for stage in json.loads(source.read_text())["stages"]:
        options = [option for option, _ in options_of(schema_of(schema, stage)) if option not in tried]
        changes += [f"/stages/{stage.get('id', stage['stage'])}{option}={value}"
                    for option in dict.fromkeys(options) for value in WRONG]
        tried.update(options)
    done = subprocess.run([say, "recipe.json"], cwd=folder, input="\n".join(changes), capture_output=True, text=True,
                          check=True)
    lines = done.stdout.splitlines()
    of_recipe = set(lines[1:lines.index(f"# {changes[1]}")])
    yield from (line for k, line in enumerate(lines) if line not in of_recipe or k <= len(of_recipe))


def quantity(value):
    """Number and unit, or nothing."""
    found = re.fullmatch(r"([-+]?[\d.]+(?:e[-+]?\d+)?)(| \S+)", str(value))
    return found and (float(found[1]), found[2])


def other_values(option, value):
    """All words, both answers, the limits of a number, and two numbers around a known one."""
    parts = parts_of(option)
    words = [word for part in parts for word in part.get("enum", [])]
    kinds = {part.get("type") for part in parts}
    if words or "boolean" in kinds:
        return [word for word in words or ["true", "false"] if word != value]
    if not kinds & {"integer", "number"}:
        return []
    known = (quantity(x) for x in (value, option.get("default"), *option.get("examples", [])))
    number, unit = next(filter(None, known), (1, ""))
    around = [number * 0.8, number * 1.3] if number else [0.3, 2]
    if "number" not in kinds:
        around = [math.floor(around[0]), math.ceil(around[1])]
    limits = (part[limit] for part in parts for limit in ("minimum", "maximum") if limit in part)
    near = [limit for limit in limits if abs(limit) <= 10 * abs(around[1])]
    return [f"{x:g}{unit}" for x in dict.fromkeys([*around, *near])]


def value_at(stage, place):
    for name in place.split("/")[1:]:
        stage = stage.get(name) if isinstance(stage, dict) else None
    return stage


def other_options(shakebed, source, folder):
    """Of each value that is accepted all words and numbers that the stage writes; the exit code, and what is said."""
    schema = json.loads(start(shakebed, ["schema"], folder).stdout)
    tried = set()
    for name in source.read_text().split():
        recipe = folder / f"{pathlib.Path(name).name}.json"
        shutil.copy(HERE / "runs" / f"{name}.json", recipe)
        run = ["run", recipe.name, "--out", recipe.stem, "--jobs", "1", "--quiet"]
        start(shakebed, run, folder)
        for stage in json.loads(recipe.read_text())["stages"]:
            id_ = stage.get("id", stage["stage"])
            for change in changes_of(stage, schema_of(schema, stage), tried):
                done = start(shakebed, [*run, "--only", id_, "--set", f"/stages/{id_}{change}"], folder)
                if done.returncode == 0:
                    yield f"{id_}{change}: {of_texts(texts_of(folder / recipe.stem / id_))}"
                if done.returncode != REFUSED:
                    yield f"> {done.returncode} {of_texts(said(done, folder))}"


def changes_of(stage, schema, tried):
    """Options that the stage gives take other values, and those that no stage of its kind has tried before."""
    for place, option in options_of(schema):
        value = value_at(stage, place)
        if value is not None or (stage["stage"], place) not in tried:
            tried.add((stage["stage"], place))
            yield from (f"{place}={other}" for other in other_values(option, value))


def texts_of(folder):
    return (path.read_text() for path in sorted(folder.rglob("*")) if is_recorded(path))


def of_texts(texts):
    """All words, and means of the logarithms of numbers, in which none outweighs all others."""
    texts = [without_varying(text) for text in texts]
    numbers = [math.asinh(float(number) / 1e-6) for text in texts for number in NUMBER.findall(text)]
    return f"words {digest(' '.join(NUMBER.sub('#', text) for text in texts))}, numbers {summary(numbers)}"


def commands_of(tools, source, folder):
    if source.suffix == ".json":
        shutil.copy(source, folder)
        return [f"run {source.name} --out out --jobs 1"]
    if source.suffix == ".shipped":
        recipe = json.loads((HERE / "../../pipelines/recipes" / source.stem / "figure.json").read_text())
        (folder / "figure.json").write_text(json.dumps(shortened(recipe, float(source.read_text()))))
        return ["run figure.json --preset quick --out out --jobs 1"]
    if source.suffix == ".drawn":
        return drawn(tools / "draw_pictures", source, folder)
    return [line for line in source.read_text().splitlines() if line and not line.startswith("#")]


def drawn(draw, source, folder):
    """Commands for the pictures that a file names."""
    lines = [line.split() for line in source.read_text().splitlines()]
    subprocess.run([draw, folder, *dict.fromkeys(name for name, *_ in lines)], check=True)
    for k, (name, *options) in enumerate(lines):
        yield " ".join(["fit-images", f"{name}.png", "--diameter 3mm", *options, f"--quiet --jobs 1 --out out/{k}-{name}"])


def of_run(shakebed, tools, source, folder):
    for file in (HERE / "inputs").iterdir():
        shutil.copy(file, folder)
    if source.suffix == ".mistakes":
        yield from mistakes(shakebed, tools / "say_mistakes", source, folder)
        return
    if source.suffix == ".options":
        yield from other_options(shakebed, source, folder)
        return
    for command in commands_of(tools, source, folder):
        done = start(shakebed, command.split(), folder)
        yield f"$ shakebed {command}"
        yield f"exit code {done.returncode}"
        yield from said(done, folder)
    if (folder / "out").is_dir():
        yield from of_folder(folder / "out", OF_PICTURES if source.suffix == ".drawn" else None)


def same(old, new, relative):
    if old == new:
        return True
    if relative == OF_PIXELS and old.startswith("  correlation "):  # three digits of numbers that are nearly 0
        relative = 0.01
    if NUMBER.sub("#", old) != NUMBER.sub("#", new):
        return False
    pairs = [(float(a), float(b)) for a, b in zip(NUMBER.findall(old), NUMBER.findall(new))]
    largest = 0 if "=" in old else max(max(abs(a), abs(b)) for a, b in pairs)  # numbers with names are no means
    return all(abs(a - b) <= relative * max(abs(a), abs(b)) + ABSOLUTE * largest for a, b in pairs)


def changes(old, new, relative):
    """Pairs of lines that differ; None where a line is in one of the two alone."""
    if len(old) == len(new):
        yield from ((a, b) for a, b in zip(old, new) if not same(a, b, relative))
        return
    shapes = [[NUMBER.sub("#", line) for line in lines] for lines in (old, new)]
    for tag, i, i_end, j, j_end in difflib.SequenceMatcher(None, *shapes, autojunk=False).get_opcodes():
        pairs = itertools.zip_longest(old[i:i_end], new[j:j_end])
        yield from ((a, b) for a, b in pairs if tag != "equal" or not same(a, b, relative))


def compare(run, old, new):
    """Number of lines that differ."""
    relative = OF_PIXELS if run.parts[0] in PIXEL_GROUPS else RELATIVE
    differing = list(changes(old, new, relative))
    for a, b in differing[:SHOWN]:
        print(f"{run}:")
        print("".join(f"  {sign} {line}\n" for sign, line in (("-", a), ("+", b)) if line is not None), end="")
    return len(differing)


def main():
    parser = argparse.ArgumentParser(usage=__doc__, add_help=False)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--tools", type=pathlib.Path)
    parser.add_argument("shakebed")
    parser.add_argument("groups", nargs="+")
    asked = parser.parse_args()
    asked.tools = asked.tools and asked.tools.resolve()
    differing = 0
    for source in (path for group in asked.groups for path in sorted((HERE / "runs" / group).iterdir())):
        run = source.relative_to(HERE / "runs").with_suffix("")
        with tempfile.TemporaryDirectory(prefix="shakebed-recorded.") as folder:
            lines = list(of_run(pathlib.Path(asked.shakebed).resolve(), asked.tools, source, pathlib.Path(folder)))
        record = HERE / "records" / f"{run}.txt"
        if asked.write:
            record.parent.mkdir(parents=True, exist_ok=True)
            record.write_text("".join(line + "\n" for line in lines))
        else:
            differing += compare(run, record.read_text().splitlines(), lines)
    if differing:
        sys.exit(f"{differing} lines differ from the record. If they should, write it anew (tests/recorded/README.md).")


if __name__ == "__main__":
    main()
