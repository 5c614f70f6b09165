"""Temperature from a density profile, and the theory behind it."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from . import _core
from .errors import UsageError, check_options
from .quantities import Number, Quantity, in_diameters, in_si, number, table_html
from .scenes import Profile

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: 2/sqrt(3): number density n D^2 of close packing.
close_packing_density = 2 / math.sqrt(3)


class Fit:
    """The result of `fit_profile`.

    Temperatures are in m g D, lengths in D and densities in 1/D^2. A number that the fit does not give raises
    AttributeError.
    """

    def __init__(self, fit: _core.Fit) -> None:
        self._fit = fit

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        return self._fit.to_dict()

    @property
    def status(self) -> str:
        """"ok", or why there is no result."""
        return self._fit.status

    @property
    def ok(self) -> bool:
        """Whether the fit has a result."""
        return self._fit.ok

    @property
    def message(self) -> str:
        """Reason, if there is no result; else empty."""
        return self._fit.message

    @property
    def warnings(self) -> list[str]:
        """Warnings of the fit, one sentence or more each."""
        return self._fit.warnings

    def _quantity(self, name: str) -> Quantity:
        entry = self._numbers.get(name)
        if entry is None:
            raise AttributeError(f"the fit has no {name}: {self._why_missing(name)}")
        return Quantity(entry["value"], entry.get("std_error"), entry.get("unit", "1"))

    def _why_missing(self, name: str) -> str:
        if not self.ok:
            return self.message or self.status
        if name.endswith("_over_mg"):
            return 'a length needs the diameter of a disk; call fit_profile with diameter="2.99 mm"'
        if name == "critical_temperature":
            return "T_c needs N D/W; call fit_profile with column_number"
        return self.status

    @property
    def temperature(self) -> Quantity:
        """T in m g D."""
        return self._quantity("temperature")

    @property
    def temperature_over_mg(self) -> Quantity:
        """T/(m g) in m. It needs a diameter."""
        return self._quantity("temperature_over_mg")

    @property
    def solid_height(self) -> Quantity:
        """Height zeta_F of the solid, in D."""
        return self._quantity("solid_height")

    @property
    def plateau_density(self) -> Quantity:
        """Density phi_0 of the solid, in 1/D^2."""
        return self._quantity("plateau_density")

    @property
    def shift(self) -> Quantity:
        """Height at which the fluid part of the model begins, in D."""
        return self._quantity("shift")

    @property
    def critical_temperature(self) -> Quantity:
        """Critical temperature T_c, in m g D. It needs N D/W."""
        return self._quantity("critical_temperature")

    @property
    def chi2_per_dof(self) -> float:
        """Chi-square per degree of freedom."""
        return float(self._numbers["chi2_per_dof"])

    def curve(self) -> dict[str, Array]:
        """The fitted model.

        Returns
        -------
        dict of ndarray, shape (points,)
            height (D), density (1/D^2) and smoothed_density (1/D^2): the model before and after smoothing with the
            kernel. The second is compared with the data.
        """
        return self._fit.curve()

    def to_dict(self) -> dict[str, Any]:
        """All numbers of fit.json."""
        return self._numbers

    def brief(self) -> str:
        """The result in one line, with T/(m g) in mm if the diameter was given."""
        length = self._numbers.get("temperature_over_mg") if self.ok else None
        if length is None:
            return self._fit.brief()
        error = f" +- {1e3 * length['std_error']:.2g}" if "std_error" in length else ""
        return f"{self._fit.brief()}; T/(m g) = {1e3 * length['value']:.4g}{error} mm"

    def full(self) -> str:
        """The result with one line per number, then the warnings."""
        return self._fit.full()

    def __repr__(self) -> str:
        return f"<shakebed.Fit: {self.brief()}>"

    def _repr_html_(self) -> str:
        if not self.ok:
            return table_html("fit", {"status": self.status}, [self.message])
        names = ("temperature", "solid_height", "plateau_density", "shift", "critical_temperature")
        rows: dict[str, Any] = {name: self._quantity(name) for name in names if self._numbers.get(name)}
        rows["chi2/dof"] = f"{self.chi2_per_dof:.3g}"
        return table_html(f"fit: {self._numbers.get('model', '')}", rows, self.warnings)


_fit_options = frozenset({
    "base", "column_number", "compare", "confidence", "constrain_column", "fixed_shift", "fixed_temperature", "interval",
    "model", "model_error", "plateau_density", "plateau_density_free", "robust", "sweep", "window"})


def _data(
    height: Any, density: Any, error: Any, covariance: Any, covariance_samples: int, kernel: Optional[str]
) -> tuple[Any, Any, Any, Any, int, str]:
    """What the compiled module takes, from a Profile or from arrays."""
    if isinstance(height, Profile):
        given = {"density": density, "error": error, "covariance": covariance,
                 "covariance_samples": covariance_samples or None, "kernel": kernel}
        twice = [name for name, value in given.items() if value is not None]
        if twice:
            raise UsageError(f"{', '.join(twice)}: a Profile has its own; pass the profile alone, or arrays")
        profile = height
        return (profile.height, profile.number_density, profile.std_error, profile.covariance,
                profile.covariance_samples, profile.kernel)
    if density is None:
        raise UsageError("density is missing: pass height and density, or a Profile")
    return height, density, error, covariance, int(covariance_samples), kernel or "none"


def fit_profile(
    height: Any,
    density: Any = None,
    error: Any = None,
    *,
    covariance: Any = None,
    covariance_samples: int = 0,
    kernel: Optional[str] = None,
    diameter: Union[None, str, Number] = None,
    **options: Any,
) -> Fit:
    """Fit a density profile: temperature, solid height, plateau density.

    Parameters
    ----------
    height, density : array_like, shape (heights,)
        Heights above the mean position of the floor [D] and number densities n D^2 [1/D^2]. Or one `Profile` in place
        of all columns: its errors, covariance and kernel are used.
    error : array_like, shape (heights,), or float, optional
        Standard errors of the densities [1/D^2]. One number stands for all heights.
    covariance : array_like, shape (heights, heights), optional
        Covariance of the densities [1/D^4], in place of `error`.
    covariance_samples : int
        Number of independent samples from which the covariance was estimated; 0: unknown.
    kernel : str
        Kernel through which the density was measured: "none" (default), "gaussian:0.5", "top_hat:1" or "disk_chord:1"
        (widths in D).
    diameter : str or float, optional
        Diameter D of a disk ("2.99 mm", or a number in m), for T/(m g) as a length.
    **options
        Options of the stage fit:

        model : str
            "enskog-rectangle" (default), "hydrostatic:<equation of state>", "fermi" or "rectangle".
        plateau_density : float
            Density phi_0 of the solid [1/D^2]; 2/sqrt(3) by default.
        plateau_density_free : bool
            Whether phi_0 is fitted.
        column_number : float
            N D/W, for T_c.
        constrain_column : bool
            Whether the shift follows from T and column_number.
        fixed_temperature, fixed_shift : float
            Fixed values of T [m g D] and of the shift [D].
        window : (float, float)
            Lowest and highest height of the fit [D]; None: the rule chooses this end.
        base : float
            Height of the lower edge of the bed [D].
        robust : bool
            Whether outliers count linearly (Huber's loss).
        model_error : bool
            Whether the misfit of the model is added to the errors.
        interval : bool
            Whether an interval of T is computed.
        sweep, compare : bool
            Whether other windows and other models are fitted too.
        confidence : float
            Confidence level of the intervals, 0.95 by default.

    Returns
    -------
    Fit
        Its `status` and `message` say what is wrong with the data. Bad data raise no exception.

    Raises
    ------
    UsageError
        An argument has the wrong type or shape.
    """
    check_options("fit_profile", options, _fit_options)
    length = None if diameter is None else in_si(diameter, "length", "diameter")
    z, n, errors, matrix, samples, measured_through = _data(height, density, error, covariance, covariance_samples, kernel)
    return Fit(_core.fit_profile(z, n, errors, matrix, samples, options | {"kernel": measured_through}, length))


def _estimate(given: Any, name: str) -> Optional[tuple[float, float]]:
    if given is None:
        return None
    try:
        value, error = (given, 0.0) if np.ndim(given) == 0 else (given[0], given[1])
        return float(value), float(error or 0.0)
    except (TypeError, ValueError, IndexError):
        raise UsageError(f"{name} is {given!r}; it must be a Quantity, (value, standard error), or a number") from None


def find_answer(
    height: Any,
    density: Any = None,
    error: Any = None,
    *,
    covariance: Any = None,
    covariance_samples: int = 0,
    kernel: Optional[str] = None,
    column_number: Optional[float] = None,
    temperature_x: Union[None, Quantity, tuple[float, float], Number] = None,
    temperature_z: Union[None, Quantity, tuple[float, float], Number] = None,
    diameter: Union[None, str, Number] = None,
    width_between_walls: Optional[float] = None,
) -> dict[str, Any]:
    """One temperature from all thermometers, with its whole uncertainty and a verdict (see docs/thermometer.md).

    Parameters
    ----------
    height, density, error, covariance, covariance_samples, kernel
        As for `fit_profile`.
    column_number : float, optional
        N D/W. It makes the answer more precise.
    temperature_x, temperature_z : Quantity, (float, float) or float, optional
        Kinetic temperatures [m g D], if velocities are known: a value, or a value with its standard error.
    diameter : str or float, optional
        Diameter D of a disk ("2.99 mm", or a number in m). With it T/(m g) is given as a length.
    width_between_walls : float, optional
        Width of a bed between hard side walls [D]. Near the walls the density is lower. The answer corrects for
        this, and its error includes the remaining uncertainty. Default: the width of the `Profile`, if its walls are known;
        0: no correction.

    Returns
    -------
    dict
        verdict, why, advice, status, thermometer, model : str
        temperature, std_error, low, high : float or None
            T, its standard error and its interval [m g D].
        temperature_over_mg, std_error_over_mg, low_over_mg, high_over_mg : float or None
            The same as T/(m g) [m], if the diameter is known.
        solid_height, solid_height_std_error : float or None
            Height of the solid and its standard error [D].

        The numbers are None if the status is not "ok". Then why and advice give the reason.
        `Bed.answer` and `MeasuredBed.answer` pass all that is known of a bed.
    """
    length = None if diameter is None else in_si(diameter, "length", "diameter")
    if width_between_walls is None and isinstance(height, Profile):
        width_between_walls = height.width_between_walls
    answer = _core.find_answer(*_data(height, density, error, covariance, covariance_samples, kernel),
                               None if column_number is None else number(column_number, "column_number"),
                               _estimate(temperature_x, "temperature_x"), _estimate(temperature_z, "temperature_z"), [],
                               length, 0.0, False, 0.0 if width_between_walls is None else number(width_between_walls,
                                                                                                 "width_between_walls"),
                               0.0)
    return with_lengths(answer, length)


def with_lengths(answer: dict[str, Any], diameter: Optional[float]) -> dict[str, Any]:
    """The answer, and its temperatures as T/(m g) [m] if the diameter [m] is known."""
    if diameter is not None:
        for name in ("temperature", "std_error", "low", "high"):
            answer[name + "_over_mg"] = None if answer[name] is None else answer[name] * diameter
    return answer


def _checked_plateau(plateau_density: Any) -> float:
    density = number(plateau_density, "plateau_density")
    if not 0 < density <= close_packing_density * (1 + 1e-12):
        raise UsageError(f"plateau_density is {density}; it must be above 0 and at most 2/sqrt 3")
    return density


def theory(
    *,
    plateau_density: float = close_packing_density,
    equation_of_state: str = "enskog",
    diameter: Union[None, str, Number] = None,
    initial_height: Union[None, str, Number] = None,
    column_number: Optional[float] = None,
    temperature: Union[None, str, Number] = None,
) -> Any:
    """Constants of the theory: mu_0, lambda_1, k, T_c, and with a temperature T/T_c and the solid height [QuinnHong2000].

    Parameters
    ----------
    plateau_density : float
        Density phi_0 of the solid [1/D^2].
    equation_of_state : str
        enskog, henderson, santos-lopez-yuste, percus-yevick, kolafa-rottner, luding, best-of, or all.
    diameter : str or float, optional
        Diameter D of a disk ("2.99 mm", or a number in m), for lengths.
    initial_height : str or float, optional
        Height mu of the bed at rest: a length with its unit, or a number in D.
    column_number : float, optional
        N D/W, in place of initial_height.
    temperature : str or float, optional
        T/(m g) as a length with its unit, or T in m g D.

    Returns
    -------
    dict
        The object that ``shakebed theory --json`` prints.

    Raises
    ------
    UsageError
        A value is outside its range, or T is given without the height of the bed.
    """
    plateau_density = _checked_plateau(plateau_density)
    length = None if diameter is None else in_si(diameter, "length", "diameter")
    if initial_height is not None and column_number is not None:
        raise UsageError("initial_height and column_number are equivalent: give one")
    height = None if initial_height is None else in_diameters(initial_height, length, "initial_height")
    if column_number is not None:
        height = number(column_number, "column_number") / plateau_density
    t = None if temperature is None else in_diameters(temperature, length, "temperature")
    for name, value in (("initial_height", height), ("temperature", t)):
        if value is not None and not value > 0:
            raise UsageError(f"{name} is {value}; it must be above 0")
    if t is not None and height is None:
        raise UsageError("temperature: T/T_c also needs initial_height or column_number")
    return _core.theory(equation_of_state, plateau_density, length, height, t)


def gamma_to_temperature(
    *,
    frequency: Union[str, Number],
    diameter: Union[str, Number],
    initial_height: Union[str, Number],
    gamma: Optional[float] = None,
    amplitude: Union[None, str, Number] = None,
    plateau_density: float = close_packing_density,
    gravity: Union[str, Number] = 9.81,
    restitution: float = 0.0,
    equation_of_state: str = "enskog",
) -> dict[str, Any]:
    """T from Gamma by every formula that the paper allows [QuinnHong2000].

    Parameters
    ----------
    gamma : float
        Peak acceleration of the floor over g.
    amplitude : str or float
        Amplitude of the floor with its unit, or in m, in place of gamma.
    frequency, diameter, gravity : str or float
        Strings with a unit, or numbers in Hz, m and m/s^2.
    initial_height : str or float
        Height mu of the bed at rest: a length with its unit, or a number in D.
    restitution : float
        Coefficient of restitution of the single ball; 0: one flight without rebound.
    plateau_density : float
        Density phi_0 of the solid [1/D^2].
    equation_of_state : str
        As for `theory`.

    Returns
    -------
    dict
        The object that ``shakebed map --json`` prints. "readings" is a list with one entry per formula: name,
        jump_height, temperature, in_range and others.
    """
    f = in_si(frequency, "frequency", "frequency")
    g = in_si(gravity, "acceleration", "gravity")
    length = in_si(diameter, "length", "diameter")
    height = in_diameters(initial_height, length, "initial_height")
    if gamma is not None and amplitude is not None:
        raise UsageError("give gamma or amplitude, one of the two")
    if gamma is None:
        if amplitude is None:
            raise UsageError("give gamma or amplitude, one of the two")
        gamma = in_si(amplitude, "length", "amplitude") * (2 * math.pi * f) * (2 * math.pi * f) / g
    gamma, restitution = number(gamma, "gamma"), number(restitution, "restitution")
    plateau_density = _checked_plateau(plateau_density)
    values = {"frequency": f, "gravity": g, "diameter": length, "initial_height": height, "gamma": gamma}
    for name, value in values.items():
        if not (value > 0 and math.isfinite(value)):
            raise UsageError(f"{name} is {value}; it must be above 0")
    if not 0 <= restitution <= 0.99:
        raise UsageError(f"restitution is {restitution}; it must be from 0 to 0.99")
    return _core.gamma_to_temperature(gamma, f, g, length, height, plateau_density, restitution, equation_of_state)
