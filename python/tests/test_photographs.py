"""Disks in arrays and files."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import shakebed
from conftest import SCENE, drawn_image, growth, shakebed_program


def test_importing_the_package_does_not_load_opencv():
    code = "import shakebed, sys; print('shakebed._images' in sys.modules, 'opencv' in open('/proc/self/maps').read())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split() == ["False", "False"]


def test_drawn_disks_are_found():
    image, centres = drawn_image()
    found = shakebed.find_disks(image)
    assert len(found) == len(centres)
    nearest = [np.hypot(found.x - x, found.y - y).min() for x, y in centres]
    assert max(nearest) < 0.3 and abs(found.radius - 9) < 0.3
    assert found.std_error.shape == (len(centres), 2) and not found.bright


@pytest.mark.long
def test_types_and_strides_of_images_do_not_matter():
    image, _ = drawn_image(seed=2)
    wanted = shakebed.find_disks(image)
    for other in (image.astype(np.float32), image.astype(np.float64), image.astype(np.uint16) * 257):
        assert np.allclose(shakebed.find_disks(other).x, wanted.x, atol=1e-3)
    wide = np.zeros((180, 400), np.uint8)
    wide[:, 100:320] = image
    assert np.array_equal(shakebed.find_disks(wide[:, 100:320]).x, wanted.x)  # rows that do not follow one another
    with pytest.raises(ValueError, match="side by side"):
        shakebed.find_disks(wide.T)
    with pytest.raises(ValueError, match="dimensions"):
        shakebed.find_disks(np.zeros((5, 5, 3), np.uint8))
    with pytest.raises(ValueError, match="uint8"):
        shakebed.find_disks(np.zeros((5, 5), np.int64))
    with pytest.raises(ValueError, match="empty"):
        shakebed.find_disks(np.zeros((0, 0), np.uint8))


def test_an_image_without_beads_is_said_to_have_none():
    noise = np.random.default_rng(1).integers(0, 255, (100, 120)).astype(np.uint8)
    found = shakebed.find_disks(noise)
    assert len(found) == 0 and found.message


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """A rendered bed, and what the command line measures of its pictures."""
    place = tmp_path_factory.mktemp("photographs")
    bed = dict(SCENE, frames={"count": 4, "phases": 2})
    recipe = {"name": "photographs", "stages": [
        {"stage": "simulate", "id": "bed", **bed},
        {"stage": "render", "id": "film", "from": "bed", "scale": "0.2 mm/px", "seed": 1}]}
    (place / "r.json").write_text(json.dumps(recipe))
    done = shakebed_program("run", place / "r.json", "--out", place / "out", "--quiet")
    assert done.returncode == 0, done.stderr
    pictures = place / "out" / "film" / "frames"
    recipe = {"name": "extract", "stages": [
        {"stage": "extract", "id": "seen", "images": [str(pictures)], "diameter": "3 mm"},
        {"stage": "fit", "from": "seen"}]}
    (place / "e.json").write_text(json.dumps(recipe))
    done = shakebed_program("run", place / "e.json", "--out", place / "seen", "--quiet")
    assert done.returncode == 0, done.stderr
    return pictures, shakebed.load(place / "seen")["seen"]


@pytest.fixture(scope="module")
def measured(frames):
    """The same by the module, and the progress that it told."""
    seen = []
    return shakebed.measure_bed(frames[0], "3 mm", progress=seen.append), seen


def test_the_answer_is_that_of_the_command_line(frames, measured):
    pictures, _ = frames
    printed = json.loads((pictures.parents[2] / "seen/fit/fit.json").read_text())["answer"]
    answer = measured[0].answer()
    assert (answer["verdict"], answer["why"], answer["advice"]) == (printed["verdict"], printed["why"], printed["advice"])
    assert answer["temperature"] == printed.get("temperature", {}).get("value")
    assert answer["temperature_over_mg"] == printed.get("temperature_over_mg", {}).get("value")
    # Fewer than 30 beads in all: what the photographs show against a temperature is passed on.
    image, _ = drawn_image(count=12)
    assert "Only 12 beads" in shakebed.measure_bed([image], "3 mm").answer()["why"]


def test_the_profile_of_photographs_knows_the_walls_only_where_both_are_in_view(frames, measured):
    bed = measured[0]
    assert bed.profile.width_between_walls == bed.width
    middle = 0.5 * (bed.disks["x_px"].min() + bed.disks["x_px"].max())
    cut = shakebed.measure_bed(frames[0], "3 mm",
                               roi=(0, 0, int(middle), int(bed.floor + bed.radius)))
    assert cut.profile.width_between_walls is None


@pytest.mark.long
def test_control_c_ends_the_search_in_one_picture():
    code = (
        "import sys, time, shakebed; sys.path.insert(0, sys.argv[1]); from conftest import drawn_image\n"
        "image = drawn_image(shape=(900, 900), count=600)[0]\n"
        "print('ready', flush=True)\n"
        "try:\n    shakebed.find_disks(image)\n"
        "except KeyboardInterrupt:\n    sys.exit(42)\n"
        "print('it ended by itself')\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, os.path.dirname(__file__)], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"ready\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 42
    process.stdout.close()


def test_a_measured_bed_is_that_of_the_command_line(frames, measured):
    pictures, wanted = frames
    bed, seen = measured
    assert seen[-1] == 1
    profile, disks = wanted.table("profile"), wanted.table("disks")
    assert np.array_equal(bed.profile.height, profile["height"])
    assert np.array_equal(bed.profile.number_density, profile["number_density"])
    assert np.array_equal(bed.profile.std_error, profile["std_error"])
    for name, digits in (("frame", 0), ("x_px", 4), ("y_px", 4), ("x", 6), ("z", 6)):  # as disks.csv is written
        assert [f"{a:.{digits}f}" for a in bed.disks[name]] == [f"{b:.{digits}f}" for b in disks[name]], name
    assert np.array_equal(shakebed.measure_bed(pictures, 3e-3, threads=2).profile.number_density,
                          bed.profile.number_density)


def test_errors_of_photographs(tmp_path):
    with pytest.raises(shakebed.InputError) as caught:
        shakebed.measure_bed(tmp_path / "none.png", "3 mm")
    assert "none.png" in caught.value.file
    with pytest.raises(shakebed.StageError, match="no beads"):
        shakebed.measure_bed([np.full((80, 80), 100, np.uint8)], "3 mm")
    with pytest.raises(shakebed.UsageError):
        shakebed.measure_bed(drawn_image()[0][None], 0)


@pytest.mark.long
def test_control_c_ends_a_measurement_on_several_threads():
    code = (
        "import sys, shakebed; sys.path.insert(0, sys.argv[1]); from conftest import drawn_image\n"
        "frames = [drawn_image()[0]] * 3000\n"
        "def begun(part):\n    print('begun', flush=True)\n"
        "try:\n    shakebed.measure_bed(frames, '3 mm', threads=2, progress=begun)\n"
        "except KeyboardInterrupt:\n    sys.exit(42)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, os.path.dirname(__file__)], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"begun\n"
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 42
    process.stdout.close()


@pytest.mark.long
def test_frames_in_memory_are_read_where_they_lie():
    code = (
        "import resource, sys, shakebed; sys.path.insert(0, sys.argv[1]); from conftest import drawn_image\n"
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        "image = drawn_image()[0]\n"
        "shakebed.measure_bed([image] * 3, '3 mm')\n"
        "before = peak()\n"
        "def enough(fraction): raise StopIteration\n"
        "try:\n    shakebed.measure_bed([image] * 4000, '3 mm', progress=enough)\n"
        "except StopIteration:\n    print(peak() - before)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, os.path.dirname(__file__)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 60  # MiB; 4,000 frames of 220 x 180 levels in floating point would be 604


@pytest.mark.long
def test_memory_does_not_grow_with_images():
    image, _ = drawn_image(shape=(70, 80), radius=7, count=5)

    def work():
        found = shakebed.find_disks(image)
        found.std_error, found.full()

    assert growth(work) < 8000  # a leak of one image a call would be 45,000 bytes


@pytest.mark.long
def test_twelve_lines_go_from_photographs_to_a_plot(frames, tmp_path):
    pytest.importorskip("matplotlib")
    script = pathlib.Path(__file__).resolve().parents[2] / "examples" / "python" / "photographs_to_plot.py"
    assert len([line for line in script.read_text().splitlines() if line.strip()]) <= 12
    done = subprocess.run([sys.executable, script, frames[0], "3 mm"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "profile.png").read_bytes().startswith(b"\x89PNG")
    alone = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True)
    assert alone.returncode == 1 and alone.stderr.startswith("usage: ")
