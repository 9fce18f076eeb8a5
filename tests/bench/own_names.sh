#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# own_names.sh LIBRARY NAME...: the object NAME.cc.o of the library defines nothing that others could call but what has
# NAME in it.
library=$1
shift
for name in "$@"; do
  defined=$(nm -A --defined-only --extern-only -C "$library" 2>/dev/null | grep ":$name\.cc\.o:") ||
    { echo "$library: no $name.cc.o"; exit 1; }
  strangers=$(echo "$defined" | sed "s/^.*:$name\.cc\.o://" | grep -v "$name" | grep -v ' [Vv] ')
  [ -z "$strangers" ] || { echo "$name.cc.o defines"; echo "$strangers"; exit 1; }
done
