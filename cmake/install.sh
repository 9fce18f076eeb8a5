#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what cmake/packages.txt lists and this machine lacks. Usage: cmake/install.sh [run|test]
set -euo pipefail
cd "$(dirname "$0")"
what=${1:-run}

wanted=()
while read -r line; do
  case "$line" in
    '' | '#'*) ;;
    '[test]') [ "$what" = test ] || break ;;
    *) wanted+=("$line") ;;
  esac
done < packages.txt

# dpkg-query names a package of the machine's own architecture with or without the suffix.
missing=()
for package in "${wanted[@]}"; do
  state=$(dpkg-query -W -f '${db:Status-Abbrev}' "$package" 2>/dev/null || true)
  [ "${state:0:2}" = ii ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

echo "Installing ${#missing[@]} packages: ${missing[*]}"
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
export DEBIAN_FRONTEND=noninteractive
if printf '%s\n' "${missing[@]}" | grep -q ':arm64$' && ! dpkg --print-foreign-architectures | grep -qx arm64; then
  as_root dpkg --add-architecture arm64
fi
log=$(mktemp)
if ! { as_root apt-get update && as_root apt-get install -y --no-install-recommends "${missing[@]}"; } > "$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "Could not install the packages above (full log: $log). facetwise is built on Debian 12." >&2
  exit 1
fi
rm -f "$log"
