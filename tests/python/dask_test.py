#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Dask arrays: bits that do not depend on chunks, here, on a server and on a cluster of three processes of which one is killed.
Usage: dask_test.py SERVER"""
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import dask
import dask.array as da
import distributed
import numpy as np

import facetwise

COUNT = 300_000
CHUNKS = ((COUNT,), (1, 100_000, 77_777, COUNT - 177_778), (10_000,) * 30)


def surface():
    random = np.random.default_rng(1)
    z = random.uniform(-0.3, 1, COUNT)
    phi = random.uniform(0, 2 * np.pi, COUNT)
    r = np.sqrt(1 - z * z)
    i = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32)
    return i, random.uniform(0, 1, COUNT).astype(np.float32)


def slowly(x):
    time.sleep(0.05)
    return x


class DaskArrays(unittest.TestCase):
    def setUp(self):
        self.engine = facetwise.local()
        self.i, self.alpha = surface()
        self.arguments = dict(alpha_y=0.25, seed=7, first_id=11)
        self.wanted = self.engine.sample_reflection(incident=self.i, alpha_x=self.alpha, **self.arguments)

    def same(self, got, wanted=None):
        wanted = wanted or self.wanted
        self.assertEqual(list(got.keys()), list(wanted.keys()))
        self.assertEqual(str(got.statistics), str(wanted.statistics))
        for name in wanted.keys():
            self.assertEqual(got[name].dtype, wanted[name].dtype)
            self.assertEqual(got[name].tobytes(), np.ascontiguousarray(wanted[name]).tobytes(), name)

    def lazy(self, chunks, engine=None, i=None):
        i = da.from_array(self.i, chunks=(chunks, (2, 1))) if i is None else i
        return (engine or self.engine).sample_reflection(incident=i, alpha_x=da.from_array(self.alpha, chunks=(chunks,)),
                                                         **self.arguments)

    def test_chunks_change_no_bit(self):
        for chunks in CHUNKS:
            got = self.lazy(chunks)
            self.assertEqual(got.outgoing.shape, (COUNT, 3))
            self.assertEqual(got.outgoing.chunks, (chunks, (3,)))
            self.assertEqual((got.pdf.dtype, got.status.dtype), (np.float32, np.uint8))
            self.same(got.compute())
        # Three columns, of which one is NumPy's and one a number; chunks that do not fit; part of it alone.
        x, z = (da.from_array(self.i[:, k], chunks=50_001) for k in (0, 2))
        mixed = self.engine.masking(incident=(x, self.i[:, 1], z), alpha_x=da.from_array(self.alpha, chunks=33_333), alpha_y=0.5)
        self.same(mixed.compute(), self.engine.masking(incident=self.i, alpha_x=self.alpha, alpha_y=0.5))
        np.testing.assert_array_equal(self.lazy(CHUNKS[2]).weight[123_456:123_460].compute(), self.wanted.weight[123_456:123_460])

    def test_ids_go_with_their_lanes(self):
        ids = np.arange(COUNT)[::-1] + 11
        got = self.engine.sample_reflection(incident=da.from_array(self.i[::-1].copy(), chunks=(70_000, 3)), ids=da.from_array(ids),
                                            alpha_x=self.alpha[::-1], alpha_y=0.25, seed=7)
        np.testing.assert_array_equal(got.weight.compute()[::-1], self.wanted.weight)
        # Where all else is numbers the ids have the lanes.
        few = self.engine.sample_reflection(incident=(0.6, 0, 0.8), ids=da.arange(100, chunks=7), alpha_x=0.3, alpha_y=0.3, seed=1)
        plain = self.engine.sample_reflection(incident=(0.6, 0, 0.8), ids=np.arange(100), alpha_x=0.3, alpha_y=0.3, seed=1, lanes=100)
        self.same(few.compute(), plain)
        none = self.engine.masking(incident=da.zeros((0, 3), dtype=np.float32), alpha_x=0.3, alpha_y=0.3).compute()
        self.assertEqual((none.projected_area.shape, none.statistics.accepted), ((0,), 0))

    def test_errors(self):
        i = da.from_array(self.i, chunks=(1000, 3))
        with self.assertRaisesRegex(facetwise.Error, "^alpha_x: 7 values for 300000 lanes"):
            self.engine.sample_reflection(incident=i, alpha_x=np.ones(7), alpha_y=1.0, seed=1)
        with self.assertRaisesRegex(ValueError, "^incident: chunks of unknown length"):
            self.engine.sample_reflection(incident=i[i[:, 2] > 0], alpha_x=0.3, alpha_y=0.3, seed=1)
        with self.assertRaisesRegex(ValueError, "^active"):
            self.engine.sample_reflection(incident=i, alpha_x=0.3, alpha_y=0.3, seed=1, active=np.arange(3))
        with self.assertRaisesRegex(facetwise.Error, "^colour"):
            self.engine.sample_reflection(incident=i, alpha_x=0.3, alpha_y=0.3, seed=1, colour=1.0).weight.compute()

    def test_a_cluster_that_loses_a_worker(self):
        table = facetwise.SlopeTable.build(lambda x, y: np.exp(-4 * x * x - y * y))
        self.assertEqual(len(pickle.loads(pickle.dumps(table)).__reduce__()[1][0]), len(table.__reduce__()[1][0]))
        with tempfile.TemporaryDirectory() as folder, dask.config.set({"distributed.worker.daemon": False}):
            address = "unix:" + os.path.join(folder, "socket")
            server = subprocess.Popen([sys.argv[1], "--listen", address], stdout=subprocess.PIPE, text=True)
            try:
                while "ready" not in server.stdout.readline():
                    self.assertIsNone(server.poll())
                with distributed.LocalCluster(n_workers=3, threads_per_worker=1, host="127.0.0.1", dashboard_address=None,
                                              local_directory=folder) as cluster, distributed.Client(cluster) as client:
                    for engine in (self.engine, facetwise.connect(address)):
                        processes = client.run(os.getpid)
                        self.assertEqual(len(processes), 3)
                        i = da.from_array(self.i, chunks=(10_000, 3)).map_blocks(slowly)
                        future = client.compute(list(self.lazy(CHUNKS[2], engine, i)._outputs.values()))
                        time.sleep(0.4)
                        self.assertFalse(all(f.done() for f in future))  # else nothing is lost
                        victim = next(iter(processes.values()))
                        os.kill(victim, signal.SIGKILL)
                        for name, array in zip(self.wanted.keys(), client.gather(future)):
                            self.assertEqual(array.tobytes(), np.ascontiguousarray(self.wanted[name]).tobytes(), name)
                        client.wait_for_workers(3)
                        self.assertNotIn(victim, client.run(os.getpid).values())
                    model = facetwise.Model(table=table)
                    arguments = dict(model=model, sampler="visible", alpha_x=0.5, alpha_y=0.5, seed=1)
                    self.same(self.engine.sample_reflection(incident=i, **arguments).compute(),
                              self.engine.sample_reflection(incident=self.i, **arguments))
            finally:
                server.terminate()
                server.wait()
                server.stdout.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
