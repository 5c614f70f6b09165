"""Disks and beds in photographs. OpenCV is loaded when one of these functions is first called."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Sequence, Union

import numpy as np

from . import _core
from .errors import StageError, UsageError, check_options
from .fits import with_lengths
from .quantities import Number, Progress, in_si, reporter, table_html
from .scenes import Profile, profile_from

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from . import _images

    Array = NDArray[np.float64]

_find_options = frozenset({"polarity", "radius", "roi", "keep_half_hidden"})
_measure_options = _find_options | {"scale", "floor", "floor_slope", "floor_amplitude", "left_wall", "right_wall", "pixel_aspect",
                                    "lens_radial", "spacing", "lowest", "highest", "frame_rate", "frequency", "kernel"}


def _checked(options: dict[str, Any], known: frozenset[str], function: str) -> dict[str, Any]:
    check_options(function, options, known)
    return {name: value for name, value in options.items() if value is not None}


class Disks:
    """Disks found in one image.

    Coordinates are in pixels. The centre of the top-left pixel is (0, 0), x points to the right and y downwards.
    """

    def __init__(self, found: _images.Disks) -> None:
        self._found = found
        self._columns = found.columns()

    @property
    def x(self) -> Array:
        """Horizontal positions of the centres [px], shape (disks,)."""
        return self._columns["x"]

    @property
    def y(self) -> Array:
        """Vertical positions of the centres [px], downwards, shape (disks,)."""
        return self._columns["y"]

    @property
    def std_error(self) -> Array:
        """Standard errors of the centres along x and y [px], shape (disks, 2)."""
        return np.sqrt(np.column_stack([self._columns["variance_x"], self._columns["variance_y"]]))

    @property
    def quality(self) -> Array:
        """Quality from 0 to 1, shape (disks,); 1: a bead that looks like all the others."""
        return self._columns["quality"]

    @property
    def probability(self) -> Array:
        """Probability that the disk is a bead, shape (disks,)."""
        return self._columns["probability"]

    @property
    def radius(self) -> float:
        """Radius of a bead [px]."""
        return self._found.radius

    @property
    def radius_std_error(self) -> float:
        """Standard error of the radius [px]."""
        return self._found.radius_std_error

    @property
    def bright(self) -> bool:
        """Whether the beads are brighter than their background."""
        return self._found.bright

    @property
    def expected_wrong(self) -> float:
        """Expected share of the disks found that are not beads."""
        return self._found.expected_wrong

    @property
    def warnings(self) -> list[str]:
        """Warnings, one sentence or more each."""
        return self._found.warnings

    @property
    def message(self) -> str:
        """Reason why no disks were found; else empty."""
        return self._found.message

    def __len__(self) -> int:
        return len(self.x)

    def brief(self) -> str:
        """The result in one line."""
        return self._found.brief()

    def full(self) -> str:
        """The result with one line per number, then the warnings."""
        return self._found.full()

    def __repr__(self) -> str:
        return f"<shakebed.Disks: {self.brief()}>"

    def _repr_html_(self) -> str:
        rows = {"disks": len(self), "radius": f"{self.radius:.3f} +- {self.radius_std_error:.2g} px",
                "expected wrong": f"{100 * self.expected_wrong:.2g} %"} if len(self) else {}
        return table_html("disks in an image", rows, self.warnings if len(self) else [self.message])


def find_disks(image: NDArray[Any], **options: Any) -> Disks:
    """Find the disks of one image. No option is required.

    Parameters
    ----------
    image : ndarray, shape (rows, columns)
        Grey levels: uint8, uint16, float32 or float64 (0 to 255). It is read in place, not copied first.
    **options
        polarity : {"dark", "bright"}
            Whether beads are darker or brighter than the background; default: found in the image.
        radius : float
            Radius of a bead, within 25 % [px]; default: found in the image.
        roi : (int, int, int, int)
            Region of interest: left, top, width, height [px].
        keep_half_hidden : bool
            Whether beads that are partly covered are reported.

    Returns
    -------
    Disks
        If there are no beads, it has length 0 and a `message`.

    Raises
    ------
    UsageError
        The image or an option has the wrong type or shape.
    """
    wanted = _checked(options, _find_options, "find_disks")
    from . import _images

    levels = image if isinstance(image, np.ndarray) else np.asarray(image)
    found = _images.find_disks(levels, wanted)
    if found.status == "bad input":
        raise UsageError(found.message)
    if not found.ok:
        _refuse_unit_range([levels])
    return Disks(found)


def _refuse_unit_range(images: Sequence[NDArray[Any]]) -> None:
    """Raise UsageError for floating-point images with levels from 0 to 1, as other packages have them."""
    if all(image.dtype.kind == "f" and image.max() <= 1 for image in images):
        raise UsageError("levels of floating-point images must run from 0 to 255, but the highest level is not above 1: "
                         "multiply the image by 255")


class MeasuredBed:
    """A bed measured in photographs."""

    def __init__(self, bed: _images.Bed, diameter: float) -> None:
        self._bed, self._diameter = bed, diameter

    @property
    def profile(self) -> Profile:
        """Density [1/D^2] against the height above the floor [D]."""
        return profile_from(self._bed.profile(), self.width if self._bed.walls_seen else None)

    def answer(self) -> dict[str, Any]:
        """One temperature from all thermometers, as `find_answer` gives it.

        It follows from the profile and the mean number of disks. Reasons against it in the photographs, such as a floor
        that is not visible, are taken into account.
        """
        profile = self.profile
        answer = _core.find_answer(profile.height, profile.number_density, profile.std_error, profile.covariance,
                                   profile.covariance_samples, profile.kernel, self._bed.column_number, None, None,
                                   self._bed.objections(), self._diameter,
                                   self.floor_std_error * self.scale / self._diameter, self._bed.shaken,
                                   profile.width_between_walls or 0.0, self._bed.scale_error)
        return with_lengths(answer, self._diameter)

    @property
    def disks(self) -> dict[str, NDArray[Any]]:
        """Columns of disks.csv, each of shape (disks,): frame, x_px, y_px, radius_px [px], x, z [D], quality."""
        columns: dict[str, NDArray[Any]] = dict(self._bed.disks())
        columns["frame"] = columns["frame"].astype(np.int64)
        return columns

    @property
    def scale(self) -> float:
        """Length of a pixel [m/px]."""
        return self._bed.scale

    @property
    def width(self) -> float:
        """Distance between the walls [D]."""
        return self._bed.width

    @property
    def radius(self) -> float:
        """Radius of a bead [px]."""
        return self._bed.radius

    @property
    def floor(self) -> float:
        """Row of the floor [px], at the left edge of the frame."""
        return self._bed.floor

    @property
    def floor_std_error(self) -> float:
        """Standard error of the floor's mean position [px]; 0 if the floor was given."""
        return self._bed.floor_std_error

    @property
    def floor_reference(self) -> str:
        """Position of the floor from which heights are measured: "given", "mean of its motion", "mean by its
        amplitude" or "lowest seen"."""
        return self._bed.floor_reference

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self._bed.frames

    @property
    def disks_a_frame(self) -> float:
        """Mean number of disks per frame."""
        return self._bed.disks_a_frame

    @property
    def warnings(self) -> list[str]:
        """Warnings, one sentence or more each."""
        return self._bed.warnings

    def brief(self) -> str:
        """The result in one line."""
        return self._bed.brief()

    def full(self) -> str:
        """The result with one line per number, then the warnings."""
        return self._bed.full()

    def __repr__(self) -> str:
        return f"<shakebed.MeasuredBed: {self.brief()}>"

    def _repr_html_(self) -> str:
        rows = {"frames": self.frames, "disks a frame": f"{self.disks_a_frame:.2f}", "radius": f"{self.radius:.3f} px",
                "width": f"{self.width:.3f} D", "scale": f"{1e3 * self.scale:.6g} mm/px"}
        return table_html("bed in photographs", rows, self.warnings)


Frames = Union[str, "os.PathLike[str]", Sequence[Any], "NDArray[Any]"]


def _listed(frames: Any) -> Any:
    if isinstance(frames, np.ndarray) and frames.ndim == 2:
        raise UsageError("frames is one image; pass [image], or an array (frames, rows, columns)")
    try:
        return frames if hasattr(frames, "__len__") else list(frames)
    except TypeError:
        raise UsageError(f"frames is {frames!r}; it must be files or images") from None


def measure_bed(
    frames: Frames, diameter: Union[str, Number], *, threads: int = 1, progress: Progress = None, **options: Any
) -> MeasuredBed:
    """Measure the density profile of a bed in photographs or a film.

    Parameters
    ----------
    frames : str, path, sequence of them, ndarray (frames, rows, columns), or sequence of ndarray (rows, columns)
        Files, folders, wildcards or one film; or grey images in memory.
    diameter : str or float
        Diameter of a bead: "2.99 mm", or a number in m.
    threads : int
        Number of threads. The result does not depend on it.
    progress : callable or True, optional
        Function that is called with the fraction done; True: a bar, if tqdm is installed.
    **options
        polarity, radius, roi, keep_half_hidden
            As for `find_disks`.
        scale : float
            Length of a pixel [m/px].
        floor, left_wall, right_wall : float
            Row of the floor and columns of the walls [px].
        floor_amplitude : float
            Amplitude of the shaken floor [m]. If no film shows the motion of the floor, its mean position is
            estimated as half the amplitude above the lowest position seen, with an error of the same size.
        floor_slope : float
            Slope of the floor, in pixels down per pixel to the right.
        pixel_aspect : float
            Ratio of the width of a pixel to its height. If left out, it is found from the rims of the beads, up to
            8 % from what a film states, else from 1.
        lens_radial : float
            Distortion of the lens: outward shift of the corners, in half diagonals.
        kernel : str
            Kernel of the density, "gaussian:0.5" by default (width in D).
        spacing, lowest, highest : float
            Heights of the profile [D].
        frame_rate, frequency : float
            Frame rate of the film and frequency of the shaking [Hz].

        Scale, floor, walls, slope, aspect, lens and frequency are found if they are left out.

    Returns
    -------
    MeasuredBed

    Raises
    ------
    InputError
        A file cannot be read.
    StageError
        There are no beads.
    UsageError
        An argument has the wrong type or shape.
    """
    wanted = _checked(options, _measure_options, "measure_bed")
    length = in_si(diameter, "length", "diameter")
    if length > 0 and (impossible := _core.impossible_bead(length)):
        raise UsageError(f"diameter: {impossible}")
    wanted.update(diameter=length, threads=threads)
    from . import _images

    call, close = reporter(progress, "finding disks")
    try:
        if not isinstance(frames, (str, os.PathLike)):
            frames = _listed(frames)
        if isinstance(frames, (str, os.PathLike)):
            bed = _images.measure_files([os.fspath(frames)], wanted, call)
        elif len(frames) > 0 and isinstance(frames[0], (str, os.PathLike)):
            bed = _images.measure_files([os.fspath(f) for f in frames], wanted, call)
        else:
            frames = [f if isinstance(f, np.ndarray) else np.asarray(f) for f in frames]
            bed = _images.measure_arrays(frames, wanted, call)
            if bed.status == "no beads":
                _refuse_unit_range(frames)
    finally:
        close()
    if bed.status == "bad input":
        raise UsageError(bed.message)
    if not bed.ok:
        raise StageError(bed.message)
    return MeasuredBed(bed, wanted["diameter"])
