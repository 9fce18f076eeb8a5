#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Each source file says its licence, where machines look for it. licence.sh SOURCE
set -euo pipefail
cd "$1"
without=$(find app bench c cmake engine examples ports proto python service tests CMakeLists.txt run.sh test.sh -type f \
  \( -name '*.cc' -o -name '*.h' -o -name '*.hpp' -o -name '*.c' -o -name '*.py' -o -name '*.sh' -o -name '*.proto' \
  -o -name '*.glsl' -o -name '*.hlsl' -o -name '*.comp' -o -name '*.cmake' -o -name CMakeLists.txt \) -exec grep -L "SPDX-License-Identifier: Apache-2.0" {} +) || true
[ -z "$without" ] || { echo "without a licence line: $without" >&2; exit 1; }
