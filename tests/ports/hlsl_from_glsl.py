#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The shader in HLSL is the one in GLSL, said otherwise. hlsl_from_glsl.py GLSL HLSL: whether it is; with --write: makes it so."""
import re
import sys

HEAD_OF_GLSL = """// facetwise.glsl: GGX reflection sampling that wastes no sample, to paste into a shader. GLSL 3.30 and later, GLSL ES 3.00
// (WebGL2) with highp floats, GLSL for Vulkan. The same as facetwise.hpp beside it, which says more.
"""
HEAD_OF_HLSL = """// facetwise.hlsl: GGX reflection sampling that wastes no sample, to paste into a shader. Shader model 5.0 and later. The same
// as facetwise.hpp beside it, which says more. Made of facetwise.glsl by tests/ports/hlsl_from_glsl.py.
"""
MADE_IN_GLSL = "  FwSample r = FwSample(rho * m - i, 0.0, 0.0);\n"
MADE_IN_HLSL = "  FwSample r;\n  r.o = rho * m - i;\n  r.pdf = r.weight = 0.0;\n"

names = [name for name in sys.argv[1:] if name != "--write"]
with open(names[0], encoding="utf-8") as file:
    text = file.read()
for glsl, hlsl in ((HEAD_OF_GLSL, HEAD_OF_HLSL), (MADE_IN_GLSL, MADE_IN_HLSL), ("const float FW", "static const float FW")):
    assert glsl in text, glsl
    text = text.replace(glsl, hlsl)
text = re.sub(r"\bvec([23])\b", r"float\1", text)
if "--write" in sys.argv:
    with open(names[1], "w", encoding="utf-8") as file:
        file.write(text)
with open(names[1], encoding="utf-8") as file:
    sys.exit(0 if file.read() == text else f"{names[1]} is not what {names[0]} says: write it by this program, with --write")
