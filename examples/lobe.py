#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Plots where a rough metal reflects light from one direction: the model's curve, and a histogram of samples, which must follow it.
Usage: lobe.py OUTPUT.png [unix:PATH|HOST:PORT]"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import facetwise

if len(sys.argv) < 2:
    sys.exit(__doc__)
engine = facetwise.connect(sys.argv[2]) if len(sys.argv) > 2 else facetwise.local()
THETA = np.radians(60)
incident = (np.sin(THETA), 0.0, np.cos(THETA))

figure, axes = plt.subplots(subplot_kw={"projection": "polar"}, figsize=(7, 4.5), layout="constrained")
for alpha, colour in ((0.15, "tab:blue"), (0.4, "tab:orange"), (0.8, "tab:green")):
    surface = dict(incident=incident, alpha_x=alpha, alpha_y=alpha)
    # The density of outgoing directions in the plane of incidence, a wedge of 2 degrees.
    drawn = engine.sample_reflection(**surface, lanes=16_000_000, seed=1)
    o = drawn.outgoing[drawn.status == 0]
    wedge = np.abs(o[:, 1]) < np.tan(np.radians(1)) * np.hypot(o[:, 0], o[:, 2])
    counts, edges = np.histogram(np.arctan2(o[wedge, 0], o[wedge, 2]), bins=90, range=(-np.pi / 2, np.pi / 2))
    density = counts / (len(drawn.status) * np.diff(edges) * 2 * np.sin(np.radians(1)))  # per steradian
    angle = (edges[1:] + edges[:-1]) / 2
    pdf = engine.evaluate_reflection(**surface, outgoing=(np.sin(angle), np.zeros_like(angle), np.cos(angle)), outputs=("pdf",)).pdf
    axes.plot(angle, pdf / pdf.max(), color=colour, label=f"alpha {alpha}: {pdf.max():.2f} / sr")
    axes.plot(angle, density / pdf.max(), ".", color=colour, markersize=4)
    print(f"alpha {alpha}: largest difference {np.max(np.abs(density - pdf)) / pdf.max():.1%} of the lobe's height")
axes.plot([-THETA] * 2, [0, 1], color="grey", linestyle="--", linewidth=1)
axes.set_rticks([])
axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90, title="GGX, light from 60 degrees: pdf (line) and samples (dots), each by its height")
axes.legend(loc="upper right")
figure.savefig(sys.argv[1], dpi=130)
