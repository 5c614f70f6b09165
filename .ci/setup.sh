# Sourced by ./reproduce, ./test and .ci/run: installs what is missing, configures and builds.
# Everything is done again only where something changed, so it may be run at once again.

step() { printf '\n== %s\n' "$*" >&2; }

# The packages of packages.txt: those to build and run, or ("tests") those that only tests need.
packages_for() {
  awk -v part="$1" '/^# Only for tests/ { tests = 1 } !/^[[:space:]]*(#|$)/ && (part == "tests") == tests' packages.txt
}

# Those of the packages given that are not installed.
missing_packages() {
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || printf ' %s' "$package"
  done
}

# Installs with apt, updating its lists first where that is needed.
apt_install() {
  export DEBIAN_FRONTEND=noninteractive
  apt-get install -y --no-install-recommends "$@" >&2 && return 0
  apt-get update >&2
  apt-get install -y --no-install-recommends "$@" >&2
}

# Installs what is missing to build and run, when that is possible; otherwise says exactly what and stops.
install_missing_packages() {
  wanted=$(packages_for build)
  missing=
  if command -v dpkg-query >/dev/null 2>&1; then
    # shellcheck disable=SC2086
    missing=$(missing_packages $wanted)
    [ -z "$missing" ] && return 0
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
      step "installing$missing"
      # shellcheck disable=SC2086
      apt_install $missing && return 0
      echo "apt could not install them; see above" >&2
      return 1
    fi
    echo "These Debian packages are missing:$missing" >&2
    echo "Install them as root, then run this again:" >&2
    echo "  apt-get install$missing" >&2
    return 1
  fi
  # Not Debian: go on if the tools are there under whatever name, else say what is needed.
  for tool in cmake ninja c++ pkg-config gnuplot; do
    command -v "$tool" >/dev/null 2>&1 || missing="$missing $tool"
  done
  [ -z "$missing" ] && return 0
  echo "This is not Debian, and these programs are missing:$missing" >&2
  echo "What is needed, by its Debian names:" >&2
  for package in $wanted; do echo "  $package" >&2; done
  return 1
}

# Installs what only tests need. Where it cannot be had, says so and goes on: those tests are skipped, and say it.
install_test_packages() {
  command -v dpkg-query >/dev/null 2>&1 || return 0
  # shellcheck disable=SC2046
  missing=$(missing_packages $(packages_for tests))
  [ -z "$missing" ] && return 0
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    step "installing for the tests:$missing"
    # shellcheck disable=SC2086
    apt_install $missing && return 0
  fi
  echo "Some tests will be skipped: these Debian packages are missing:$missing" >&2
}

# Configures and builds a target ("all" by default) with the preset release.
build_release() {
  step "configuring"
  mkdir -p build
  cmake --preset release >build/configure.log 2>&1 || { cat build/configure.log >&2; return 1; }
  step "building (some minutes the first time)"
  # As many jobs as there are processors: two more, as ninja would start, take a fifth more processor time.
  cmake --build --preset release --target "${1:-all}" --parallel "$(nproc)" >&2
}

# Tests make and remove thousands of small files. They go to memory where 4 GB are free there: a twentieth less time.
# Not before packages are installed: apt works as another user, who may not enter that folder.
keep_test_files_in_memory() {
  [ -z "${TMPDIR:-}" ] || return 0
  free=$(df -Pk /dev/shm 2>/dev/null | awk 'NR == 2 { print $4 }')
  [ "${free:-0}" -gt 4000000 ] || return 0
  TMPDIR=$(mktemp -d /dev/shm/shakebed-test-XXXXXX) || { unset TMPDIR; return 0; }
  # Some tests start programs that they have written.
  printf '#!/bin/sh\n' >"$TMPDIR/program" && chmod +x "$TMPDIR/program"
  if ! "$TMPDIR/program" 2>/dev/null; then
    rm -r "$TMPDIR"
    unset TMPDIR
    return 0
  fi
  rm "$TMPDIR/program"
  export TMPDIR
  trap 'rm -rf "$TMPDIR"' EXIT
  trap 'exit 130' INT TERM
}
