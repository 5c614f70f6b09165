#!/bin/sh
# Builds the manual and looks at it: no warning, nothing loaded from a network, every link within it leads to a page and a
# heading, and (where there is Chromium) the search finds something without a server.
# usage: check.sh REPOSITORY    (exit 77: mkdocs is not installed)
set -eu
cd "$1"
command -v mkdocs >/dev/null || { echo "SKIPPED: mkdocs is not installed (Debian: mkdocs)"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdocs build --quiet --strict --site-dir "$folder/manual"
python3 - "$folder/manual" <<'P'
import html.parser, pathlib, sys, urllib.parse

root = pathlib.Path(sys.argv[1])
class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.loads, self.links, self.ids = [], [], set()
        self.feed(text)
    def handle_starttag(self, tag, attributes):
        a = dict(attributes)
        if "id" in a:
            self.ids.add(a["id"])
        if tag in ("script", "img", "link", "iframe") and (a.get("src") or a.get("href")):
            self.loads.append(a.get("src") or a["href"])
        if tag == "a" and a.get("href"):
            self.links.append(a["href"])
pages = {f: Page(f.read_text()) for f in root.rglob("*.html") if f.name != "404.html"}
wrong = []
for file, page in pages.items():
    name = file.relative_to(root)
    for load in page.loads:
        if load.startswith(("http:", "https:", "//")):
            wrong.append(f"{name} loads {load}")
        elif not (file.parent / urllib.parse.unquote(load.split("?")[0])).exists():
            wrong.append(f"{name}: {load} is missing")
    for link in page.links:
        if ":" in link.split("/")[0]:
            continue
        path, _, anchor = urllib.parse.unquote(link).partition("#")
        aim = (file.parent / path).resolve() if path else file
        if not aim.exists():
            wrong.append(f"{name}: {link} leads nowhere")
        elif anchor and aim in pages and anchor not in pages[aim].ids:
            wrong.append(f"{name}: {link}: there is no such heading")
print("\n".join(wrong))
print(f"{len(pages)} pages, {sum(len(p.links) for p in pages.values())} links, {len(wrong)} wrong")
sys.exit(1 if wrong or len(pages) < 40 else 0)
P
if command -v chromium >/dev/null; then
  chromium --headless --no-sandbox --disable-gpu --user-data-dir="$folder/profile" --virtual-time-budget=5000 --dump-dom \
    "file://$folder/manual/search.html?q=plateau+density" >"$folder/found.html" 2>/dev/null
  number=$(grep -o '<article>' "$folder/found.html" | wc -l)
  echo "search for \"plateau density\": $number places"
  [ "$number" -ge 5 ] || { echo "FAILED: the search finds nothing"; exit 1; }
else
  echo "not tried: the search (Debian: chromium)"
fi
