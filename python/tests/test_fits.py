"""Fits and theory from Python are those of the command line."""

import json

import numpy as np
import pytest

import shakebed
from conftest import shakebed_program


@pytest.fixture(scope="module")
def curve():
    """An isothermal column of hard disks, simulated."""
    scene = {"units": "reduced", "seed": 5, "disks": {"count": 100}, "gravity": 1,
             "box": {"width": 12.3, "sides": "periodic"}, "floor": {"motion": "still"},
             "bath": {"kind": "andersen", "temperature": 1.0, "rate": 0.1},
             "settle": 50, "measure": 200}
    return shakebed.simulate(scene).profile


def test_temperature_of_a_bed_in_equilibrium(curve):
    """T of the bath is 1; the answer's error is stated, four of them are allowed (chance 1 in 16,000)."""
    answer = shakebed.find_answer(curve.height, curve.number_density, curve.std_error, kernel=curve.kernel,
                                  column_number=100 / 12.3)
    assert answer["status"] == "ok"
    assert abs(answer["temperature"] - 1) < 4 * answer["std_error"] < 0.5


def test_a_length_without_a_diameter_says_what_is_missing(curve):
    fit = shakebed.fit_profile(curve.height, curve.number_density, curve.std_error, kernel=curve.kernel)
    with pytest.raises(AttributeError, match="needs the diameter"):
        fit.temperature_over_mg


def test_a_profile_brings_its_covariance_and_kernel(curve):
    columns = (curve.height, curve.number_density, curve.std_error)
    whole = dict(covariance=curve.covariance, covariance_samples=curve.covariance_samples, kernel=curve.kernel)
    fit = shakebed.fit_profile(curve, diameter="3 mm")
    assert fit.to_dict() == shakebed.fit_profile(*columns, **whole, diameter="3 mm").to_dict()
    assert fit.temperature != shakebed.fit_profile(*columns, kernel=curve.kernel).temperature  # errors alone
    assert shakebed.find_answer(curve) == shakebed.find_answer(*columns, **whole)
    assert f"T/(m g) = {1e3 * fit.temperature_over_mg.value:.4g}" in fit.brief() and fit.brief().endswith(" mm")
    with pytest.raises(shakebed.UsageError, match="error: a Profile has its own"):
        shakebed.fit_profile(curve, error=curve.std_error)
    with pytest.raises(shakebed.UsageError, match="density is missing"):
        shakebed.fit_profile(curve.height)


def test_a_profile_between_hard_walls_is_corrected_for_them(scene):
    """density_profile(sides="hard") and a simulated bed bring the width that find_answer needs."""
    bed = shakebed.simulate(scene)
    z = bed.trajectory().array[:, :, 1]
    unknown = shakebed.density_profile(z, bed.width)
    hard = shakebed.density_profile(z, bed.width, sides="hard")
    periodic = shakebed.density_profile(z, bed.width, sides="periodic")
    assert hard.width_between_walls == bed.profile.width_between_walls == bed.floor_frame_profile.width_between_walls
    assert hard.width_between_walls == pytest.approx(10.3)
    assert unknown.width_between_walls is periodic.width_between_walls is None
    corrected = shakebed.find_answer(unknown, width_between_walls=10.3)
    assert shakebed.find_answer(hard) == corrected
    uncorrected = shakebed.find_answer(unknown)
    assert uncorrected["status"] == corrected["status"] == "ok"
    assert corrected["temperature"] < uncorrected["temperature"]
    assert shakebed.find_answer(periodic) == shakebed.find_answer(hard, width_between_walls=0) == uncorrected
    seen = bed.observables
    assert bed.answer() == shakebed.find_answer(
        bed.profile, column_number=bed.column_number, temperature_x=seen["temperature_x"],
        temperature_z=seen["temperature_z"], diameter="3 mm", width_between_walls=bed.width)


def test_a_profile_between_periodic_sides_has_no_walls(curve):
    assert curve.width_between_walls is None


def test_fit_is_that_of_the_command_line(curve, tmp_path):
    rows = np.column_stack([curve.height, curve.number_density, curve.std_error])
    file = tmp_path / "profile.csv"
    file.write_text("height,number_density,std_error\n" + "".join(f"{a!r},{b!r},{c!r}\n" for a, b, c in rows.tolist()))
    done = shakebed_program("fit-profile", file, "--kernel", curve.kernel, "--diameter", "3 mm", "--json")
    printed = json.loads(done.stdout)
    fit = shakebed.fit_profile(*rows.T, kernel=curve.kernel, diameter="3 mm")
    # What the program says of the file itself comes after what the fit says.
    said = printed.pop("warnings")
    answer = printed.pop("answer")
    numbers = dict(fit.to_dict())
    assert numbers.pop("warnings") == said[: len(fit.warnings)]
    assert fit.ok and numbers == printed
    found = shakebed.find_answer(*rows.T, kernel=curve.kernel, diameter="3 mm")
    assert (answer["verdict"], answer["temperature"]["value"]) == (found["verdict"], found["temperature"])
    assert answer["temperature_over_mg"]["value"] == found["temperature_over_mg"] == found["temperature"] * 3e-3
    assert answer["temperature_over_mg"]["std_error"] == found["std_error_over_mg"] == found["std_error"] * 3e-3
    assert found["low_over_mg"] == answer["interval"]["low"]["value"] * 3e-3 < found["high_over_mg"]
    solid = answer["solid_height"] or {"value": 0, "std_error": 0}  # null where there is no solid
    assert (solid["value"], solid["std_error"]) == (found["solid_height"], found["solid_height_std_error"])
    assert fit.temperature_over_mg.value == pytest.approx(fit.temperature.value * 3e-3, rel=1e-12)
    assert "temperature" in fit._repr_html_() and fit.brief() in repr(fit)
    drawn = fit.curve()
    assert drawn["height"].shape == drawn["smoothed_density"].shape


def test_theory_is_that_of_the_command_line():
    done = shakebed_program("theory", "--plateau-density", 1.10, "--diameter", "2.99 mm", "--initial-height", 10.2,
                            "--temperature", "0.36 mm", "--json")
    assert shakebed.theory(plateau_density=1.10, diameter="2.99 mm", initial_height=10.2,
                           temperature="0.36 mm") == json.loads(done.stdout)


def test_map_is_that_of_the_command_line():
    done = shakebed_program("map", "--gamma", 4, "--frequency", "20 Hz", "--diameter", "2.99 mm", "--initial-height",
                            10.2, "--plateau-density", 1.10, "--json")
    assert shakebed.gamma_to_temperature(gamma=4, frequency="20 Hz", diameter="2.99 mm", initial_height=10.2,
                                         plateau_density=1.10) == json.loads(done.stdout)


def test_bad_data_are_a_status_and_bad_arguments_an_exception():
    fit = shakebed.fit_profile([0, 1, 2, 3], [0, 0, 0, 0])
    assert not fit.ok and fit.message
    assert not shakebed.fit_profile([0, 1, np.nan], [1, 1, 1]).ok
    with pytest.raises(ValueError, match="shape"):
        shakebed.fit_profile([0, 1], [1])
    with pytest.raises(ValueError, match="kernel"):
        shakebed.fit_profile([0, 1], [1, 1], kernel="box")
    with pytest.raises(TypeError, match="no option 'modle'"):
        shakebed.fit_profile([0, 1], [1, 1], modle="fermi")
    with pytest.raises(shakebed.UsageError, match="unknown unit|furlong"):
        shakebed.theory(diameter="3 furlongs")
    with pytest.raises(shakebed.UsageError):
        shakebed.theory(equation_of_state="ensog")
    with pytest.raises(shakebed.UsageError, match="one of the two"):
        shakebed.gamma_to_temperature(frequency=20, diameter=3e-3, initial_height=10)


def test_frames_may_have_different_numbers_of_disks():
    """Each frame counts once, however many disks it holds: one disk at 1 D, then three at 2 D, in bins of 1 D."""
    found = shakebed.density_profile([[1.0], [2.0, 2.0, 2.0]] * 20, 10, kernel="top_hat:1", spacing=1, highest=3)
    assert found.number_density == pytest.approx([0, 0.5 / 10, 1.5 / 10, 0])
    assert repr(found) == ("<shakebed.Profile: n D^2 at 4 heights, 0 to 3 D, of 40 frames, kernel top_hat:1>")
    with pytest.warns(shakebed.BedWarning, match="All frames are equal"):
        same = shakebed.density_profile(np.tile([[1.0, 2.0]], (40, 1)), 10, kernel="top_hat:1", spacing=1, highest=3)
    assert same.number_density == pytest.approx([0, 0.1, 0.1, 0])


def test_density_of_known_centres_adds_up(scene):
    """The area under the profile is N D/W, whatever the kernel."""
    z = shakebed.simulate(scene).trajectory().array[:, :, 1]
    for kernel in ("gaussian:0.5", "top_hat:1"):
        profile = shakebed.density_profile(z, 10.3, kernel=kernel, spacing=0.05, lowest=z.min() - 4, highest=z.max() + 4)
        assert profile.number_density.sum() * 0.05 == pytest.approx(60 / 10.3, rel=1e-3)
        assert profile.covariance.shape == 2 * profile.height.shape
        assert np.allclose(np.sqrt(np.diag(profile.covariance)), profile.std_error)
    with pytest.raises(shakebed.UsageError, match="frames, disks"):
        shakebed.density_profile(z[0], 10.3)
    for wrong, words in ((dict(sides="walls"), "sides is 'walls'; it must be \"hard\" or \"periodic\""),
                         (dict(width="30.9 mm"), "width is '30.9 mm'; it must be a number in D"),
                         (dict(spacing="1 mm"), "spacing is '1 mm'; it must be a number in D"),
                         (dict(highest="30 mm"), "highest is '30 mm'; it must be a number in D"),
                         (dict(width=[1, 2]), "width is .* it must be a number")):
        with pytest.raises(shakebed.UsageError, match=words):
            shakebed.density_profile(z, **{"width": 10.3, **wrong})
    with pytest.raises(shakebed.UsageError, match="no disk"):
        shakebed.density_profile([[], []], 10.3)
    with pytest.raises(shakebed.UsageError, match="finite"):
        shakebed.density_profile(np.full((3, 3), np.nan), 10.3)
