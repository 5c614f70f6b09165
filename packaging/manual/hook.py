"""What mkdocs does not do by itself: pages outside docs/ (glossary, architecture), links to other files of the tree, and a search
that works without a server."""
import json
import os
import pathlib
import re

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["GLOSSARY.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "tests/bench/README.md", "tests/bench/results/README.md"]
MEDIA = {".svg", ".png"}


def on_files(files, config):
    for name in PAGES:
        files.append(File(name, str(ROOT), config["site_dir"], config["use_directory_urls"]))
    for file in list(files):
        if re.search(r"^results/.*\.json$|^pictures/pictures|\.(py|sh)$", file.src_uri):
            files.remove(file)
    for name in pictures_outside():
        files.append(File(name, str(ROOT), config["site_dir"], config["use_directory_urls"]))
    (ROOT / "packaging/manual/manual.css").exists() and files.append(
        File("manual.css", str(ROOT / "packaging/manual"), config["site_dir"], config["use_directory_urls"]))
    return files


def pictures_outside():
    """Pictures of the tree that pages of docs/ show."""
    found = set()
    for page in (ROOT / "docs").rglob("*.md"):
        for target in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text()):
            path = (page.parent / target).resolve()
            if path.exists() and not path.is_relative_to(ROOT / "docs"):
                found.add(path.relative_to(ROOT).as_posix())
    return sorted(found)


def on_page_markdown(markdown, page, config, files):
    source = pathlib.Path(page.file.abs_src_path)
    uri = pathlib.PurePosixPath(page.file.src_uri)

    def aim(match):
        opening, text, target = match.group(1), match.group(2), match.group(3)
        if re.match(r"[a-z]+:|#", target):
            return match.group(0)
        path, hash_, anchor = target.partition("#")
        place = (source.parent / path).resolve()
        if not place.is_relative_to(ROOT):
            return match.group(0)
        name = place.relative_to(ROOT).as_posix()
        if name == "README.md":
            name = "index.md"
            hash_ = anchor = ""
        elif name.startswith("docs/"):
            name = name.removeprefix("docs/")
        if name in (file.src_uri for file in files):
            return f"{opening}[{text}]({os.path.relpath(name, uri.parent)}{hash_}{anchor})"
        return text if text.startswith("`") else f"{text} (`{place.relative_to(ROOT)}`)"  # a file of the source code

    parts = re.split(r"(^```.*?^```)", markdown, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if part.startswith("```") else re.sub(r"(!?)\[([^\]]*)\]\(<?([^)>\s]+)>?\)", aim, part) for part in parts)


SEARCH = """
var base_url = (typeof base_url === 'undefined') ? '.' : base_url;
var shakebed_words = lunr(function () {
  this.ref('location'); this.field('title', {boost: 10}); this.field('text'); this.metadataWhitelist = [];
  shakebed_index.docs.forEach(function (doc) { this.add(doc); }, this);
});
var shakebed_places = {};
shakebed_index.docs.forEach(function (doc) { shakebed_places[doc.location] = doc; });
function shakebed_search() {
  var query = document.getElementById('mkdocs-search-query'), list = document.getElementById('mkdocs-search-results');
  if (!query || !list) return;
  var said = /[?&]q=([^&]*)/.exec(window.location.search);
  if (said) query.value = decodeURIComponent(said[1].replace(/\\+/g, ' '));
  function show() {
    list.textContent = '';
    var words = query.value.toLowerCase().split(/[^\\w]+/).filter(Boolean);
    if (!words.length) return;
    var found = shakebed_words.query(function (q) {
      words.forEach(function (word) { q.term(lunr.tokenizer(word), {boost: 10}); q.term(word, {wildcard: lunr.Query.wildcard.TRAILING}); });
    });
    if (!found.length) { list.textContent = 'Nothing found.'; return; }
    found.slice(0, 40).forEach(function (hit) {
      var doc = shakebed_places[hit.ref], article = document.createElement('article'), head = document.createElement('h3');
      var link = document.createElement('a'), text = document.createElement('p');
      link.href = base_url + '/' + doc.location; link.textContent = doc.title; text.textContent = doc.text.slice(0, 200);
      head.appendChild(link); article.appendChild(head); article.appendChild(text); list.appendChild(article);
    });
  }
  query.addEventListener('keyup', show);
  show();
}
if (document.readyState === 'loading') document.addEventListener('DOMContentLoaded', shakebed_search); else shakebed_search();
"""


def on_post_build(config):
    """The search of mkdocs loads its index from a server; here index and search are one script."""
    folder = pathlib.Path(config["site_dir"]) / "search"
    index = json.loads((folder / "search_index.json").read_text())
    lunr = (folder / "lunr.js").read_text()
    (folder / "main.js").write_text(lunr + "\nvar shakebed_index = " + json.dumps({"docs": index["docs"]}) + ";\n" + SEARCH)
    # Debian's theme asks for these by names under which it does not ship them.
    scripts = pathlib.Path(config["site_dir"]) / "js"
    for wanted in set(re.findall(r'js/([\w.-]+\.js)"', (pathlib.Path(config["site_dir"]) / "index.html").read_text())):
        if not (scripts / wanted).exists():
            jquery = sorted(scripts.glob("jquery-*.js"))
            (scripts / wanted).write_text(jquery[0].read_text() if wanted.startswith("jquery") and jquery else "")
