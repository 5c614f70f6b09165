#!/bin/sh
# Draws the pictures of the manual with the program: the starter recipe, the recipe beside this script, the sweep of the
# tutorial and the reproduced figure. About a minute of processor time. Needs gnuplot, and python3-pil for the photograph.
# usage: docs/pictures/draw.sh PROGRAM FOLDER     (FOLDER keeps the runs; a second call draws again at once)
set -eu
shakebed=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$2" && cd "$2"

# A drawing of the program as PNG: its gnuplot script with another terminal.
as_png() { # SCRIPT TARGET
  ( cd "$(dirname "$1")"
    sed -e '/^set terminal pdfcairo/,$d' \
        -e "s/^set terminal svg.*/set terminal pngcairo size 860,528 enhanced font 'Helvetica,14' background '#ffffff' linewidth 1.4/" \
        -e "s|^set output .*|set output '$2'|" "$(basename "$1")" | gnuplot )
}

"$shakebed" init starter.json >/dev/null 2>&1 || true
"$shakebed" run starter.json --out starter --quiet
as_png starter/figure/profile.gp "$here/first-bed-profile.png"
cp starter/figure/windows.svg "$here/temperature-by-window.svg"
for python in python3 /usr/bin/python3; do
  "$python" - starter/extract/overlay_000000.png "$here/found-disks.png" 2>/dev/null <<'P' && break
import sys
from PIL import Image
picture = Image.open(sys.argv[1]).convert("RGB")
picture.crop((0, 130, picture.width, picture.height)).quantize(64).save(sys.argv[2], optimize=True)
P
done
"$shakebed" run "$here/pictures.json" --out pictures --quiet
for name in temperature-by-height temperature-by-phase contact-duration profiles-by-temperature; do
  cp "pictures/charts/$name.svg" "$here/$name.svg"
done
"$shakebed" reproduce --until figure --out reproduced --quiet
as_png reproduced/figure/profile.gp "$here/reproduced-figure.png"

# The pages of reports, where Chromium and node are installed; the photographs are rendered ones.
if command -v chromium >/dev/null && command -v node >/dev/null; then
  "$shakebed" fit-images starter/render/frames --diameter "3 mm" --out photographs --quiet
  "$shakebed" reproduce --out main --quiet
  "$shakebed" bench fit --quick --out bench --quiet >/dev/null
  node "$here/../../tests/pipelines/browser/screenshots.mjs" "$(command -v chromium)" "$here" 1300 \
    main=main/report.html photographs=photographs/report.html bench=bench/bench.html
fi
ls -l "$here"
