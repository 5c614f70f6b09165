"""Numbers with errors and units, and what helps to show them."""

from __future__ import annotations

import html
from typing import Any, Callable, NamedTuple, Optional, Union

from . import _core
from .errors import UsageError

Number = Union[int, float]
Progress = Union[None, bool, Callable[[float], None]]


class Quantity(NamedTuple):
    """A measured number: value, standard error (None where it has none) and unit ("1" for a plain number)."""

    value: float
    std_error: Optional[float] = None
    unit: str = "1"

    def __float__(self) -> float:
        return float(self.value)

    def __str__(self) -> str:
        error = "" if self.std_error is None else f" +- {self.std_error:.2g}"
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.value:.6g}{error}{unit}"


def in_si(value: Union[str, Number], kind: str, name: str) -> float:
    """A quantity in SI: a string with its unit ("2.99 mm"), or a number that is in SI already.

    kind is "length", "frequency" or "acceleration".
    """
    if isinstance(value, str):
        try:
            return _core.quantity(value, kind)
        except ValueError as error:
            raise UsageError(f"{name}: {error}") from None
    return float(value)


def in_diameters(value: Union[str, Number], diameter: Optional[float], name: str) -> float:
    """A length in D: a plain number, or a string with its unit, which needs the diameter."""
    if not isinstance(value, str):
        return float(value)
    if diameter is None:
        raise UsageError(f"{name}: {value!r} is a length; give the diameter, too, or a number in D")
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
        from tqdm.auto import tqdm  # type: ignore[import]
    except ImportError:
        return None, lambda: None
    bar = tqdm(total=100, desc=what, unit="%")

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
