#!/bin/sh
# usage: try_deb.sh FOLDER MIRROR DEB ...
# Installs the packages into a bare Debian 12 below FOLDER, by apt alone, and runs the main recipe there. Needs root and
# debootstrap. Leaves the tree in FOLDER. Says the time since the start, and the processor time of each step, which does
# not depend on what else the machine does.
set -eu
root=$1 mirror=$2
shift 2
[ -d "$root/usr" ] || debootstrap --variant=minbase bookworm "$root" "$mirror"
rm -rf "$root/packages"
mkdir -p "$root/packages"
cp "$@" "$root/packages"
inside() { chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root "$@"; }
begin=$(date +%s)
# step NAME COMMAND ...
step() {
  name=$1
  shift
  TIMEFORMAT="%U + %S" bash -c 'time "$@"' sh chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root \
    "$@" 2>"$root/packages/errors" || { cat "$root/packages/errors" >&2; exit 1; }
  echo "$name: $(($(date +%s) - begin)) s after the start; processor time of this step $(tail -n 1 "$root/packages/errors") s"
}
program=$(cd "$root/packages" && ls shakebed_*.deb)
step "lists of packages read" apt-get update -qq
step "program downloaded" sh -c "apt-get install -y -qq --no-install-recommends --download-only /packages/$program >/dev/null"
step "program installed" sh -c "apt-get install -y -qq --no-install-recommends -o Dpkg::Use-Pty=0 /packages/$program >/dev/null"
inside shakebed --version && echo
step "first figure" sh -c 'cd /root && rm -rf r && shakebed reproduce --preset quick --out r --quiet >/dev/null && test -s r/report.html'
step "headers and Python installed" sh -c 'apt-get install -y -qq --no-install-recommends -o Dpkg::Use-Pty=0 /packages/*.deb >/dev/null'
inside sh -c '! command -v c++ && ! command -v gcc && ! command -v clang' >/dev/null || { echo "a compiler was installed" >&2; exit 1; }
inside python3 -c 'import shakebed; print(shakebed.theory(initial_height=10.2)["critical_temperature"]); print(shakebed.load("/root/r"))'
step "photographs measured from Python" python3 -c 'import shakebed; print(shakebed.measure_bed("/root/r/render/frames", "2.99 mm").brief())'
inside test -s /usr/share/man/man1/shakebed-run.1 || echo "the manual pages are left out by this Debian (minbase)"
