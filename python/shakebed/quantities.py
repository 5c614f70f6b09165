"""Numbers with errors and units, and functions that show them."""

from __future__ import annotations

import html
import importlib
import json
import os
import warnings
from typing import Any, Callable, NamedTuple, Optional, Union

import numpy as np

from . import _core
from .errors import BedWarning, UsageError

Number = Union[int, float]
Progress = Union[None, bool, Callable[[float], None]]


class Quantity(NamedTuple):
    """A measured number.

    Attributes
    ----------
    value : float
    std_error : float or None
        Standard error, if known.
    unit : str
        Unit of both; "1" for a plain number.
    """

    value: float
    std_error: Optional[float] = None
    unit: str = "1"

    def __float__(self) -> float:
        return float(self.value)

    # As a tuple it would be repeated or joined.
    def __add__(self, other: Any) -> Any:
        raise TypeError("a Quantity is a number with its error and unit; calculate with its value: float(quantity)")

    def __radd__(self, other: Any) -> Any:
        return self.__add__(other)

    def __mul__(self, other: Any) -> Any:
        return self.__add__(other)

    def __rmul__(self, other: Any) -> Any:
        return self.__add__(other)

    def __str__(self) -> str:
        error = "" if self.std_error is None else f" +- {self.std_error:.2g}"
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.value:.6g}{error}{unit}"


def number(value: Any, name: str) -> float:
    """A plain number."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name} is {value!r}; it must be a number") from None


def in_si(value: Union[str, Number], kind: str, name: str) -> float:
    """A quantity in SI, from a string with its unit ("2.99 mm") or a number in SI.

    kind is "length", "frequency" or "acceleration".
    """
    if isinstance(value, str):
        try:
            found = _core.quantity(value, kind)
        except ValueError as error:
            raise UsageError(f"{name}: {error}") from None
    else:
        found = number(value, name)
    if name == "diameter" and found > 0 and (odd := _core.odd_bead(found)):
        warnings.warn(f"{name}: {odd}", BedWarning, stacklevel=3)
    return found


def as_json(content: Any) -> str:
    """JSON of a dict whose values may also be numbers and arrays of numpy, and paths."""

    def plain(value: Any) -> Any:
        if isinstance(value, (np.generic, np.ndarray)):
            return value.tolist()
        if isinstance(value, os.PathLike):
            return os.fspath(value)
        raise UsageError(f"{value!r} ({type(value).__name__}) cannot be part of a recipe")

    return json.dumps(content, default=plain)


def in_diameters(value: Union[str, Number], diameter: Optional[float], name: str) -> float:
    """A length in D: a plain number, or a string with its unit, which needs the diameter."""
    if not isinstance(value, str):
        return float(value)
    if diameter is None:
        raise UsageError(f"{name}: {value!r} is a length; give the diameter too, or a number in D")
    return in_si(value, "length", name) / diameter


def reporter(progress: Progress, what: str) -> tuple[Optional[Callable[[float], None]], Callable[[], None]]:
    """The function that is called with the fraction done, and the one that ends the display.

    progress is None (silent), a function of one number, or True: a bar by tqdm where it is installed.
    """
    if progress is None or progress is False:
        return None, lambda: None
    if callable(progress):
        return progress, lambda: None
    try:
        tqdm = importlib.import_module("tqdm.auto")  # by its name: it may have types, or none
    except ImportError:
        return None, lambda: None
    bar = tqdm.tqdm(total=100, desc=what, unit="%")

    def show(fraction: float) -> None:
        bar.update(int(100 * fraction) - bar.n)

    return show, bar.close


def table_html(title: str, rows: "dict[str, Any]", notes: "list[str] | tuple[str, ...]" = ()) -> str:
    """A table of names and values for a notebook."""
    body = "".join(
        f"<tr><td style='text-align:left'>{html.escape(str(name))}</td>"
        f"<td style='text-align:left'>{html.escape(str(value))}</td></tr>"
        for name, value in rows.items()
    )
    below = "".join(f"<p>{html.escape(note)}</p>" for note in notes)
    return f"<div><b>{html.escape(title)}</b><table>{body}</table>{below}</div>"
