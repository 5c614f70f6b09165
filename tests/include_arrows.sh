#!/usr/bin/env bash
# The arrows of the house: pipelines -> {sim, ingest, fit} -> statistics; the three never include one another, nor
# pipelines.
# Third-party libraries stay in their rooms: OpenCV in ingest, GSL and Eigen in fit, nlohmann-json in pipelines.
# usage: include_arrows.sh SOURCE_DIR   (exit 1 and the offending lines when an arrow points the wrong way)
set -u
cd "$1" || exit 2
bad=0
forbid() {  # forbid ROOMS PATTERN WHY
  local rooms=$1 pattern=$2 why=$3 hits
  for room in $rooms; do
    hits=$(grep -rnE "^[[:space:]]*#[[:space:]]*include[[:space:]]*[<\"]$pattern" "$room" --include='*.hpp' --include='*.cpp')
    if [ -n "$hits" ]; then
      printf '%s may not include this (%s):\n%s\n' "$room" "$why" "$hits"
      bad=1
    fi
  done
}
forbid statistics '(sim|ingest|fit|pipelines|tests)/' 'statistics lies below all'
forbid sim '(ingest|fit|pipelines|tests)/' 'sim stands alone'
forbid ingest '(sim|fit|pipelines|tests)/' 'ingest stands alone'
forbid fit '(sim|ingest|pipelines|tests)/' 'fit stands alone'
forbid pipelines 'tests/' 'tests include the rooms, never the reverse'
forbid 'statistics sim fit pipelines' 'opencv' 'OpenCV belongs to ingest'
forbid 'statistics sim ingest pipelines' '(gsl|Eigen)/' 'GSL and Eigen belong to fit'
forbid 'statistics sim ingest fit' '(nlohmann|CLI|spdlog)/' 'JSON, the command line and logs belong to pipelines'
[ "$bad" = 0 ] && echo "all include arrows point the right way"
exit "$bad"
