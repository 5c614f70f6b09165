#!/usr/bin/env python3
"""The words of the documents: no dialect, short sentences, symbols that GLOSSARY.md defines, links that lead somewhere,
correct spelling, README and tutorial easy to read, and messages quoted in how-to tables that the code still says.

usage: words.py REPOSITORY   (exit 1: something is wrong; what was skipped is printed)

The dialect is in dialect.txt (a regular expression and, behind a tab, what to write). Words that a spell checker does
not know are in known_words.txt. Both lists grow. README files of tests and data are read as well. So are strings and header
comments of the C++ code, and docstrings and messages of the Python module: dialect and long sentences are faults there.
"""
import ast
import collections
import functools
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

LONGEST_SENTENCE = 30  # words
LEAST_EASE = 50.0      # Flesch reading ease

HERE = pathlib.Path(__file__).resolve().parent
GENERATED = ("docs/reference/", "docs/results.md", "docs/results/")  # text of the code, which is read as code
CODE_ROOMS = ("statistics", "sim", "ingest", "fit", "pipelines", "python")
EASY = ("README.md", "docs/tutorial/")

GREEK = ("alpha beta gamma delta zeta eta theta lambda mu nu xi phi chi psi sigma tau omega Gamma Delta Lambda Sigma "
         "Phi Psi Omega").split()
SYMBOL = re.compile(r"(?<![\w/.-])(?:(?:%s|[A-Za-zα-ωΑ-Ω])_\w{1,3}|%s|[B-HJ-Zα-ορ-ωΑ-Ω]|chi2|a2)(?![\w+-]|\.\w|\. [A-Z]|\()"
                    % ("|".join(GREEK), "|".join(g for g in GREEK if g != "beta")))


def documents(root):
    names = ["README.md", "GLOSSARY.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md", "paper/paper.md"]
    files = [root / name for name in names if (root / name).exists()]
    files += sorted((root / "docs").rglob("*.md"))
    files += sorted(file for room in ("tests", "reference-data") for file in (root / room).rglob("README.md"))
    return [f for f in files if not f.relative_to(root).as_posix().startswith(GENERATED)]


class Prose:
    """A Markdown file without its code: paragraphs, list items and table cells, each with the line where it begins."""

    def __init__(self, text):
        self.blocks = []    # (line, kind, text); kind: text, heading or cell
        self.anchors = set()
        self.links = []     # (line, target)
        fence = front = False
        held, first = [], 0

        def flush():
            if held:
                self.blocks.append((first, "text", " ".join(held)))
                held.clear()

        for number, line in enumerate(text.splitlines(), 1):
            if number == 1 and line == "---":
                front = True
                continue
            if front:
                front = line != "---"
                continue
            if re.match(r"\s*(```|~~~)", line):
                flush()
                fence = not fence
                continue
            if fence:
                continue
            self.links += [(number, target) for target in re.findall(r"\]\(<?([^)\s>]+)>?\)", re.sub(r"`[^`]*`", "", line))]
            line = re.sub(r"<!--.*?-->", "", line)
            stripped = line.strip()
            if not stripped:
                flush()
            elif stripped.startswith("#"):
                flush()
                title = stripped.lstrip("#").strip()
                self.anchors.add(re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-"))
                self.blocks.append((number, "heading", title))
            elif stripped.startswith("|"):
                flush()
                for cell in re.split(r"(?<!\\)\|", stripped)[1:-1]:
                    if not re.fullmatch(r"\s*:?-+:?\s*", cell):
                        self.blocks.append((number, "cell", cell.strip()))
            else:
                item = re.match(r"\s*(?:[-*]|\d+\.)\s+(.*)", line)
                if item:
                    flush()
                    stripped = item.group(1)
                if not held:
                    first = number
                held.append(stripped)
        flush()


def plain(text):
    """Without Markdown: code becomes one word, links their text."""
    if not any(mark in text for mark in ("`", "[", "<", "*", "://")):
        return text
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"`[^`]*`", " CODE ", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"\[@?[A-Z]\w+\d{4}\w*\]", "", text)  # keys of the bibliography
    text = re.sub(r"https?://\S+|<[^>]+>", " ", text)
    return re.sub(r"[*]{1,2}", "", text)


def sentences(text):
    text = re.sub(r"\b(e\.g|i\.e|Fig|Figs|eq|eqs|Eq|No|vs|al|Ref|St|Lett|Rev|Phys)\.", r"\1", plain(text))
    return [s for s in re.split(r"(?<=[.!?])[)\"”]?\s+(?=[A-Z0-9\"“(`])", text) if s.strip()]


def words(sentence):
    return [w for w in re.split(r"[\s/]+", sentence) if re.search(r"\w", w)]


def too_long(sentence):
    at_most = len(sentence.split()) + sentence.count("/")  # most sentences are plainly shorter
    return at_most > LONGEST_SENTENCE and len(words(sentence)) > LONGEST_SENTENCE


def dialect(path=HERE / "dialect.txt"):
    rows = [line.split("\t") for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return [(re.compile(row[0], re.IGNORECASE), row[1]) for row in rows]


def syllables(word):
    word = re.sub(r"[^a-z]", "", word.lower())
    if len(word) <= 3:
        return 1
    word = re.sub(r"(?:[^laeiouy]es|[^aeiouydt]ed|[^laeiouy]e)$", "", word)
    return max(1, len(re.findall(r"[aeiouy]{1,2}", word)))


def reading_ease(prose):
    count = collections.Counter()
    for _, kind, text in prose.blocks:
        if kind != "text":
            continue
        for sentence in sentences(text):
            found = [w for w in words(sentence) if re.search(r"[a-zA-Z]", w) and w != "CODE"]
            if len(found) < 2:
                continue
            count["sentences"] += 1
            count["words"] += len(found)
            count["syllables"] += sum(syllables(w) for w in found)
    if not count["sentences"]:
        return 100.0
    return (206.835 - 1.015 * count["words"] / count["sentences"] - 84.6 * count["syllables"] / count["words"])


def glossary_symbols(text):
    """The symbols of the first column of the glossary's tables, each between backticks; several by commas."""
    symbols = set()
    for line in text.splitlines():
        if line.startswith("|"):
            for code in re.findall(r"`([^`]+)`", line.split("|")[1]):
                symbols.add(code)
    return symbols


def faults_of(name, prose, rows, symbols, length=True):
    for line, kind, text in prose.blocks:
        bare = plain(text)
        for pattern, instead in rows:
            for hit in pattern.finditer(bare):
                yield line, "dialect", f"\"{hit.group(0)}\": write {instead}"
        for tag in re.findall(r"<[^<>]{1,40}>", re.sub(r"`[^`]*`|\]\(<[^>]*>\)", "", text)):
            yield line, "html", f"{tag} is not shown: write ⟨ ⟩, or code"
        if length and kind == "text":
            for sentence in sentences(text):
                if too_long(sentence):
                    yield line, "long", f"{len(words(sentence))} words: {sentence.strip()[:90]}..."
        if name != "GLOSSARY.md" or kind == "text":
            for symbol in SYMBOL.findall(re.sub(r"\"[^\"]*\"|[²³]", "", bare)):
                if symbol not in symbols:
                    yield line, "symbol", f"\"{symbol}\" is not in GLOSSARY.md: {bare[:60]}"


def dead_links(root, file, prose, parsed):
    for line, target in prose.links:
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        aim = (file.parent / path).resolve() if path else file
        if not aim.exists():
            yield line, "link", f"{target}: there is no such file"
        elif anchor and aim.suffix == ".md":
            if aim not in parsed:
                parsed[aim] = Prose(aim.read_text())
            if anchor not in parsed[aim].anchors:
                yield line, "link", f"{target}: there is no such heading"


def misspelled(root, files, parsed):
    """Faults by codespell and aspell; what is not installed is said."""
    if shutil.which("codespell"):
        found = subprocess.run(["codespell", "-L", "nd,te,fo", *map(str, files)], capture_output=True, text=True)
        for line in found.stdout.splitlines():
            yield line.replace(str(root) + "/", "")
    else:
        print("SKIPPED: codespell is not installed (Debian: codespell): common misspellings are not looked for")
    if shutil.which("aspell"):
        known = {w.lower() for w in (HERE / "known_words.txt").read_text().split()}
        text = {}
        for file in files:
            name = file.relative_to(root)
            for line, _, block in parsed[file].blocks:
                block = re.sub(r"\S*[\d_/.=<>@]\S*[\w]", " ", plain(block).replace("CODE", " "))
                for word in re.findall(r"[A-Za-zÀ-ÿ]+(?:'[a-z]+)?", block):
                    text.setdefault(word.removesuffix("'s").removesuffix("'"), (name, line))
        listed = subprocess.run(["aspell", "--lang=en", "--encoding=utf-8", "list"], input="\n".join(text),
                                capture_output=True, text=True, check=True)
        for word in listed.stdout.split():
            if word.lower() not in known and len(word) > 2:
                where = text.get(word, ("?", 0))
                yield f"{where[0]}:{where[1]}: \"{word}\": misspelled, or a word for tests/house/known_words.txt"
    else:
        print("SKIPPED: aspell is not installed (Debian: aspell, aspell-en): the spelling is not checked")


@functools.cache
def pieces(file):
    """(line, text) of what a file of code says."""
    return list(python_pieces(file) if file.suffix == ".py" else code_pieces(file))


def code_pieces(file):
    """(line, text) of what the code says: strings of a .cpp, comments of a .hpp by paragraphs, lists line by line."""
    text = file.read_text()
    if file.suffix == ".cpp":
        text = re.sub(r'R"\w*\(.*?\)\w*"', lambda raw: "\n" * raw.group(0).count("\n"), text, flags=re.DOTALL)
        text = re.sub(r'"(?:[^"\\\n]|\\.)*"|//.*|#include.*', lambda m: m.group(0) if m.group(0)[0] == '"' else "", text)
        for group in re.finditer(r'"(?:[^"\\\n]|\\.)*"(?:\s+"(?:[^"\\\n]|\\.)*")*', text):
            string = "".join(re.findall(r'"((?:[^"\\\n]|\\.)*)"', group.group(0))).replace('\\"', '"')
            for piece in string.split("\\n"):
                yield text.count("\n", 0, group.start()) + 1, piece
        return
    held, first, depth = [], 0, 0
    for number, line in enumerate([*text.splitlines(), ""], 1):
        comment = re.match(r"\s*//( *)(.*)", line)
        said = comment.group(2) if comment else ""
        indent = len(comment.group(1)) if comment else 0
        # A line of code, of a formula or of a list that stands alone.
        alone = indent > 2 and (indent <= depth or depth <= 2 or re.search(r"[;{},>]$", held[-1] if held else ";"))
        if held and (not said or alone or (indent <= 2 < depth)):
            yield first, " ".join(held)
            held = []
        if said:
            if not held:
                first, depth = number, indent
            held.append(said)


def python_pieces(file):
    """(line, text) of a .py: docstrings by paragraphs, other strings as they are."""
    tree = ast.parse(file.read_text())
    docs = {id(node.body[0].value) for node in ast.walk(tree)
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)) and ast.get_docstring(node)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
            continue
        if id(node) not in docs:
            yield node.lineno, node.value
            continue
        held, depth = [], 0
        for line in [*node.value.splitlines(), ""]:
            said, indent = line.strip(), len(line) - len(line.lstrip())
            # A heading's line, an example, or the next entry of a list of parameters stands alone.
            if held and (not said or said.startswith((">>>", "...")) or indent < depth or set(said) == {"-"}):
                yield node.lineno, " ".join(held)
                held = []
            if said and not said.startswith((">>>", "...")) and set(said) != {"-"}:
                if held and indent > depth:
                    yield node.lineno, " ".join(held)
                    held = []
                held.append(said)
                depth = indent


def code_faults(root, rows):
    """Faults of what the code says: (file, line, kind, what)."""
    for room in CODE_ROOMS:
        files = [*(root / room).rglob("*.[ch]pp"), *(() if room != "python" else (root / room / "shakebed").rglob("*.py"))]
        for file in sorted(files):
            name = file.relative_to(root).as_posix()
            # Nearly every pattern is nowhere in a file: one search tells so for all of its pieces.
            whole = "\n".join(piece for _, piece in pieces(file))
            there = [row for row in rows if row[0].search(whole)]
            for line, piece in pieces(file):
                for pattern, instead in there:
                    for hit in pattern.finditer(piece):
                        yield name, line, "dialect", f"\"{hit.group(0)}\": write {instead}"
                for sentence in sentences(piece):
                    if too_long(sentence):
                        yield name, line, "long", f"{len(words(sentence))} words: {sentence.strip()[:90]}..."


def quoted_messages(prose):
    """(line, phrase) of the messages that tables of a how-to page quote: "..." in a row's first cell."""
    for line, row in prose:
        if row.startswith("|"):
            for phrase in re.findall(r'"([^"`]+)"', re.sub(r"`[^`]*`", "", row.split("|")[1])):
                yield line, phrase


def unknown_messages(root):
    """Quoted messages that the code does not say: their words, in this order, with anything where ... stands."""
    said = " ".join(piece for room in CODE_ROOMS if (root / room).is_dir()
                    for file in sorted((root / room).rglob("*.cpp")) for _, piece in pieces(file))
    said = re.sub(r"%\.?\d*[a-z]+|\{[^}]*\}", "#", said).lower()
    for file in sorted((root / "docs/how-to").glob("*.md")):
        for line, phrase in quoted_messages(enumerate(file.read_text().splitlines(), 1)):
            parts = [re.escape(part.strip().lower()) for part in phrase.split("...")]
            if not re.search("[^.]{0,80}".join(parts), said):
                yield f"{file.relative_to(root).as_posix()}:{line}: message: no part of the code says \"{phrase}\""


def notices_faults(rows):
    """The rules themselves: each must find the fault that it is for."""
    bad = Prose("# A\n\nThe bed remembers. " + "word " * 31 + "end. The value of Q_x grows, <v>.\n\n[x](nowhere.md#b)\n\n```\nremembers\n```\n")
    kinds = {kind for _, kind, _ in faults_of("x.md", bad, rows, {"T"})}
    assert {"dialect", "long", "symbol", "html"} <= kinds, kinds
    assert [target for _, target in bad.links] == ["nowhere.md#b"]
    assert list(dead_links(HERE, HERE / "x.md", bad, {}))
    good = Prose("# A\n\nThe bed has T. It is 3 high, with `remembers` and eq. (5) as code.\n")
    assert not list(faults_of("x.md", good, rows, {"T"})), list(faults_of("x.md", good, rows, {"T"}))
    assert reading_ease(Prose("The cat sat on the mat. The dog ran to me.\n")) > 100
    with tempfile.TemporaryDirectory() as folder:
        code = pathlib.Path(folder) / "sim"
        code.mkdir()
        long = "word " * 31 + "end."
        (code / "a.cpp").write_text('// remembers\n#include "remembers"\nsay("The bed "\n    "remembers.");\n' + f'say("{long}");\n')
        (code / "a.hpp").write_text(f"// Steps:\n//   {'word ' * 20}\n//   {'word ' * 20}\n//\n// {long}\nint remembers;\n")
        found = list(code_faults(pathlib.Path(folder), rows))
    assert [fault[:3] for fault in found] == [("sim/a.cpp", 3, "dialect"), ("sim/a.cpp", 5, "long"), ("sim/a.hpp", 5, "long")], found
    with tempfile.TemporaryDirectory() as folder:
        code = pathlib.Path(folder) / "python" / "shakebed"
        code.mkdir(parents=True)
        half = "word " * 20
        (code / "a.py").write_text(f'def a():\n    """A.\n\n    x : int\n        {half}\n    y : int\n        {half}\n    """\n'
                                   f'    raise ValueError("It remembers.")\n\n\ndef b():\n    """{long}"""\n')
        found = list(code_faults(pathlib.Path(folder), rows))
    assert sorted(fault[1:3] for fault in found) == [(9, "dialect"), (13, "long")], found
    with tempfile.TemporaryDirectory() as folder:
        page, code = pathlib.Path(folder) / "docs" / "how-to", pathlib.Path(folder) / "sim"
        page.mkdir(parents=True)
        code.mkdir()
        (page / "a.md").write_text('| "disks ... were left out", or `"x"` | look |\n| "no beads there" | look |\n')
        (code / "a.cpp").write_text('say("%zu disks beside it were "\n    "left out");\n')
        found = list(unknown_messages(pathlib.Path(folder)))
    assert len(found) == 1 and "no beads there" in found[0], found
    assert reading_ease(Prose("Institutional considerations necessitate interdisciplinary communication.\n")) < 0


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    rows = dialect()
    notices_faults(rows)
    files = documents(root)
    parsed = {file: Prose(file.read_text()) for file in files}
    symbols = glossary_symbols((root / "GLOSSARY.md").read_text())
    faults = []
    for file in files:
        name = file.relative_to(root).as_posix()
        for line, kind, text in [*faults_of(name, parsed[file], rows, symbols), *dead_links(root, file, parsed[file], parsed)]:
            faults.append(f"{name}:{line}: {kind}: {text}")
    faults += misspelled(root, files, parsed)
    for file in files:
        name = file.relative_to(root).as_posix()
        if name.startswith(EASY):
            ease = reading_ease(parsed[file])
            print(f"Flesch reading ease of {name}: {ease:.0f}")
            if ease < LEAST_EASE:
                faults.append(f"{name}: reading ease {ease:.1f}, must be at least {LEAST_EASE}: shorter sentences and words")
    faults += [f"{name}:{line}: {kind}: {text}" for name, line, kind, text in code_faults(root, rows)]
    faults += unknown_messages(root)
    print("\n".join(faults))
    print(f"{len(files)} documents, {len(symbols)} symbols, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
