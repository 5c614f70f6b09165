"""Temperature from a density profile, and the theory behind it."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from . import _core
from .errors import UsageError, check_options
from .quantities import Number, Quantity, in_diameters, in_si, number, table_html

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: 2/sqrt(3): number density n D^2 of close packing.
close_packing_density = 2 / math.sqrt(3)


class Fit:
    """The result of `fit_profile`. Temperatures in m g D, lengths in D."""

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
        return self._fit.ok

    @property
    def message(self) -> str:
        """One sentence, when not ok."""
        return self._fit.message

    @property
    def warnings(self) -> list[str]:
        return self._fit.warnings

    def _quantity(self, name: str) -> Quantity:
        entry = self._numbers.get(name)
        if entry is None:
            raise AttributeError(f"the fit has no {name}: {self.status}")
        return Quantity(entry["value"], entry.get("std_error"), entry.get("unit", "1"))

    @property
    def temperature(self) -> Quantity:
        """T in m g D."""
        return self._quantity("temperature")

    @property
    def temperature_over_mg(self) -> Quantity:
        """T/(m g) in m; only with a diameter."""
        return self._quantity("temperature_over_mg")

    @property
    def solid_height(self) -> Quantity:
        """zeta_F in D."""
        return self._quantity("solid_height")

    @property
    def plateau_density(self) -> Quantity:
        """phi_0 in 1/D^2."""
        return self._quantity("plateau_density")

    @property
    def shift(self) -> Quantity:
        """Height where the tail reaches phi_0, in D."""
        return self._quantity("shift")

    @property
    def critical_temperature(self) -> Quantity:
        """T_c in m g D."""
        return self._quantity("critical_temperature")

    @property
    def chi2_per_dof(self) -> float:
        return float(self._numbers["chi2_per_dof"])

    def curve(self) -> dict[str, Array]:
        """height, density (the bare model) and smoothed_density (what is compared with the data)."""
        return self._fit.curve()

    def to_dict(self) -> dict[str, Any]:
        """All of fit.json."""
        return self._numbers

    def brief(self) -> str:
        """The result in one line."""
        return self._fit.brief()

    def full(self) -> str:
        """The result, a line a number, then the warnings."""
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


def fit_profile(
    height: Any,
    density: Any,
    error: Any = None,
    *,
    covariance: Any = None,
    covariance_samples: int = 0,
    kernel: str = "none",
    diameter: Union[None, str, Number] = None,
    **options: Any,
) -> Fit:
    """Fit a density profile: temperature, solid height, plateau density.

    Parameters
    ----------
    height, density : array_like, shape (heights,)
        Heights in D above the mean position of the floor, and n D^2.
    error : array_like, shape (heights,), or float, optional
        Standard errors of the densities; one number: of all.
    covariance : array_like, shape (heights, heights), optional
        Of the densities, in place of `error`.
    covariance_samples : int
        Independent samples behind the covariance; 0: not known.
    kernel : str
        The window through which the density was measured: "none", "gaussian:0.5", "top_hat:1", "disk_chord:1" (widths
        in D).
    diameter : str or float, optional
        D ("2.99 mm", or in m), for T/(m g) as a length.
    **options
        model ("enskog-rectangle", "hydrostatic:<equation of state>", "fermi", "rectangle"), plateau_density,
        plateau_density_free, column_number, constrain_column, fixed_temperature, fixed_shift, window (low, high; None
        leaves an end to the rule), base,
        robust, model_error, interval, sweep, compare, confidence.

    Returns
    -------
    Fit
        What is wrong with the data is in its status and message; nothing is raised for it.
    """
    check_options("fit_profile", options, _fit_options)
    length = None if diameter is None else in_si(diameter, "length", "diameter")
    return Fit(_core.fit_profile(height, density, error, covariance, int(covariance_samples),
                                 options | {"kernel": kernel}, length))


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
    density: Any,
    error: Any = None,
    *,
    covariance: Any = None,
    covariance_samples: int = 0,
    kernel: str = "none",
    column_number: Optional[float] = None,
    temperature_x: Union[None, Quantity, tuple[float, float], Number] = None,
    temperature_z: Union[None, Quantity, tuple[float, float], Number] = None,
) -> dict[str, Any]:
    """One temperature from all thermometers, with its whole uncertainty and a verdict (see docs/thermometer.md).

    Parameters are those of `fit_profile`; temperature_x and temperature_z are the kinetic temperatures in m g D, where
    velocities are known. Returns a dict with verdict, why, advice, temperature, std_error, low, high
    (m g D), solid_height, thermometer, model, status. Where the status is not "ok", the numbers are None, and why and
    advice say the reason.
    """
    return _core.find_answer(height, density, error, covariance, int(covariance_samples), kernel,
                             None if column_number is None else number(column_number, "column_number"),
                             _estimate(temperature_x, "temperature_x"), _estimate(temperature_z, "temperature_z"))


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
        phi_0 in 1/D^2.
    equation_of_state : str
        enskog, henderson, santos-lopez-yuste, percus-yevick, kolafa-rottner, luding, best-of, or all.
    diameter : str or float, optional
        D ("2.99 mm", or in m), for lengths.
    initial_height : str or float, optional
        Height mu of the bed at rest: a length with its unit, or a number in D. Or give column_number, N D/W.
    temperature : str or float, optional
        T/(m g) as a length with its unit, or T in m g D.

    Returns
    -------
    dict
        As ``shakebed theory --json`` prints it.
    """
    plateau_density = _checked_plateau(plateau_density)
    length = None if diameter is None else in_si(diameter, "length", "diameter")
    if initial_height is not None and column_number is not None:
        raise UsageError("initial_height and column_number say the same thing: give one")
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
    """T from Gamma by every reading of the paper's map [QuinnHong2000].

    Parameters
    ----------
    gamma : float
        Peak acceleration of the floor over g; or give its amplitude.
    frequency, diameter, amplitude, gravity : str or float
        With their units, or in SI.
    initial_height : str or float
        Height mu of the bed at rest: a length with its unit, or a number in D.
    restitution : float
        Of the single ball; 0: one flight of a dead ball.

    Returns
    -------
    dict
        As ``shakebed map --json`` prints it: "readings" is a list, each with name, jump_height, temperature, in_range.
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
        raise UsageError("restitution must be from 0 to 0.99")
    return _core.gamma_to_temperature(gamma, f, g, length, height, plateau_density, restitution, equation_of_state)
