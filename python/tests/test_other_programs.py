"""Trajectories of other programs, as extended XYZ."""

import numpy as np
import pytest

import shakebed

ase_io = pytest.importorskip("ase.io", reason="ase is not installed: none of its trajectories is read")


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
