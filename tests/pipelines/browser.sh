#!/usr/bin/env bash
# Reports in headless Chromium: of a pipeline and of a sweep, at 375 and 1280 px, light and dark. No console message, no
# request to any host, no sideways scrolling, text that stands out from its ground, a bed that moves, downloads that hold
# the files' bytes.
# usage: browser.sh SHAKEBED [PICTURES]   (exit 77: no Chromium here; PICTURES: a folder for screenshots)
set -eu
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
[ -n "$browser" ] || { echo "SKIPPED: Chromium is not installed (Debian: chromium)"; exit 77; }
shakebed=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
pictures=${2:-}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
[ -z "$pictures" ] || { mkdir -p "$pictures"; pictures=$(cd "$pictures" && pwd); }
cd "$folder"
"$shakebed" init bed.json >/dev/null
# Short runs: whether their numbers are good (exit code 6) is not the question here.
"$shakebed" run bed.json --preset quick --out o --quiet >/dev/null 2>&1 || [ $? = 6 ]
sed 's#"name": "my-bed",#&\n  "sweep": { "over": { "/stages/bed/floor/amplitude": ["2.5 mm", "2.8 mm"] } },#' bed.json >sweep.json
"$shakebed" run sweep.json --out s --quiet --set /stages/bed/measure="0.5 s" --set /stages/bed/settle="0.2 s" \
  --set /stages/bed/frames/count=16 >/dev/null 2>&1 || [ $? = 6 ]
bad=0
complain() { echo "$*"; bad=1; }

# The page examines itself inside a frame of the width wanted (a window cannot be that narrow) and tells the page around.
cat >probe.html <<'HTML'
<script>
addEventListener("load", () => setTimeout(() => {
  const rgb = text => (text.match(/[\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => { const f = v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; return 0.2126 * f(r) + 0.7152 * f(g) + 0.0722 * f(b); };
  const ground = element => { for (; element; element = element.parentElement) { const c = rgb(getComputedStyle(element).backgroundColor); if (c.length && c[3] !== 0) return c; } return [255, 255, 255]; };
  let worst = 21, where = "";
  for (const element of document.querySelectorAll("h1, h2, p, td, th, li, summary, figcaption, output, button, a, .banner")) {
    if (!element.textContent.trim() || !element.offsetParent) continue;
    const a = light(rgb(getComputedStyle(element).color)), b = light(ground(element));
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < worst) { worst = contrast; where = element.tagName + " " + element.textContent.trim().slice(0, 30); }
  }
  const figure = document.getElementById("bed-in-motion"), canvas = figure && figure.querySelector("canvas");
  if (figure) figure.scrollIntoView();  // what is out of sight does not play
  const before = canvas ? canvas.toDataURL() : "", drawn = figure ? Number(figure.dataset.drawn) : 0;
  let waits = 0;
  const tell = () => {
    const moves = canvas ? canvas.toDataURL() !== before && Number(figure.dataset.drawn) > drawn : null;
    if (moves === false && ++waits < 60) return setTimeout(tell, 100);
    parent.postMessage(JSON.stringify({
      wide: document.documentElement.scrollWidth, dark: matchMedia("(prefers-color-scheme: dark)").matches,
      contrast: worst, where, moves, downloads: document.querySelectorAll("a[download]").length,
    }), "*");
  };
  setTimeout(tell, 100);
}, 300));
</script></body>
HTML
examine() {  # REPORT-FOLDER WIDTH SCHEME
  sed -e '/<\/body>/{r probe.html' -e 'd}' "$1/report.html" >page.html
  cat >frame.html <<HTML
<!DOCTYPE html><html><head><link rel="icon" href="data:,"></head><body style="margin: 0">
<script>addEventListener("message", event => { document.documentElement.dataset.answer = event.data; });</script>
<iframe src="page.html" style="width: ${2}px; height: 1500px; border: 0"></iframe></body></html>
HTML
  local flags=() name="$1-$2-$3"
  [ "$3" = dark ] && flags+=(--blink-settings=preferredColorScheme=0)
  [ "$3" = light ] && flags+=(--blink-settings=preferredColorScheme=1)
  # No host can be resolved: a request would be an error in the log, which also holds console messages.
  local common=(--headless --no-sandbox --disable-gpu --disable-dev-shm-usage --user-data-dir="$folder/profile"
    --no-first-run --disable-background-networking --disable-component-update --host-resolver-rules='MAP * ~NOTFOUND'
    --enable-logging=stderr --v=0 --virtual-time-budget=8000 "${flags[@]}")
  timeout 90 "$browser" "${common[@]}" --window-size=1400,1500 --dump-dom "file://$folder/frame.html" >dom.html 2>log.txt ||
    complain "$name: Chromium failed: $(tail -3 log.txt)"
  if grep -E 'CONSOLE|net::ERR' log.txt; then complain "$name: a console message or a request"; fi
  local answer
  answer=$(grep -o 'data-answer="[^"]*"' dom.html | sed 's/&quot;/"/g; s/^data-answer="//; s/"$//')
  [ -n "$answer" ] || { complain "$name: the page said nothing"; return; }
  value() { printf '%s' "$answer" | grep -o "\"$1\":[^,}]*" | cut -d: -f2; }
  [ "$(value wide)" -le "$2" ] || complain "$name: the page is $(value wide) px wide"
  [ "$(value dark)" = "$([ "$3" = dark ] && echo true || echo false)" ] || complain "$name: the wrong scheme was tested"
  # 4.5 is what WCAG 2.1 asks of text.
  awk -v c="$(value contrast)" 'BEGIN { exit !(c >= 4.5) }' || complain "$name: contrast $(value contrast) at $(value where)"
  if [ "$1" = o ]; then
    [ "$(value moves)" = true ] || complain "$name: the bed does not move"
    [ "$(value downloads)" -ge 8 ] || complain "$name: $(value downloads) downloads"
  fi
  if [ -n "$pictures" ]; then
    timeout 90 "$browser" "${common[@]}" --hide-scrollbars --window-size="$([ "$2" = 375 ] && echo 500 || echo "$2"),6000" \
      --screenshot="$pictures/$name.png" "file://$folder/$([ "$2" = 375 ] && echo tall.html || echo page.html)" >/dev/null 2>&1 || true
  fi
}
# For pictures narrower than a window can be.
echo '<!DOCTYPE html><body style="margin: 0"><iframe src="page.html" style="width: 375px; height: 6000px; border: 0"></iframe>' >tall.html
# What a width shows does not depend on the colours: each report is seen in both widths and in both schemes, and in all
# four combinations where pictures are wanted.
views_of() {
  if [ -n "$pictures" ]; then echo "375:light 375:dark 1280:light 1280:dark"
  elif [ "$1" = o ]; then echo "375:light 1280:dark"
  else echo "375:dark 1280:light"; fi
}
for report in o s; do
  for view in $(views_of "$report"); do examine "$report" "${view%:*}" "${view#*:}"; done
done
grep -q '<svg class="plot"' o/report.html || complain "no figure in the report"
grep -q '<svg class="plot"' s/report.html || complain "no figure in the sweep's report"
if grep -nE '(src|href|url\()=?["'"'"']?(https?:)?//' o/report.html s/report.html; then complain "a report points outside"; fi
# What can be downloaded is what was written.
for file in extract/profile.csv fit/fit.json; do
  grep -o "download=\"${file/\//-}\" href=\"data:[^\"]*" o/report.html | sed 's/.*base64,//' | base64 -d | cmp - "o/$file" ||
    complain "$file: its download is not the file"
done
# As people use them: pointer, keyboard, print, without scripts.
node=$(command -v node || command -v nodejs || true)
if [ -z "$node" ]; then
  echo "SKIPPED in part: node is not installed (Debian: nodejs); nothing was clicked"
else
  axe=none
  if command -v npm >/dev/null && timeout 60 npm install --prefix "$folder/npm" --no-audit --no-fund --ignore-scripts \
      axe-core@4.10.2 ro-crate@3.7.2 >/dev/null 2>&1; then
    axe="$folder/npm/node_modules/axe-core/axe.min.js"
    "$node" "$here/browser/crate.cjs" "$folder/npm/node_modules" o s || complain "metadata that are no RO-Crate"
  else
    echo "SKIPPED in part: axe-core and ro-crate cannot be had from npm; contrast was looked at by this script alone"
  fi
  # Other pages: the published figure with its posterior, photographs (the frames of the bed above), a benchmark.
  "$shakebed" reproduce clement-rajchenbach --preset quick --out m --quiet --set /stages/posterior/best=0 \
    --set /stages/controls/replicas=1 >/dev/null 2>&1 || [ $? = 6 ]
  "$shakebed" fit-images o/render/frames --diameter "3 mm" --out f \
    --quiet >/dev/null 2>&1 || [ $? = 6 ] || complain "the frames are not measured"
  "$shakebed" bench map --quick --out b --quiet >/dev/null 2>&1 || complain "no bench"
  timeout 800 "$node" "$here/browser/report.mjs" "$browser" o s "$axe" m/report.html f/report.html b/bench.html || complain "the pages do not do what they should"
fi
[ "$bad" = 0 ] && echo "the pages are whole, alone, move, and fit"
exit "$bad"
