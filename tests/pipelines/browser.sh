#!/usr/bin/env bash
# A report in headless Chromium: no console message, no request to any host, no sideways scrolling at 375 and 1280 px,
# in light and dark.
# usage: browser.sh SHAKEBED   (exit 77: no Chromium here)
set -eu
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
[ -n "$browser" ] || { echo "no Chromium"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"$1" init bed.json >/dev/null
"$1" run bed.json --out o --quiet >/dev/null 2>&1
# The page measures itself inside a frame of the width wanted (a window cannot be that narrow) and tells the page around.
sed 's#</body>#<script>parent.postMessage(document.documentElement.scrollWidth, "*");</script></body>#' o/report.html > page.html
bad=0
for width in 375 1280; do
  for scheme in light dark; do
    cat > frame.html <<HTML
<!DOCTYPE html><html><head><link rel="icon" href="data:,"></head><body>
<script>addEventListener("message", event => { document.documentElement.dataset.wide = event.data; });</script>
<iframe src="page.html" style="width: ${width}px; height: 800px; border: 0"></iframe></body></html>
HTML
    flags=""
    [ "$scheme" = dark ] && flags="--force-dark-mode"
    # A host that cannot be resolved would log an error; the log also holds console messages.
    # shellcheck disable=SC2086
    timeout 60 "$browser" --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --user-data-dir="$folder/profile" \
      --no-first-run --disable-background-networking --host-resolver-rules='MAP * ~NOTFOUND' --enable-logging=stderr --v=0 \
      --window-size=1400,900 --virtual-time-budget=3000 $flags --dump-dom "file://$folder/frame.html" > dom.html 2> log.txt
    if grep -E 'CONSOLE|net::ERR' log.txt; then echo "console message or request at $width px, $scheme"; bad=1; fi
    wide=$(grep -o 'data-wide="[0-9]*"' dom.html | grep -o '[0-9]*')
    if [ -z "$wide" ] || [ "$wide" -gt "$width" ]; then echo "at $width px ($scheme) the page is '$wide' px wide"; bad=1; fi
  done
done
grep -q '<svg class="plot"' o/report.html || { echo "no figure in the report"; bad=1; }
if grep -nE '(src|href)=["'"'"'](https?:)?//' o/report.html; then echo "the report points outside"; bad=1; fi
[ "$bad" = 0 ] && echo "the report is whole, alone, and fits"
exit "$bad"
