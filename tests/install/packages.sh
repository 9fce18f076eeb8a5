#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the .deb packages, installs them on a bare Debian 12 (debootstrap, as root), uses what they bring, and removes them.
# packages.sh BUILD SOURCE. Takes some minutes and needs dpkg-dev, file and debootstrap.
set -euo pipefail
build=$1 source=$2
root=$(mktemp -d)
cleanup() {
  umount -l "$root/proc" 2> /dev/null || true
  rm -rf --one-file-system "$root"
}
trap cleanup EXIT
(cd "$build" && cpack > packages.log)
debootstrap --variant=minbase bookworm "$root" > "$build/debootstrap.log"
cp /etc/resolv.conf "$root/etc/"
mount -t proc proc "$root/proc"
mkdir "$root/packages"
cp "$build"/packages/*.deb "$source"/consumer.cc "$source/../../examples/sample.c" "$source/../../examples/albedo.py" "$root/packages/"
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
inside apt-get update -q > "$build/apt.log"
before=$(inside sh -c 'find /usr /etc -xdev -name "*facetwise*"')
[ -z "$before" ] || { echo "facetwise is there already: $before" >&2; exit 1; }
inside sh -c 'apt-get install -y --no-install-recommends /packages/*.deb g++ pkg-config man-db' >> "$build/apt.log"

inside facetwise info
inside sh -c 'facetwise serve --config /etc/facetwise/serve.toml --listen unix:/tmp/s > /tmp/log 2>&1 & echo $! > /tmp/pid'
for _ in $(seq 50); do [ -S "$root/tmp/s" ] && break; sleep 0.1; done
inside sh -c 'printf "ix,iy,iz\n0.6,0,0.8\n0,0,1\n" > /tmp/i.csv
  facetwise sample --alpha 0.3 --seed 1 -i /tmp/i.csv -o /tmp/here.csv
  facetwise sample --alpha 0.3 --seed 1 -i /tmp/i.csv -o /tmp/there.csv --remote unix:/tmp/s
  cmp /tmp/here.csv /tmp/there.csv && cat /tmp/there.csv'
inside sh -c 'cc /packages/sample.c -o /tmp/sample $(pkg-config --cflags --libs facetwise) -lm && /tmp/sample unix:/tmp/s'
inside python3 /packages/albedo.py unix:/tmp/s | tail -1
kill "$(cat "$root/tmp/pid")"
inside sh -c 'grep -q Description /usr/lib/systemd/system/facetwise.service && test -s /usr/share/facetwise/grafana.json'
inside sh -c 'apt-get purge -y "*facetwise*"' >> "$build/apt.log"
after=$(inside sh -c 'find /usr /etc -xdev -name "*facetwise*"')
[ -z "$after" ] || { echo "left behind: $after" >&2; exit 1; }
echo "installed, used and removed"
