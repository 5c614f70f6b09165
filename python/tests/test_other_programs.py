"""Trajectories of other programs, and ours in them."""

import json
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest

import shakebed
from conftest import SCENE

ase_io = pytest.importorskip("ase.io", reason="ase is not installed: no trajectory is exchanged with it")


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


def test_ase_reads_what_we_write(tmp_path):
    """All numbers of a trajectory, of disks of one and of two sizes."""
    two_sizes = dict(SCENE["disks"], second={"count": 20, "diameter": "4 mm"})
    for name, disks in (("one", SCENE["disks"]), ("two", two_sizes)):
        stage = {"stage": "simulate", "id": "bed", **SCENE, "disks": disks, "compress": False}
        recipe = tmp_path / f"{name}.json"
        recipe.write_text(json.dumps({"name": name, "stages": [stage]}))
        ours = shakebed.run(recipe, tmp_path / name)["bed"].trajectory()
        frames = ase_io.read(tmp_path / name / "bed" / "trajectory.extxyz", index=":")
        assert len(frames) == len(ours.array) == 20
        for k, frame in enumerate(frames):
            assert np.array_equal(frame.positions[:, [0, 2]], ours.positions[k])
            assert np.array_equal(frame.arrays["velo"][:, [0, 2]], ours.velocities[k])
            assert frame.info["Time"] == ours.time[k]
        symbols = frames[0].get_chemical_symbols()
        assert symbols.count("X") == 60 and set(symbols) == ({"X"} if name == "one" else {"X", "B"})
        assert set(frames[0].arrays["radius"]) == ({0.5} if name == "one" else {0.5, 4 / 6})


def test_the_example_fits_a_dump_of_lammps(tmp_path):
    """An ideal gas of T = 2 in a plane with y upwards; four standard errors are allowed (chance 1 in 16,000)."""
    random = np.random.default_rng(3)
    with open(tmp_path / "bed.lammpstrj", "w") as dump:
        for step in range(60):
            dump.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n90\nITEM: BOX BOUNDS pp ff pp\n0 1000\n0 60\n"
                       "-0.5 0.5\nITEM: ATOMS id type x y z\n")
            dump.writelines(f"{k + 1} 1 {x!r} {y!r} 0\n" for k, (x, y) in enumerate(
                zip(random.uniform(0, 1000, 90).tolist(), random.exponential(2, 90).tolist())))
    script = pathlib.Path(__file__).resolve().parents[2] / "examples" / "python" / "your_own_trajectory.py"
    done = subprocess.run([sys.executable, script, tmp_path / "bed.lammpstrj", "1000", "y"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "(60, 90)" in done.stdout
    t, error = re.search(r"T = ([\d.]+) \+- ([\d.]+)", done.stdout).groups()
    assert abs(float(t) - 2) < 4 * float(error) < 1


def test_heights_may_be_in_the_second_coordinate(tmp_path):
    from ase import Atoms

    places = np.random.default_rng(4).uniform(1, 20, (3, 10, 3))
    places[:, :, 2] = 0
    ase_io.write(tmp_path / "flat.extxyz", [Atoms("Ar10", positions=p, cell=[20, 20, 1]) for p in places])
    with pytest.raises(shakebed.InputError, match='pass up="y"') as caught:
        shakebed.read_trajectory(tmp_path / "flat.extxyz")
    assert caught.value.file == str(tmp_path / "flat.extxyz")
    read = shakebed.read_trajectory(tmp_path / "flat.extxyz", up="y")
    assert np.allclose(read.positions, places[:, :, :2], atol=1e-8)
    with pytest.raises(shakebed.UsageError, match="up is 'x'"):
        shakebed.read_trajectory(tmp_path / "flat.extxyz", up="x")
