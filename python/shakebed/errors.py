"""What can go wrong. Every exception carries the exit code that the command line ends with for the same mistake."""

from __future__ import annotations

import difflib
import re
from typing import Any, Iterable


class Error(RuntimeError):
    """Base of all exceptions of this package.

    Attributes
    ----------
    exit_code : int
        That of the command line: 2 usage, 3 recipe, 4 input file, 5 stage, 6 check.
    file, pointer, suggestion : str
        Where it is ("" where there is no such place) and what to do.
    line, column : int
        Place in the file, from 1; 0 where there is none.
    """

    exit_code = 5
    file = ""
    pointer = ""
    line = 0
    column = 0
    suggestion = ""


class UsageError(Error, ValueError):
    """An argument that makes no sense."""

    exit_code = 2


class RecipeError(Error, ValueError):
    """Mistakes in a recipe or a scene, all at once.

    Attributes
    ----------
    problems : list of dict
        Each with file, line, column, pointer, problem, suggestion. The attributes of the exception are those of the
        first.
    """

    exit_code = 3
    problems: list[dict[str, Any]] = []


class InputError(Error, ValueError):
    """A file that is missing, unreadable or not what it should be."""

    exit_code = 4


class StageError(Error):
    """A stage, a simulation or a measurement that could not do its work."""

    exit_code = 5


class CheckFailed(Error):
    """The run is complete, but a result is not what its recipe expects. `results` holds it."""

    exit_code = 6
    results: Any = None


class BedWarning(UserWarning):
    """What is odd about a scene or an argument, though it makes sense: issued by Python's `warnings`."""


def check_options(function: str, options: Iterable[str], known: frozenset[str]) -> None:
    """TypeError, as of Python itself, for an option that the function does not have."""
    for name in options:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            meant = f"did you mean {near[0]!r}? " if near else ""
            raise TypeError(f"{function}() has no option {name!r}; {meant}it has {', '.join(sorted(known))}")


def recipe_error(message: str, problems: list[dict[str, Any]], code: int = 3) -> Error:
    """The exception for a list of problems (called by the compiled module)."""
    error: Error = RecipeError(message) if code == 3 else InputError(message)
    error.exit_code = code
    error.problems = problems  # type: ignore[attr-defined]
    if problems:
        first = problems[0]
        error.file, error.pointer = first["file"], first["pointer"]
        error.line, error.column = first["line"], first["column"]
        error.suggestion = first["suggestion"]
    return error


def input_error(message: str, file: str) -> Error:
    """The exception for a file that cannot be read (called by the compiled module)."""
    error = InputError(message)
    error.file = file
    return error


# "profile.csv:3: ...", how messages about a file begin.
_place = re.compile(r"(?P<file>\S[^:\n]*):(?:(?P<line>\d+):)? ")


def error_of_code(message: str, code: int) -> BaseException:
    """The exception for an exit code (called by the compiled module)."""
    if code == 130:
        return KeyboardInterrupt()
    for kind in (UsageError, RecipeError, InputError, StageError, CheckFailed):
        if kind.exit_code == code:
            error = kind(message)
            if place := _place.match(message) if kind is InputError else None:
                error.file, error.line = place["file"], int(place["line"] or 0)
            return error
    return StageError(message)
