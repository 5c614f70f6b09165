#!/usr/bin/env python3
"""Writes the reference part of the manual from the program and the code: a page for each stage and each command, the
list of result files, and the messages with which a run can end.

usage: write_reference.py PROGRAM [FOLDER]      (FOLDER: docs/reference beside this script)
       write_reference.py PROGRAM --check       (exit 1 where a page is not what would be written)
"""
import json
import os
import pathlib
import re
import subprocess
import sys

DOCS = pathlib.Path(__file__).resolve().parent
ROOT = DOCS.parent
NOTE = "<!-- Written by docs/write_reference.py; changes here are lost. -->\n"
EXIT_CODES = {"UsageError": 2, "ConfigError": 3, "InputError": 4, "StageError": 5}
MEANING = {2: "wrong use of the command line", 3: "a mistake in the recipe", 4: "a missing or unreadable input; of pictures, none can be read",
           5: "a stage could not do its work"}


def said(program, *arguments):
    environment = dict(os.environ, COLUMNS="200")
    return subprocess.run([program, *arguments], capture_output=True, text=True, check=True, env=environment).stdout


def cell(text):
    return text.replace("|", "\\|").replace("<", "&lt;")


def help_sections(text):
    """Title → lines of a page of --help; what stands before the first title is under ""."""
    sections, title = {"": []}, ""
    for line in text.splitlines():
        if re.fullmatch(r"[A-Z]\w+:", line):
            title = line[:-1]
            sections[title] = []
        elif title and not line.startswith(" "):
            title = "after"  # what stands below the tables
            sections.setdefault(title, [])
        elif line.strip():
            sections[title].append(line)
    return sections


def entries(lines):
    """(name, text) of a table of --help: names begin in column 3, texts behind two spaces or on the next line."""
    found = []
    for line in lines:
        if re.match(r"  \S", line):
            name, _, text = line.strip().partition("  ")
            found.append([name, text.strip()])
        elif found:
            found[-1][1] = (found[-1][1] + " " + line.strip()).strip()
    return found


def commands(program):
    for name, text in entries(help_sections(said(program, "--help"))["Subcommands"]):
        yield name, text
        if name == "submit":
            for inner, inner_text in entries(help_sections(said(program, name, "--help"))["Subcommands"]):
                yield f"{name} {inner}", inner_text


ELSEWHERE = {"bench"}  # a program of its own, which need not be built
SHARED = {"-h,--help", "--out DIR", "--json", "-q,--quiet", "-v,--verbose"}


def command_page(program, name, text, stages):
    sections = help_sections(said(program, *name.split(), "--help"))
    usage = next((line for line in sections[""] if line.startswith("Usage:")), "")
    usage = "shakebed " + usage.partition(name)[0].split("/")[-1].replace("Usage:", "").replace("shakebed", "").strip() + name + usage.partition(name)[2]
    page = [NOTE, f"# shakebed {name}\n", f"{text[:1].upper()}{text[1:]}.\n", "## Syntax\n", "```text", re.sub(r"\s+", " ", usage), "```\n"]
    if "Examples" in sections:
        page += ["## Examples\n", "```text", *(line.strip() for line in sections["Examples"]), "```\n"]
    for title in ("Positionals", "Options", "Subcommands"):
        rows = [row for row in entries(sections.get(title, [])) if row[0] not in SHARED]
        if rows:
            page += [f"## {title if title != 'Positionals' else 'Arguments'}\n", "| name | meaning |", "|---|---|"]
            page += [f"| `{cell(key)}` | {cell(value)} |" for key, value in rows] + [""]
    page += ["Options that all commands share: [commands](index.md#options-that-all-commands-share).\n"]
    return "\n".join(page)


def examples_of_stages():
    """Stage → (recipe, the stage as it stands there): the shortest in the shipped recipes."""
    found = {}
    for recipe in sorted((ROOT / "pipelines/recipes").rglob("*.json")):
        for stage in json.loads(recipe.read_text()).get("stages", []):
            text = json.dumps(without_comments(stage), indent=2, ensure_ascii=False)
            kind = stage["stage"]
            if kind not in found or len(text) < len(found[kind][1]):
                found[kind] = (recipe.relative_to(ROOT).as_posix(), text)
    return found


def without_comments(value):
    if isinstance(value, dict):
        return {key: without_comments(inner) for key, inner in value.items() if key != "$comment"}
    return [without_comments(inner) for inner in value] if isinstance(value, list) else value


def stage_page(program, name, example, names):
    text = said(program, "reference", name)
    head, _, rest = text.partition("\n## Options")
    title, _, description = head.partition("\n")
    page = [NOTE + "\n" + title, "", description.strip(), ""]
    if example:
        page += ["## Example", "", f"From `{example[0]}`:", "", "```json", example[1], "```", ""]
    page += ["## Options" + rest.rstrip(), ""]
    related = [other for other in names if other != name and re.search(rf"\b{other}\b", description)]
    if related:
        page += ["## Related", "", ", ".join(f"[{other}](stage-{other}.md)" for other in related), ""]
    return "\n".join(page).replace("<equation of state>", "&lt;equation of state&gt;")


def balanced(text, start):
    """What stands in the parentheses that open at `start`."""
    depth, position, quoted = 0, start, False
    while position < len(text):
        c = text[position]
        if quoted:
            position += c == "\\"
            quoted = c != '"'
        elif c == '"':
            quoted = True
        elif c == "(":
            depth += 1
        elif c == ")":
            depth -= 1
            if depth == 0:
                return text[start + 1:position]
        position += 1
    return ""


def message_of(source):
    literals = re.sub(r'"\s+"', "", source)  # as the compiler joins them
    parts = re.findall(r'"((?:[^"\\]|\\.)*)"', literals)
    text = " / ".join(part for part in parts if part.strip()).replace('\\"', '"').replace("\\n", " ")
    return re.sub(r"\s+", " ", re.sub(r"\{[^{}]*\}", "...", text)).strip(" :;,")


def messages():
    """(exit code or 0 of a warning, room, message) of every place of the code that ends a run or warns."""
    found = set()
    for room in ("pipelines",):
        for file in sorted((ROOT / room).rglob("*.cpp")):
            text = re.sub(r"^\s*//.*$", "", file.read_text(), flags=re.MULTILINE)
            place = "/".join(file.relative_to(ROOT).parts[:2])
            for hit in re.finditer(r"throw (UsageError|ConfigError|InputError|StageError)\(|(?:context|judgement)\.warning\(", text):
                message = message_of(balanced(text, hit.end() - 1))
                if len(message.split()) >= 4:
                    found.add((EXIT_CODES.get(hit.group(1), 0), place, message))
    return sorted(found)


def messages_page():
    page = [NOTE, "# Messages\n",
            "An error says what is wrong, where (file, line and pointer), why, and what to do. The program then ends with one of\n"
            "these exit codes. Three dots stand for names and numbers.\n",
            "| exit code | meaning |", "|---|---|", "| 0 | success |"]
    page += [f"| {code} | {meaning} |" for code, meaning in MEANING.items()]
    page += ["| 6 | a `check` stage found a number outside its expectation |", "| 130 | interrupted |", ""]
    page += ["Where a picture shows no beads, or not those described, the message goes on with changes of the options. Each of them was\n"
             "tried on the picture: `give --roi 10,20,300,200 (tried: 63 dark beads of 10.1 px radius)`. Where none leads to beads, it says\n"
             "what a photograph must be like.\n"]
    all_messages = messages()
    for code, title in [*((code, f"Exit code {code}: {meaning}") for code, meaning in MEANING.items()), (0, "Warnings")]:
        rows = [(place, message) for found, place, message in all_messages if found == code]
        if rows:
            page += [f"## {title}\n", "| part of the program | message |", "|---|---|"]
            page += [f"| `{place}` | {cell(message)} |" for place, message in rows] + [""]
    return "\n".join(page)


def pages(program):
    names = re.findall(r"^\| `(\w+)` \|", said(program, "reference"), re.MULTILINE)
    stage_text = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", said(program, "reference"), re.MULTILINE))
    command_text = list(commands(program))
    examples = examples_of_stages()
    result = {f"stage-{name}.md": stage_page(program, name, examples.get(name), names) for name in names}
    for name, text in command_text:
        if name in ELSEWHERE:
            continue
        result[f"command-{name.replace(' ', '-')}.md"] = command_page(program, name, text, names)
    recipe = said(program, "reference", "recipe")
    result["recipe.md"] = NOTE + "\n" + recipe.replace("\n", "\n\n", 1).replace("<", "&lt;")
    result["messages.md"] = messages_page()
    shared = [row for row in entries(help_sections(said(program, "run", "--help"))["Options"]) if row[0] in SHARED]
    index = [NOTE, "# Reference\n", "All pages here are written from the program itself.\n", "## Stages\n",
             "| stage | what it does |", "|---|---|"]
    index += [f"| [{name}](stage-{name}.md) | {cell(stage_text[name])} |" for name in names]
    index += ["", "Name, report, sweep and presets of a [recipe](recipe.md).\n", "Each page lists the options with type, range, default and example, then every number of the result file with its unit,\n"
              "then every column of every table.\n", "## Commands\n", "| command | what it does |", "|---|---|"]
    index += [f"| {name if name in ELSEWHERE else f'[{name}](command-' + name.replace(' ', '-') + '.md)'} | {cell(text)} |"
              for name, text in command_text]
    index += ["", "## Options that all commands share\n", "| option | meaning |", "|---|---|"]
    index += [f"| `{cell(name)}` | {cell(text)} |" for name, text in shared]
    index += ["", "## Messages\n", "Errors, exit codes and warnings: [messages](messages.md).", ""]
    result["index.md"] = "\n".join(index)
    return result


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    check = "--check" in sys.argv
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 and not check else DOCS / "reference"
    written = pages(program)
    present = {file.name for file in folder.glob("*.md")} if folder.exists() else set()
    if check:
        stale = sorted(name for name, text in written.items() if name not in present or (folder / name).read_text() != text)
        stale += sorted(present - set(written))
        if stale:
            print("not what the program says:", ", ".join(stale))
            print("write them again: docs/write_reference.py build/release/pipelines/shakebed")
        else:
            print(f"{len(written)} pages are what the program says")
        return 1 if stale else 0
    folder.mkdir(parents=True, exist_ok=True)
    for name in present - set(written):
        (folder / name).unlink()
    for name, text in written.items():
        (folder / name).write_text(text)
    print(f"{len(written)} pages in {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
