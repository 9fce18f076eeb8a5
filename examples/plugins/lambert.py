# SPDX-License-Identifier: Apache-2.0
"""A white diffuse surface, for `facetwise prove python:lambert.py`."""
import numpy as np


def sample(i, alpha, u):
    r, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    o = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[:, 0])], axis=1)
    above = i[:, 2] > 0
    return o, np.where(above, o[:, 2] / np.pi, 0), np.where(above, 1.0, 0)


def evaluate(i, alpha, o):
    cosine = np.where((i[:, 2] > 0) & (o[:, 2] > 0), o[:, 2], 0) / np.pi
    return cosine, cosine
