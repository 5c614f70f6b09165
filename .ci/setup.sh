# Sourced by ./reproduce, ./test and .ci/run: installs what is missing, configures and builds.
# Everything is done again only where something changed, so it may be run at once again.

step() { printf '\n== %s\n' "$*" >&2; }

# Installs the missing packages of packages.txt with apt when that is possible; otherwise says exactly which and stops.
install_missing_packages() {
  wanted=$(grep -vE '^[[:space:]]*(#|$)' packages.txt)
  missing=
  if command -v dpkg-query >/dev/null 2>&1; then
    for package in $wanted; do
      dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing="$missing $package"
    done
    [ -z "$missing" ] && return 0
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
      step "installing$missing"
      export DEBIAN_FRONTEND=noninteractive
      # shellcheck disable=SC2086
      apt-get install -y --no-install-recommends $missing >&2 && return 0
      apt-get update >&2
      # shellcheck disable=SC2086
      apt-get install -y --no-install-recommends $missing >&2 && return 0
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

# Configures and builds a target ("all" by default) with the preset release.
build_release() {
  step "configuring"
  mkdir -p build
  cmake --preset release >build/configure.log 2>&1 || { cat build/configure.log >&2; return 1; }
  step "building (some minutes the first time)"
  cmake --build --preset release --target "${1:-all}" >&2
}
