"""Beds that are simulated in memory."""

from __future__ import annotations

import json
import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, NamedTuple, Optional, Sequence, Union

import numpy as np

from . import _core
from .errors import BedWarning, RecipeError, UsageError, input_error, recipe_error
from .quantities import Progress, Quantity, as_json, number, reporter, table_html

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Scene = Union[Dict[str, Any], str, "os.PathLike[str]"]

_stage_pointer = "/stages/0"
_most_heights = 100_000  # of a profile


class Profile(NamedTuple):
    """A density profile.

    Attributes
    ----------
    height : ndarray, shape (heights,)
        Height above the mean position of the floor [D].
    number_density, std_error : ndarray, shape (heights,)
        n D^2 and its standard error [1/D^2]. The error includes correlation in time.
    covariance : ndarray, shape (heights, heights), or None
        Covariance of the densities [1/D^4].
    covariance_samples : int
        Number of independent samples from which the covariance was estimated.
    samples : int
        Number of snapshots or frames.
    kernel : str
        Kernel through which the density was measured, such as "gaussian:0.5" (width in D).
    width_between_walls : float or None
        Width of the bed from wall to wall [D], if hard side walls are known; else None. `find_answer` corrects for them.
    """

    height: Array
    number_density: Array
    std_error: Array
    covariance: Optional[Array]
    covariance_samples: int
    samples: int
    kernel: str
    width_between_walls: Optional[float] = None

    def __repr__(self) -> str:
        ends = f"{self.height[0]:.3g} to {self.height[-1]:.3g} D" if len(self.height) else "no heights"
        walls = "" if self.width_between_walls is None else f", {self.width_between_walls:.4g} D between hard walls"
        return (f"<shakebed.Profile: n D^2 at {len(self.height)} heights, {ends}, of {self.samples} frames, "
                f"kernel {self.kernel}{walls}>")


def profile_from(columns: dict[str, Any], width_between_walls: Optional[float] = None) -> Profile:
    """A Profile from the columns of the compiled module."""
    covariance = np.asarray(columns.get("covariance", ()), dtype=float)
    size = int(round(np.sqrt(covariance.size)))
    return Profile(
        columns["height"],
        columns["number_density"],
        columns["std_error"],
        covariance.reshape(size, size) if size == len(columns["height"]) and size > 0 else None,
        int(columns.get("covariance_samples", 0)),
        int(columns["samples"]),
        columns["kernel"],
        width_between_walls,
    )


class Trajectory(NamedTuple):
    """Frames of a bed. Lengths in D, times in sqrt(D/g), velocities in sqrt(g D).

    Attributes
    ----------
    array : ndarray, shape (frames, disks, 5)
        Columns x, z [D], vx, vz [sqrt(g D)], spin [sqrt(g/D)]. It is read-only; copy() gives an array of your own.
    time, phase, floor, floor_velocity : ndarray, shape (frames,)
        Time [sqrt(D/g)], phase within the period of the floor from 0 to 1, height [D] and velocity [sqrt(g D)] of the
        floor.
    """

    array: Array
    time: Array
    phase: Array
    floor: Array
    floor_velocity: Array

    @property
    def positions(self) -> Array:
        """Positions x and z [D], shape (frames, disks, 2)."""
        return self.array[:, :, 0:2]

    @property
    def velocities(self) -> Array:
        """Velocities vx and vz [sqrt(g D)], shape (frames, disks, 2)."""
        return self.array[:, :, 2:4]


def read_trajectory(path: Union[str, "os.PathLike[str]"], *, up: str = "z") -> Trajectory:
    """Read a trajectory in extended XYZ, plain or compressed (.zst), of this or another program.

    Parameters
    ----------
    path : str or path
        File with lengths in D. Columns that the file does not have, such as velocities, are 0.
    up : {"z", "y"}
        Coordinate of the height, if positions have three. Programs that simulate in a plane often use y.

    Returns
    -------
    Trajectory

    Raises
    ------
    InputError
        The file cannot be read, or all heights are 0.
    """
    if up not in ("y", "z"):
        raise UsageError(f"up is {up!r}; it must be \"z\" or \"y\"")
    file = os.fspath(path)
    trajectory = Trajectory(*_core.read_trajectory(file, up == "y"))
    if trajectory.array.size > 0 and not trajectory.array[:, :, 1].any():
        raise input_error(f"{file}: all heights (coordinate {up}) are 0; where y points upwards, pass up=\"y\"", file)
    return trajectory


def density_profile(
    heights: Any, width: float, *, kernel: str = "gaussian:0.5", spacing: float = 0.25,
    lowest: Optional[float] = None, highest: Optional[float] = None, sides: Optional[str] = None,
) -> Profile:
    """The density profile of disks whose centres are known.

    Parameters
    ----------
    heights : array_like, shape (frames, disks), or a sequence of one-dimensional arrays, one a frame
        Heights of the centres above the floor [D]; frames in the order of time. Frames of a sequence may have
        different numbers of disks.
    width : float
        Width of the bed from wall to wall, or the period [D].
    kernel : str
        Kernel of the density: "gaussian:0.5", "top_hat:1" or "disk_chord:1" (widths in D).
    spacing, lowest, highest : float
        Heights of the profile [D]. By default lowest is 0 and highest is 1 D above the highest disk.
    sides : {"hard", "periodic"}, optional
        Sides of the bed. Between hard walls the bed is thinner near them, and T seems too high. With ``sides="hard"``
        the profile keeps the width, and `find_answer` corrects for the walls. By default the sides are unknown, and
        nothing is corrected.

    Returns
    -------
    Profile
        Errors and covariance include the correlation between frames.

    Raises
    ------
    UsageError
        A shape or a value is invalid.
    """
    z, ends = _joined_frames(heights)
    if not np.isfinite(z).all():
        raise UsageError("heights contains numbers that are not finite")
    if sides not in (None, "hard", "periodic"):
        raise UsageError(f'sides is {sides!r}; it must be "hard" or "periodic", or be left out if unknown')
    width, spacing = _number_in_diameters(width, "width"), _number_in_diameters(spacing, "spacing")
    for name, value in (("width", width), ("spacing", spacing)):
        if not (value > 0 and np.isfinite(value)):
            raise UsageError(f"{name} is {value}; it must be above 0")
    low = 0.0 if lowest is None else _number_in_diameters(lowest, "lowest")
    high = float(z.max()) + 1 if highest is None else _number_in_diameters(highest, "highest")
    if not high > low:
        raise UsageError(f"highest is {high}; it must be above lowest, {low}")
    points = int(np.floor((high - low) / spacing)) + 1
    if points > _most_heights:
        raise UsageError(f"spacing is {spacing}, which gives {points} heights; at most {_most_heights} are possible: "
                         "give a larger spacing")
    if len(ends) > 1 and _frames_are_equal(z, ends):
        warnings.warn("All frames are equal, so the error of the density is unknown. The std_error of 0 is not an "
                      "estimate of it.", BedWarning, stacklevel=2)
    return profile_from(_core.density_profile(z, ends, width, kernel, low, spacing, points),
                        width if sides == "hard" else None)


def _number_in_diameters(value: Any, name: str) -> float:
    """A length in D that is a plain number, not a string."""
    if isinstance(value, str):
        raise UsageError(f"{name} is {value!r}; it must be a number in D: divide the length by the diameter of a disk")
    return number(value, name)


def _joined_frames(heights: Any) -> tuple[Array, Any]:
    """Heights of all frames, one after another, and of each frame the place behind its last."""
    frames = [np.asarray(frame, float) for frame in heights]
    wrong = [frame.shape for frame in frames if frame.ndim != 1]
    if wrong:
        raise UsageError(f"a frame of heights has shape {wrong[0]}; it must be (disks,), "
                         "and that of heights (frames, disks)")
    if not any(frame.size for frame in frames):
        raise UsageError(f"heights has {len(frames)} frames but no disks")
    return np.concatenate(frames), np.cumsum([frame.size for frame in frames])


def _frames_are_equal(z: Array, ends: Any) -> bool:
    frames = np.split(z, ends[:-1])
    return all(np.array_equal(np.sort(frames[0]), np.sort(frame)) for frame in frames[1:])


class _Document(NamedTuple):
    text: str
    file: str
    directory: str
    wrapped: bool  # the scene is one stage, not a recipe
    has_lines: bool


def _document(scene: Scene, seed: Optional[int]) -> _Document:
    """The recipe of a scene: a dict, JSON text or a file, of a stage or of a whole recipe."""
    file, directory, text = "scene", os.getcwd(), None
    if not isinstance(scene, (dict, str, os.PathLike)):
        raise UsageError(f"a scene must be a dict, JSON text or a file, not {type(scene).__name__}")
    if not isinstance(scene, dict):
        text = os.fspath(scene)
        if not text.lstrip().startswith("{"):
            path = Path(text)
            try:
                text = path.read_text(encoding="utf-8")
            except OSError as error:
                raise input_error(f"{path}: cannot be read: {error.strerror}", str(path)) from None
            file, directory = str(path), str(path.resolve().parent)
        try:
            content = json.loads(text)
        except ValueError:
            return _Document(text, file, directory, False, True)  # the reader says where
    else:
        content = scene
    if not isinstance(content, dict):
        raise UsageError("a scene must be a JSON object: the options of a stage \"simulate\", or a whole recipe")
    if "stages" in content and seed is None:
        return _Document(text if text is not None else as_json(content), file, directory, False, text is not None)
    if "stages" in content:
        stages = [dict(s, seed=seed) if s.get("stage") == "simulate" else s for s in content["stages"]]
        return _Document(as_json(dict(content, stages=stages)), file, directory, False, False)
    stage: dict[str, Any] = {"stage": "simulate", "id": "bed", "replicas": 1, **content}
    if seed is not None:
        stage["seed"] = seed
    recipe = {"name": "scene", "stages": [stage]}
    return _Document(as_json(recipe), file, directory, True, False)


def _at_user(problem: dict[str, Any], document: _Document) -> str:
    """A problem's sentence; its place becomes that in what the user passed."""
    if document.wrapped and problem["pointer"].startswith(_stage_pointer):
        problem["pointer"] = problem["pointer"][len(_stage_pointer):]
    if not document.has_lines or document.wrapped:
        problem["line"] = problem["column"] = 0
    return " ".join(p for p in (f"{problem['file']}: {problem['pointer']}: {problem['problem']}.", problem["suggestion"])
                    if p)


def _warned(problems: list[dict[str, Any]], document: _Document) -> list[str]:
    """The sentences of the scene's warnings, issued as BedWarning."""
    sentences = [_at_user(problem, document) for problem in problems]
    for sentence in sentences:
        warnings.warn(sentence, BedWarning, stacklevel=3)
    return sentences


def _at_scene(error: RecipeError, document: _Document) -> RecipeError:
    """The same mistakes at their places in what the user passed."""
    if document.has_lines and not document.wrapped:
        return error
    lines = [_at_user(problem, document) for problem in error.problems]
    found = recipe_error("\n".join(lines), error.problems, error.exit_code)
    return found  # type: ignore[return-value]


class Bed:
    """A bed that was simulated and measured.

    Units are D, m and g. Without gravity they are D, m and the initial T.
    """

    def __init__(self, bed: _core.Bed, warnings_of_scene: Sequence[str] = ()) -> None:
        self._bed = bed
        self._warnings = list(warnings_of_scene)

    @property
    def warnings(self) -> list[str]:
        """Warnings about the scene, as ``shakebed run`` gives them."""
        return self._warnings

    @property
    def profile(self) -> Profile:
        """Density against the height above the mean position of the floor."""
        return profile_from(self._bed.profile(False), self._width_between_walls)

    @property
    def floor_frame_profile(self) -> Profile:
        """Density against the height above the moving floor."""
        return profile_from(self._bed.profile(True), self._width_between_walls)

    @property
    def _width_between_walls(self) -> Optional[float]:
        return self.width if self._bed.hard_sides else None

    @property
    def observables(self) -> dict[str, Quantity]:
        """Numbers of the whole bed, with the names of observables.json."""
        energy = "T0" if self._bed.weightless else "m g D"
        units = {"center_of_mass": "D", "center_of_mass_rise": "D", "compressibility_factor": "1"}
        return {name: Quantity(*pair, units.get(name, energy)) for name, pair in self._bed.observables().items()}

    def answer(self) -> dict[str, Any]:
        """One temperature from all thermometers, as `find_answer` gives it.

        It follows from the profile, N D/W and the kinetic temperatures. A recipe also simulates a longer contact
        duration and adds its effect to the uncertainty.
        """
        from .fits import find_answer

        seen, in_metres = self.observables, self.length_unit != 1
        return find_answer(self.profile, column_number=self.column_number, temperature_x=seen.get("temperature_x"),
                           temperature_z=seen.get("temperature_z"), diameter=self.length_unit if in_metres else None)

    def trajectory(self) -> Trajectory:
        """The frames that the scene stores (option "frames"), not copied."""
        bed = self._bed
        return Trajectory(bed.trajectory(), bed.times(), bed.phases(), bed.floor(), bed.floor_velocities())

    @property
    def energy(self) -> dict[str, float]:
        """Energy balance [m g D].

        kinetic + potential + compressed + dissipated + step_error - floor_work - bath_work = initial.
        dissipated_on_plates is the part of dissipated that is due to friction with plates.
        """
        return self._bed.energy()

    @property
    def counters(self) -> dict[str, int]:
        """Collisions and events of the whole run."""
        return self._bed.counters()

    @property
    def largest_overlap(self) -> float:
        """Largest overlap of two disks at the end [D]."""
        return self._bed.largest_overlap

    @property
    def length_unit(self) -> float:
        """D in m (1 in a scene with reduced units)."""
        return self._bed.length_unit

    @property
    def time_unit(self) -> float:
        """sqrt(D/g) in s (1 in a scene with reduced units)."""
        return self._bed.time_unit

    @property
    def width(self) -> float:
        """Width of the box [D]."""
        return self._bed.width

    @property
    def column_number(self) -> float:
        """N D/W: disks per diameter of width."""
        return self._bed.column_number

    @property
    def gamma(self) -> float:
        """Peak acceleration of a sinusoidal floor over g; 0 for other floors."""
        return self._bed.gamma

    @property
    def periods(self) -> int:
        """Number of measured periods of the floor; on a still floor, number of samples."""
        return self._bed.periods

    @property
    def radius(self) -> Array:
        """Radius of each disk [D], shape (disks,)."""
        return self._bed.radius

    def brief(self) -> str:
        """The result in one line."""
        return self._bed.brief()

    def full(self) -> str:
        """The result with one line per number."""
        return self._bed.full()

    def __repr__(self) -> str:
        return f"<shakebed.Bed: {self.brief()}>"

    def _repr_html_(self) -> str:
        return table_html("simulated bed", self.observables, [self.brief(), *self.warnings])


def simulate(scene: Scene, *, seed: Optional[int] = None, progress: Progress = None) -> Bed:
    """Simulate a bed of hard disks, event by event, and measure it.

    Parameters
    ----------
    scene : dict, str or path
        Options of the stage "simulate" (see ``shakebed reference simulate``), or a whole recipe with one such stage: a
        dict, JSON text, or a file.
    seed : int, optional
        Seed of the random number generator, in place of that of the scene.
    progress : callable or True, optional
        Function that is called with the fraction done; True: a bar, if tqdm is installed.

    Returns
    -------
    Bed

    Raises
    ------
    RecipeError
        The scene has mistakes.
    StageError
        The simulation failed.
    KeyboardInterrupt
        After Ctrl-C, within about 0.1 s.

    Warns
    -----
    BedWarning
        The scene is unusual: Gamma below 1, a width that locks rows. ``shakebed run`` warns in the same cases.

    Notes
    -----
    One bed is measured. Its errors hold for this bed and not for the next one; `run` measures several beds. With
    ``"replicas": 1``, ``shakebed run`` gives the same numbers to the last digit. The GIL is released.
    """
    document = _document(scene, seed)
    call, close = reporter(progress, "simulating")
    try:
        bed = _core.simulate(document.text, document.file, document.directory, call)
    except RecipeError as error:
        raise _at_scene(error, document) from None
    finally:
        close()
    return Bed(bed, _warned(bed.warnings, document))


class Simulation:
    """A bed that is simulated step by step.

    Parameters
    ----------
    scene : dict, str or path
        As for `simulate`. The options "settle" and "measure" are not used.
    seed : int, optional
        Seed of the random number generator, in place of that of the scene.

    Notes
    -----
    Lengths in D, times in sqrt(D/g), velocities in sqrt(g D), energies in m g D. One thread at a time may use it.

    Examples
    --------
    >>> bed = shakebed.Simulation(scene)
    >>> bed.step(10)
    >>> bed.positions.shape
    (100, 2)
    """

    def __init__(self, scene: Scene, *, seed: Optional[int] = None) -> None:
        document = _document(scene, seed)
        try:
            self._stepper = _core.Stepper(document.text, document.file, document.directory)
        except RecipeError as error:
            raise _at_scene(error, document) from None
        self.warnings = _warned(self._stepper.warnings, document)

    def advance_to(self, time: float) -> None:
        """Run to this time since the start [sqrt(D/g)]. The GIL is released, and Ctrl-C stops the run."""
        self._stepper.advance_to(float(time))

    def step(self, duration: float) -> None:
        """Run for this duration [sqrt(D/g)]."""
        self.advance_to(self.time + duration)

    @property
    def time(self) -> float:
        """Time since the start [sqrt(D/g)]."""
        return self._stepper.time

    @property
    def length_unit(self) -> float:
        """D in m (1 in a scene with reduced units)."""
        return self._stepper.length_unit

    @property
    def time_unit(self) -> float:
        """sqrt(D/g) in s (1 in a scene with reduced units)."""
        return self._stepper.time_unit

    @property
    def width(self) -> float:
        """Width of the box [D]."""
        return self._stepper.width

    @property
    def radius(self) -> Array:
        """Radius of each disk [D], shape (disks,)."""
        return self._stepper.radius

    def snapshot(self) -> dict[str, Any]:
        """State of the bed now.

        Returns
        -------
        dict
            time [sqrt(D/g)], floor_position [D], floor_velocity [sqrt(g D)], and the arrays x, z [D], vx, vz
            [sqrt(g D)], spin [sqrt(g/D)] of shape (disks,).
        """
        return self._stepper.snapshot()

    @property
    def positions(self) -> Array:
        """Positions x and z [D], shape (disks, 2)."""
        now = self.snapshot()
        return np.column_stack([now["x"], now["z"]])

    @property
    def velocities(self) -> Array:
        """Velocities vx and vz [sqrt(g D)], shape (disks, 2)."""
        now = self.snapshot()
        return np.column_stack([now["vx"], now["vz"]])

    @property
    def energy(self) -> dict[str, float]:
        """Energy balance [m g D].

        kinetic + potential + compressed + dissipated + step_error - floor_work - bath_work = initial.
        dissipated_on_plates is the part of dissipated that is due to friction with plates.
        """
        return self._stepper.energy()

    @property
    def counters(self) -> dict[str, int]:
        """Collisions and events since the start."""
        return self._stepper.counters()

    @property
    def largest_overlap(self) -> float:
        """Largest overlap of two disks now [D]."""
        return self._stepper.largest_overlap()

    def set_bath_temperature(self, temperature: float) -> None:
        """Set the temperature of the bath from now on [m g D]. ValueError if the scene has no bath."""
        self._stepper.set_bath_temperature(float(temperature))

    def __repr__(self) -> str:
        return f"<shakebed.Simulation: {len(self.radius)} disks at time {self.time:.6g}>"
