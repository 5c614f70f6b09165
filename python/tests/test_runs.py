"""Recipes run from Python, and folders of results."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import shakebed
from conftest import SCENE


@pytest.fixture
def recipe(tmp_path):
    file = tmp_path / "r.json"
    file.write_text(json.dumps({"name": "r", "stages": [{"stage": "simulate", "id": "bed", **SCENE},
                                                       {"stage": "fit", "from": "bed"}]}, indent=1))
    return file


def test_run_and_load(recipe, tmp_path):
    results = shakebed.run(recipe, tmp_path / "out", set={"/stages/bed/seed": 7}, jobs=1)
    assert list(results.stages) == ["bed", "fit"]
    t = results["fit"]["temperature"]
    assert isinstance(t, shakebed.Quantity) and t.unit == "m g D" and t.value > 0
    assert results["bed"]["temperature_x"] == shakebed.simulate(SCENE, seed=7).observables["temperature_x"]
    table = results["bed"].table("profile")
    assert table.units["height"] == "D" and table.height.shape == table["number_density"].shape
    assert "profile" in results["bed"].tables
    assert results.answer["verdict"] and "verdict" in results._repr_html_()
    assert results.manifest and results.report.is_file()
    again = shakebed.load(tmp_path / "out")
    assert again.summary == results.summary
    with pytest.raises(KeyError, match="there is no stage"):
        again["bad"]
    with pytest.raises(shakebed.InputError, match="no such table"):
        again["bed"].table("nothing")


def test_a_sweep_is_a_table(recipe, tmp_path):
    assert shakebed.load(shakebed.run(recipe, tmp_path / "one").folder).sweep is None
    content = json.loads(recipe.read_text())
    content["sweep"] = {"over": {"/stages/bed/floor/amplitude": ["2 mm", "3 mm"]}, "collect": ["/bed/center_of_mass_rise"]}
    recipe.write_text(json.dumps(content))
    results = shakebed.run(recipe, tmp_path / "out", jobs=1)
    assert len(results.sweep) == 2
    low, high = results.sweep["bed_center_of_mass_rise"]
    assert 0 < low < high
    assert "a sweep of 2 points" in repr(results)


def test_mistakes_have_file_pointer_and_line(recipe, tmp_path):
    text = recipe.read_text().replace('"settle": "0.5 s"', '"settle": "0.5 kg"')
    recipe.write_text(text)
    line = next(k for k, row in enumerate(text.splitlines(), 1) if "settle" in row)
    with pytest.raises(shakebed.RecipeError) as caught:
        shakebed.run(recipe, tmp_path / "out")
    assert (caught.value.file, caught.value.pointer, caught.value.line) == (str(recipe), "/stages/0/settle", line)
    assert not (tmp_path / "out").exists()
    with pytest.raises(shakebed.InputError):
        shakebed.run(tmp_path / "none.json", tmp_path / "out")
    with pytest.raises(shakebed.InputError, match="no such folder"):
        shakebed.load(tmp_path / "nothing")
    with pytest.raises(shakebed.InputError, match="summary.json"):
        shakebed.load(tmp_path)


def test_a_failed_check_has_its_results(recipe, tmp_path):
    document = json.loads(recipe.read_text())
    document["stages"].append({"stage": "check", "from": ["fit"],
                               "expect": {"/fit/chi2_per_dof": {"value": -1, "absolute": 0.1}}})
    recipe.write_text(json.dumps(document))
    with pytest.raises(shakebed.CheckFailed) as caught:
        shakebed.run(recipe, tmp_path / "out")
    assert caught.value.exit_code == 6 and caught.value.results["fit"]["temperature"].value > 0


def test_control_c_ends_the_program_too(recipe, tmp_path):
    code = (f"import shakebed, sys\nprint('ready', flush=True)\n"
            f"try:\n    shakebed.run({str(recipe)!r}, {str(tmp_path / 'out')!r}, "
            f"set={{'/stages/bed/measure': '100000 s'}})\n"
            f"except KeyboardInterrupt:\n    sys.exit(42)\n")
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"ready\n"
    while not list((tmp_path / "out").glob(".partial-bed-*")):  # the stage has begun
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 42
    process.stdout.close()
    shakebed.run(recipe, tmp_path / "out")  # nobody holds the folder's lock


def test_control_c_while_the_program_starts_ends_it(recipe, tmp_path, monkeypatch):
    start, started = subprocess.Popen, []

    def interrupted(*arguments, **options):
        started.append(start(*arguments, **options))
        os.kill(os.getpid(), signal.SIGINT)
        return started[0]

    monkeypatch.setattr(subprocess, "Popen", interrupted)
    before = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(KeyboardInterrupt):
            shakebed.run(recipe, tmp_path / "out", set={"/stages/bed/measure": "100000 s"})
        assert started[0].poll() is not None
        assert signal.getsignal(signal.SIGINT) is before
    finally:
        started[0].kill()


def test_the_module_is_the_command_line():
    done = subprocess.run([sys.executable, "-m", "shakebed", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith(f"shakebed {shakebed.__version__}")
    done = subprocess.run([sys.executable, "-m", "shakebed", "thoery"], capture_output=True, text=True)
    assert done.returncode == 2 and "did you mean" in done.stderr
