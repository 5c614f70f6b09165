"""Trajectories go to other programs and come from them, as extended XYZ."""

import json

import numpy as np
import pytest

import shakebed
from conftest import SCENE

ase_io = pytest.importorskip("ase.io", reason="ase is not installed: no trajectory is exchanged with it")


def test_ase_reads_our_trajectory(tmp_path):
    stage = {"stage": "simulate", "id": "bed", **SCENE, "compress": False}
    (tmp_path / "r.json").write_text(json.dumps({"name": "r", "stages": [stage]}))
    results = shakebed.run(tmp_path / "r.json", tmp_path / "out")
    ours = results["bed"].trajectory()
    theirs = ase_io.read(tmp_path / "out" / "bed" / "trajectory.extxyz", index=":")
    assert len(theirs) == len(ours.time) == 20
    for frame, atoms in zip(ours.array, theirs):
        assert np.array_equal(atoms.positions[:, [0, 2]], frame[:, 0:2])


def test_we_read_what_ase_writes(tmp_path):
    from ase import Atoms

    random = np.random.default_rng(2)
    places = random.uniform(0, 20, (5, 30, 3))
    ase_io.write(tmp_path / "own.extxyz", [Atoms("Ar30", positions=p, cell=[20, 1, 20]) for p in places])
    read = shakebed.read_trajectory(tmp_path / "own.extxyz")
    assert read.array.shape == (5, 30, 5)
    assert np.allclose(read.array[:, :, 0], places[:, :, 0], atol=1e-8)
    assert np.allclose(read.array[:, :, 1], places[:, :, 2], atol=1e-8)
    assert not read.array[:, :, 2:].any()
