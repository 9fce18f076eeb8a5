#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How much light a rough surface reflects, by angle: a million samples for each of ten angles, here or, with an address, on a
server. Usage: albedo.py [unix:PATH|HOST:PORT]"""
import sys

import numpy as np

import facetwise

engine = facetwise.connect(sys.argv[1]) if len(sys.argv) > 1 else facetwise.local()
print(f"facetwise {facetwise.version()}, GGX, alpha 0.5")
for theta in np.radians(np.linspace(0, 85, 10)):
    got = engine.sample_reflection(incident=(np.sin(theta), 0.0, np.cos(theta)), alpha_x=0.5, alpha_y=0.5, lanes=1_000_000,
                                   seed=1, outputs=("weight",))
    albedo = got.weight.mean(dtype=float)
    print(f"{np.degrees(theta):5.1f} degrees  {albedo:.4f}  " + "#" * round(60 * albedo))
