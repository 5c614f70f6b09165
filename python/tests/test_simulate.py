"""Beds simulated from Python are those of the command line, to the last digit; they stop on Ctrl-C and share no state."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import shakebed
from conftest import growth, shakebed_program


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The same scene, run by the command line."""
    from conftest import SCENE

    place = tmp_path_factory.mktemp("bed")
    recipe = {"name": "bed", "stages": [{"stage": "simulate", "id": "bed", **SCENE}]}
    (place / "bed.json").write_text(json.dumps(recipe))
    done = shakebed_program("run", place / "bed.json", "--out", place / "out", "--quiet")
    assert done.returncode == 0, done.stderr
    return place


def test_results_are_those_of_the_command_line(scene, folder):
    bed = shakebed.simulate(scene)
    files = shakebed.load(folder / "out")["bed"]
    table = files.table("profile")
    for name in ("height", "number_density", "std_error"):
        assert np.array_equal(getattr(bed.profile, name), table[name], equal_nan=True), name
    floor_frame = files.table("profile_floor_frame")
    assert np.array_equal(bed.floor_frame_profile.number_density, floor_frame["number_density"])
    for name, quantity in bed.observables.items():
        assert quantity == files[name], name
    assert {"temperature_x", "temperature_z", "temperature_z_local", "center_of_mass_rise"} <= set(bed.observables)
    assert bed.energy["dissipated"] == files["energy_ledger"]["dissipated"]
    assert bed.counters["collisions"] == files["collisions"]


def test_covariance_is_that_of_the_command_line(scene, folder):
    covariance = shakebed.simulate(scene).profile.covariance
    table = shakebed.load(folder / "out")["bed"].table("covariance")
    size = covariance.shape[0]
    upper = [(i, j) for i in range(size) for j in range(i, size)]
    assert len(table) == len(upper)
    assert np.array_equal(table["covariance"], [covariance[i, j] for i, j in upper])


def test_trajectory_is_that_of_the_command_line_and_not_a_copy(scene, folder):
    bed = shakebed.simulate(scene)
    frames = bed.trajectory()
    read = shakebed.load(folder / "out")["bed"].trajectory()
    assert frames.array.shape == (20, 60, 5)
    assert np.array_equal(frames.array, read.array)
    assert np.array_equal(frames.time, read.time) and np.array_equal(frames.phase, read.phase)
    assert not frames.array.flags.owndata and not frames.array.flags.writeable
    assert frames.array.ctypes.data == bed.trajectory().array.ctypes.data
    del bed  # the array keeps what it views alive
    assert np.array_equal(frames.array, read.array)


def test_file_text_and_dict_are_one_scene(scene, folder):
    from_dict = shakebed.simulate(scene)
    assert shakebed.simulate(json.dumps(scene)).observables == from_dict.observables
    assert shakebed.simulate(folder / "bed.json").observables == from_dict.observables
    assert shakebed.simulate(scene, seed=4).observables != from_dict.observables


def test_stepping_goes_through_the_same_states(scene):
    frames = shakebed.simulate(scene).trajectory()
    bed = shakebed.Simulation(scene)
    for k in (0, 7, 19):
        bed.advance_to(frames.time[k])
        assert np.array_equal(bed.positions, frames.array[k, :, 0:2])
        assert np.array_equal(bed.velocities, frames.array[k, :, 2:4])
    assert abs(bed.energy["imbalance"]) < 1e-9
    with pytest.raises(ValueError, match="cannot advance to"):
        bed.advance_to(0)


def test_mistakes_are_located(scene, tmp_path):
    scene["disks"] = dict(scene["disks"], diameter="3 furlongs")
    with pytest.raises(shakebed.RecipeError) as caught:
        shakebed.simulate(scene)
    assert caught.value.pointer == "/disks/diameter" and caught.value.exit_code == 3
    text = '{\n "name": "b",\n "stages": [{"stage": "simulate",\n   "discs": 3}]}\n'
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(shakebed.RecipeError) as caught:
        shakebed.simulate(tmp_path / "bad.json")
    unknown = [p for p in caught.value.problems if "discs" in p["pointer"]]
    assert unknown and unknown[0]["line"] == 4 and unknown[0]["file"].endswith("bad.json")
    with pytest.raises(shakebed.InputError):
        shakebed.simulate(tmp_path / "none.json")


def test_what_memory_cannot_hold_is_refused(scene):
    with pytest.raises(shakebed.RecipeError, match="replicas"):
        shakebed.simulate(dict(scene, replicas=2))


def test_progress_is_shown_and_its_exceptions_end_the_run(scene):
    seen = []
    shakebed.simulate(scene, progress=seen.append)
    assert seen == sorted(seen) and seen[-1] > 0.9

    def refuse(fraction):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        shakebed.simulate(dict(scene, measure="200 s"), progress=refuse)


def test_control_c_ends_a_long_run():
    code = (
        "import sys, shakebed; sys.path.insert(0, sys.argv[1]); from conftest import SCENE\n"
        "print('ready', flush=True)\n"
        "try:\n    shakebed.simulate(dict(SCENE, measure='100000 s'))\n"
        "except KeyboardInterrupt:\n    sys.exit(42)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, os.path.dirname(__file__)], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"ready\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 42
    process.stdout.close()


def test_threads_do_not_disturb_one_another(scene):
    wanted = [shakebed.simulate(scene, seed=seed).observables for seed in range(1, 5)]
    found = [None] * 4

    def work(k):
        found[k] = shakebed.simulate(scene, seed=k + 1).observables

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == wanted


def test_the_interpreter_is_free_while_a_bed_runs(scene):
    counted = 0
    done = threading.Event()

    def work():
        shakebed.simulate(dict(scene, measure="10 s"))
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    while not done.is_set():
        counted += 1
        time.sleep(0.001)
    thread.join()
    assert counted > 3  # with the GIL held the loop would have stood still


def test_memory_does_not_grow():
    small = {"units": "reduced", "seed": 1, "disks": {"count": 4}, "gravity": 0,
             "box": {"width": 5, "sides": "periodic", "lid": {"kind": "periodic", "height": 5}},
             "settle": 0, "measure": 1, "frames": {"count": 50}}

    def work():
        bed = shakebed.simulate(small)
        bed.trajectory(), bed.profile
        shakebed.fit_profile([0, 1, 2, 3, 4, 5], [1, 1, 0.8, 0.4, 0.1, 0.01], sweep=False, compare=False)

    assert growth(work) < 8000  # a leak of one trajectory of 50 frames x 4 disks a call would be 64,000 bytes
