"""What a user gets wrong at first: nothing is taken silently for something else."""

import json
import pathlib
import warnings

import numpy as np
import pytest

import shakebed
from conftest import SCENE, drawn_image, shakebed_program

HEIGHT = np.linspace(0.5, 15, 40)
DENSITY = 1.1 / (1 + np.exp((HEIGHT - 8) / 1.5))
ERROR = np.full(40, 0.01)


@pytest.fixture
def short(scene):
    return dict(scene, settle="0.5 s", measure="0.3 s")


@pytest.mark.parametrize("changes, pointer, words", [
    ({"floor": dict(SCENE["floor"], amplitude="0.4 mm")}, "/floor/amplitude", "never throws the bed"),
    ({"box": dict(SCENE["box"], width="30 mm")}, "/box/width", "can lock"),
    ({"box": dict(SCENE["box"], width=30.92)}, "/box/width", 'Did you mean "30.92 mm"'),
])
def test_scenes_warn_as_the_command_line_does(short, tmp_path, changes, pointer, words):
    scene = dict(short, **changes)
    (tmp_path / "r.json").write_text(json.dumps({"name": "r", "stages": [{"stage": "simulate", "id": "bed", **scene}]}))
    said = shakebed_program("validate", tmp_path / "r.json", "--json").stdout
    with pytest.warns(shakebed.BedWarning) as seen:
        bed = shakebed.simulate(scene)
    assert len(bed.warnings) == len(json.loads(said)["warnings"]) == len(seen)
    (one,) = [w for w in bed.warnings if words in w]
    assert one.startswith(f"scene: {pointer}: ")
    assert all(problem["problem"] in said for problem in bed._bed.warnings)
    with pytest.warns(shakebed.BedWarning):
        assert shakebed.Simulation(scene).warnings == bed.warnings


def test_a_sound_scene_does_not_warn(short):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert shakebed.simulate(short).warnings == []


def test_a_diameter_in_metres_by_mistake_warns():
    with pytest.warns(shakebed.BedWarning, match='Did you mean "3 mm"'):
        shakebed.theory(diameter=3)


def test_scenes_take_numbers_of_numpy_and_paths(short, tmp_path):
    wanted = shakebed.simulate(short).observables
    assert shakebed.simulate(dict(short, seed=np.int64(3))).observables == wanted
    assert shakebed.simulate(short, seed=np.int32(3)).observables == wanted
    (tmp_path / "r.json").write_text(json.dumps(short))
    assert shakebed.simulate(tmp_path / "r.json").observables == wanted
    with pytest.raises(shakebed.UsageError, match="cannot be part of a recipe"):
        shakebed.simulate(dict(short, seed=1 + 2j))
    for nothing in (None, [1, 2], 3):
        with pytest.raises(shakebed.UsageError, match="a scene must be"):
            shakebed.simulate(nothing)


def test_quantities_are_not_calculated_with_as_tuples():
    q = shakebed.Quantity(2.0, 0.1, "D")
    for wrong in (lambda: 2 * q, lambda: q * 2, lambda: q + q, lambda: q - 1, lambda: (1,) + q):
        with pytest.raises(TypeError):
            wrong()
    assert float(q) * 2 == 4 and tuple(q) == (2.0, 0.1, "D")


def test_images_that_are_not_grey_levels_of_0_to_255_are_named():
    image, _ = drawn_image()
    for wrong, words in (
        (image / 255.0, "multiply the image by 255"),
        (np.zeros((0, 5), np.uint8), "empty"),
        (np.dstack([image] * 3), "dimensions"),
        (np.ma.masked_greater(image, 199), "masked"),
        (image > 100, "uint8"),
        (image[:, ::-1], "ascontiguousarray"),
        (image[::-1], "ascontiguousarray"),
        (np.where(image > 199, np.nan, image), "not finite"),
    ):
        with pytest.raises(shakebed.UsageError, match=words):
            shakebed.find_disks(wrong)
    for options, words in (({"radius": "9 px"}, "radius is '9 px'; it must be a number"),
                           ({"roi": (1, 2, 3)}, "four whole numbers"), ({"polarity": "black"}, "dark or bright")):
        with pytest.raises(shakebed.UsageError, match=words):
            shakebed.find_disks(image, **options)
    with pytest.raises(TypeError, match="did you mean 'radius'"):
        shakebed.find_disks(image, radiu=9)


def test_frames_may_come_one_by_one_but_not_alone():
    image, _ = drawn_image()
    assert shakebed.measure_bed((image for _ in range(2)), "3 mm").frames == 2
    with pytest.raises(shakebed.UsageError, match="one image"):
        shakebed.measure_bed(image, "3 mm")
    with pytest.raises(shakebed.UsageError, match="files or images"):
        shakebed.measure_bed(None, "3 mm")
    with pytest.raises(shakebed.UsageError, match="multiply the image by 255"):
        shakebed.measure_bed([image / 255.0], "3 mm")
    with pytest.raises(shakebed.UsageError, match="whole number"):
        shakebed.measure_bed([image], "3 mm", threads=-1)


def test_profiles_that_cannot_be_fitted_say_where():
    bad = DENSITY.copy()
    bad[5] = np.nan
    beyond = np.diag(ERROR**2)
    beyond[0, 1] = beyond[1, 0] = 1
    for arguments, words in (
        ((HEIGHT, bad, ERROR), "bin 5"),
        ((HEIGHT, DENSITY, -ERROR), "negative in bin 0"),
        ((HEIGHT, DENSITY, np.nan * ERROR), "not a finite number"),
    ):
        fit = shakebed.fit_profile(*arguments)
        assert not fit.ok and words in fit.message, fit.message
    for covariance, words in ((beyond, "correlation outside -1 to 1"), (-np.diag(ERROR**2), "negative variance"),
                              (np.triu(np.ones((40, 40))), "not symmetric")):
        fit = shakebed.fit_profile(HEIGHT, DENSITY, covariance=covariance)
        assert not fit.ok and words in fit.message, fit.message
    answer = shakebed.find_answer(HEIGHT, bad, ERROR)
    assert answer["status"] == "bad input" and answer["temperature"] is None and answer["solid_height"] is None


def test_arguments_of_a_fit_are_named():
    with pytest.raises(shakebed.UsageError, match="height cannot be read as numbers"):
        shakebed.fit_profile([1, [2, 3]], [1, 2])
    with pytest.raises(shakebed.UsageError, match="density is a masked array"):
        shakebed.fit_profile(HEIGHT, np.ma.masked_less(DENSITY, 0.1), ERROR)
    with pytest.raises(shakebed.UsageError, match=r"covariance has shape \(40,\); it must be \(40, 40\)"):
        shakebed.fit_profile(HEIGHT, DENSITY, covariance=ERROR)
    with pytest.raises(shakebed.UsageError, match="confidence is 'high'"):
        shakebed.fit_profile(HEIGHT, DENSITY, ERROR, confidence="high")
    with pytest.raises(shakebed.UsageError, match="window is 3; it must be a pair"):
        shakebed.fit_profile(HEIGHT, DENSITY, ERROR, window=3)
    with pytest.raises(shakebed.UsageError, match="temperature_x is 'hot'"):
        shakebed.find_answer(HEIGHT, DENSITY, ERROR, temperature_x="hot")
    with pytest.raises(shakebed.UsageError, match="gamma is 'four'"):
        shakebed.gamma_to_temperature(gamma="four", frequency=20, diameter="3 mm", initial_height=10)
    with pytest.raises(shakebed.UsageError, match="plateau_density is 5"):
        shakebed.gamma_to_temperature(gamma=4, frequency=20, diameter="3 mm", initial_height=10, plateau_density=5)
    with pytest.raises(shakebed.UsageError, match="heights; at most"):
        shakebed.density_profile(np.random.default_rng(1).uniform(0, 10, (3, 3)), 10, spacing=1e-9)


def test_one_error_for_all_and_lists_are_the_same_fit():
    wanted = shakebed.fit_profile(HEIGHT, DENSITY, ERROR).to_dict()
    assert shakebed.fit_profile(HEIGHT, DENSITY, 0.01).to_dict() == wanted
    assert shakebed.fit_profile(HEIGHT.tolist(), DENSITY.tolist(), ERROR.tolist()).to_dict() == wanted
    spread = np.repeat(HEIGHT, 3)[::3]
    assert not spread.flags.c_contiguous or spread.base is not None
    assert shakebed.fit_profile(spread, DENSITY, ERROR).to_dict() == wanted
    half_open = shakebed.fit_profile(HEIGHT, DENSITY, ERROR, window=(3, None)).to_dict()
    assert half_open["window"] != wanted["window"] if "window" in wanted else half_open != wanted


def test_what_is_left_of_a_failed_run_can_be_loaded(short, tmp_path):
    recipe = tmp_path / "r.json"
    (tmp_path / "no.png").write_text("this is no picture")
    recipe.write_text(json.dumps({"name": "r", "stages": [
        {"stage": "simulate", "id": "bed", **short}, {"stage": "extract", "images": ["no.png"], "diameter": "3 mm"}]}))
    with pytest.raises(shakebed.Error) as caught:
        shakebed.run(recipe, tmp_path / "out")
    assert caught.value.exit_code == 4 and "no.png" in str(caught.value)
    results = shakebed.load(tmp_path / "out")
    assert results["bed"]["temperature_x"].value > 0
    with pytest.raises(KeyError, match="there is no stage"):
        results["extract"]
    with pytest.raises(shakebed.InputError, match="is a file") as caught:
        shakebed.load(recipe)
    assert caught.value.file == str(recipe)


def test_files_that_cannot_be_read_have_file_and_line(tmp_path):
    (tmp_path / "bad.extxyz").write_text("two\n")
    with pytest.raises(shakebed.InputError) as caught:
        shakebed.read_trajectory(tmp_path / "bad.extxyz")
    assert (caught.value.file, caught.value.line) == (str(tmp_path / "bad.extxyz"), 1)
    with pytest.raises(shakebed.InputError) as caught:
        shakebed.read_trajectory(tmp_path / "none.extxyz")
    assert (caught.value.file, caught.value.line) == (str(tmp_path / "none.extxyz"), 0)
    with pytest.raises(shakebed.InputError) as caught:
        shakebed.simulate(pathlib.Path(tmp_path / "none.json"))
    assert caught.value.file == str(tmp_path / "none.json")
