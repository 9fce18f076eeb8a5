#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package: local and remote bits are equal, and those of the command; arrays are read and written where they lie;
errors name the field. Usage: python_test.py SERVER FACETWISE"""
import os
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import facetwise

SERVER, COMMAND = sys.argv[1:3]
COUNT = 20000


def directions(seed, lowest=-0.3):
    random = np.random.default_rng(seed)
    z = random.uniform(lowest, 1, COUNT)
    phi = random.uniform(0, 2 * np.pi, COUNT)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32)


def alphas(seed):
    return np.random.default_rng(seed).uniform(0.01, 1, COUNT).astype(np.float32)


def equal(a, b):
    return list(a.keys()) == list(b.keys()) and all(np.array_equal(a[k].view(np.uint8) if a[k].flags.c_contiguous else a[k],
                                                                   b[k].view(np.uint8) if b[k].flags.c_contiguous else b[k])
                                                    for k in a.keys()) and str(a.statistics) == str(b.statistics)


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        socket = os.path.join(cls.folder.name, "socket")
        cls.server = subprocess.Popen([SERVER, "--listen", "unix:" + socket], stdout=subprocess.PIPE, text=True)
        while "ready" not in cls.server.stdout.readline():
            assert cls.server.poll() is None
        cls.address = "unix:" + socket
        cls.local, cls.remote = facetwise.local(), facetwise.connect(cls.address)

    @classmethod
    def tearDownClass(cls):
        cls.server.terminate()
        cls.server.wait()
        cls.server.stdout.close()
        cls.folder.cleanup()

    def both(self, operation, **arguments):
        here, there = (getattr(engine, operation)(**arguments) for engine in (self.local, self.remote))
        self.assertTrue(equal(here, there), operation)
        self.assertEqual(here.statistics.accepted + here.statistics.occluded + here.statistics.smooth
                         + here.statistics.invalid, COUNT)
        return here

    def test_every_operation_here_and_there(self):
        i, o, alpha = directions(1), directions(2), alphas(3)
        glass = facetwise.Model(interface="dielectric", transport="importance")
        surface = dict(incident=i, alpha_x=alpha, alpha_y=0.25)
        drawn = self.both("sample_reflection", **surface, seed=4)
        self.assertGreater(drawn.statistics.accepted, COUNT // 2)
        self.assertEqual(drawn.outgoing.shape, (COUNT, 3))
        taken = drawn.status == 0
        np.testing.assert_allclose(np.linalg.norm(drawn.outgoing[taken], axis=1), 1, atol=1e-4)
        asked = self.both("evaluate_reflection", **surface, outgoing=drawn.outgoing, outputs=("value", "pdf"))
        # Next to the horizon rounding shows.
        sure = taken & (drawn.outgoing[:, 2] > 1e-3)
        np.testing.assert_allclose(asked.pdf[sure], drawn.pdf[sure], rtol=2e-2)
        np.testing.assert_allclose(asked.value[sure], (drawn.weight * drawn.pdf)[sure], rtol=2e-2)
        self.both("sample_normal", **surface, seed=5, sampler="visible")
        self.both("pdf_reflection", **surface, outgoing=o)
        self.both("masking", **surface, outputs=("masking", "share_unoccluded"))
        self.both("albedo", **surface)
        for operation in ("sample_transmission", "sample_scattering"):
            self.both(operation, **surface, model=glass, sampler="visible", eta=1.5, seed=6)
        for operation in ("evaluate_transmission", "evaluate_scattering"):
            self.both(operation, **surface, model=glass, sampler="visible", eta=1.5, outgoing=o)
        self.both("sample_reflection", **surface, seed=4, sampler="visible", f0=0.5,
                  model=facetwise.Model(distribution="beckmann", interface="schlick"))

    def test_tables(self):
        table = facetwise.SlopeTable.build(lambda x, y: np.exp(-x * x - y * y), radial=True)
        model = facetwise.Model(table=table)
        got = self.both("sample_reflection", incident=directions(1), alpha_x=0.3, alpha_y=0.3, seed=1, sampler="visible",
                        model=model)
        path = os.path.join(self.folder.name, "table")
        table.save(path)
        again = self.local.sample_reflection(incident=directions(1), alpha_x=0.3, alpha_y=0.3, seed=1, sampler="visible",
                                             model=facetwise.Model(table=facetwise.SlopeTable.load(path)))
        self.assertTrue(equal(got, again))
        with self.assertRaisesRegex(ZeroDivisionError, ""):
            facetwise.SlopeTable.build(lambda x, y: 1 / 0)

    def test_the_commands_bits(self):
        i = directions(7)
        table = np.zeros(COUNT, dtype=[(name, "<f4") for name in ("ix", "iy", "iz")])
        for k, name in enumerate(table.dtype.names):
            table[name] = i[:, k]
        paths = [os.path.join(self.folder.name, name) for name in ("in.npy", "out.npy")]
        np.save(paths[0], table)
        subprocess.run([COMMAND, "sample", "--input", paths[0], "--output", paths[1], "--alpha", "0.5", "--seed", "9"],
                       check=True, capture_output=True)
        theirs, ours = np.load(paths[1]), self.local.sample_reflection(incident=i, alpha_x=0.5, alpha_y=0.5, seed=9)
        for k, name in enumerate(("ox", "oy", "oz")):
            np.testing.assert_array_equal(theirs[name], ours.outgoing[:, k])
        np.testing.assert_array_equal(theirs["weight"], ours.weight)

    def test_arrays_lie_where_they_lie(self):
        i, alpha = directions(1), alphas(3)
        wanted = self.local.sample_reflection(incident=i, alpha_x=alpha, alpha_y=alpha, seed=1)
        # Members of a structure, columns apart, doubles, every second value, backwards.
        structures = np.zeros(COUNT, dtype=[("i", "<f4", 3), ("alpha", "<f4"), ("weight", "<f4"), ("o", "<f4", 3)])
        structures["i"], structures["alpha"] = i, alpha
        into = {"weight": structures["weight"], "outgoing": structures["o"]}
        got = self.local.sample_reflection(incident=structures["i"], alpha_x=structures["alpha"], alpha_y=structures["alpha"],
                                           seed=1, outputs=("outgoing", "weight"), out=into)
        np.testing.assert_array_equal(structures["weight"], wanted.weight)
        np.testing.assert_array_equal(structures["o"], wanted.outgoing)
        self.assertIs(got.weight, into["weight"])
        for x in (alpha.astype(np.float64), np.repeat(alpha, 2)[::2], alpha[::-1].copy()[::-1], list(map(float, alpha))):
            got = self.local.sample_reflection(incident=tuple(i.T), alpha_x=x, alpha_y=alpha, seed=1)
            self.assertTrue(equal(got, wanted))

    def test_lanes_may_be_split_and_chosen(self):
        i = directions(1)
        whole = self.local.sample_reflection(incident=i, alpha_x=0.3, alpha_y=0.3, seed=1)
        half = self.local.sample_reflection(incident=i[COUNT // 2:], alpha_x=0.3, alpha_y=0.3, seed=1, first_id=COUNT // 2)
        np.testing.assert_array_equal(whole.weight[COUNT // 2:], half.weight)
        some = np.arange(5, COUNT, 3)
        got = self.local.sample_reflection(incident=i, alpha_x=0.3, alpha_y=0.3, seed=1, active=some)
        np.testing.assert_array_equal(got.weight[some], whole.weight[some])
        self.assertEqual(got.weight[0], 0)
        ids = np.arange(COUNT)[::-1]
        turned = self.local.sample_reflection(incident=i[::-1], alpha_x=0.3, alpha_y=0.3, seed=1, ids=ids)
        np.testing.assert_array_equal(turned.weight[::-1], whole.weight)

    def test_errors_name_the_field(self):
        good = dict(incident=directions(1), alpha_x=0.3, alpha_y=0.3)
        for arguments, start in (({}, "u1: missing"), ({"seed": 1, "alpha_x": np.ones(3)}, "alpha_x: 3 values for 20000"),
                                 ({"seed": 1, "sampler": "best"}, "sampler: unknown"), ({"seed": 1, "colour": 1}, "colour: "),
                                 ({"seed": 1, "model": facetwise.Model(masking="none")}, "masking: unknown"),
                                 ({"seed": 1, "outputs": ("taste",)}, "out.taste: no output")):
            with self.assertRaises(facetwise.Error) as caught:
                self.local.sample_reflection(**{**good, **arguments})
            self.assertTrue(str(caught.exception).startswith(start), caught.exception)
        with self.assertRaisesRegex(facetwise.Error, "^server unix:/nowhere"):
            facetwise.connect("unix:/nowhere")
        with self.assertRaisesRegex(facetwise.Error, "^target: "):
            facetwise.local("abacus")
        with self.assertRaisesRegex(ValueError, "^weight: "):
            self.local.sample_reflection(**good, seed=1, out={"weight": np.zeros(3, np.float32)})

    def test_compact_answers_are_close(self):
        compact = facetwise.connect(self.address, compact_answers=True)
        arguments = dict(incident=directions(1), alpha_x=alphas(2), alpha_y=0.3, seed=1)
        whole, half = self.local.sample_reflection(**arguments), compact.sample_reflection(**arguments)
        np.testing.assert_array_equal(half.pdf, whole.pdf)
        np.testing.assert_allclose(half.outgoing, whole.outgoing, atol=8e-5)
        np.testing.assert_allclose(half.weight, whole.weight, rtol=2.0 ** -11, atol=2.0 ** -25)
        self.assertFalse(np.array_equal(half.weight, whole.weight))

    def test_threads_share_an_engine(self):
        i = directions(1)
        wanted = self.local.sample_reflection(incident=i, alpha_x=0.3, alpha_y=0.3, seed=1)
        results = []
        threads = [threading.Thread(target=lambda: results.append(
            self.remote.sample_reflection(incident=i, alpha_x=0.3, alpha_y=0.3, seed=1))) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertTrue(len(results) == 4 and all(equal(result, wanted) for result in results))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
