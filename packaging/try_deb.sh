#!/bin/sh
# usage: try_deb.sh FOLDER MIRROR [DEB ...]
# Installs the packages into a bare Debian 12 below FOLDER, by apt alone, and runs the main recipe there. Needs root and
# debootstrap. Leaves the tree in FOLDER.
set -eu
root=$1 mirror=$2
shift 2
[ -d "$root/usr" ] || debootstrap --variant=minbase bookworm "$root" "$mirror"
mkdir -p "$root/packages"
cp "$@" "$root/packages"
inside() { chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root "$@"; }
begin=$(date +%s)
inside apt-get update -qq
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/*.deb' >/dev/null
echo "installed after $(($(date +%s) - begin)) s"
inside sh -c '! command -v c++ && ! command -v gcc' >/dev/null || { echo "a compiler was installed" >&2; exit 1; }
inside shakebed --version
inside sh -c 'cd /root && rm -rf r && shakebed reproduce --preset quick --out r --quiet; test -s r/report.html'
echo "first figure after $(($(date +%s) - begin)) s"
inside python3 -c 'import shakebed; print(shakebed.theory(initial_height=10.2)["critical_temperature"]); print(shakebed.load("/root/r"))'
inside sh -c 'MANPATH=/usr/share/man; test -s /usr/share/man/man1/shakebed-run.1 -o -s /usr/share/man/man1/shakebed-run.1.gz || echo "no manual page (minbase leaves them out)"'
