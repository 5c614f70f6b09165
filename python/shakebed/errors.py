"""Exceptions and warnings. Each exception has the exit code of the command line for the same mistake."""

from __future__ import annotations

import re
from typing import Any, Iterable


class Error(RuntimeError):
    """Base of all exceptions of this package.

    Attributes
    ----------
    exit_code : int
        Exit code of the command line: 2 usage, 3 recipe, 4 input file, 5 stage, 6 check.
    file, pointer : str
        Place of the mistake: a file and a JSON pointer; "" if there is no such place.
    line, column : int
        Place in the file, from 1; 0 if unknown.
    suggestion : str
        What to do; "" if there is no suggestion.
    """

    exit_code = 5
    file = ""
    pointer = ""
    line = 0
    column = 0
    suggestion = ""


class UsageError(Error, ValueError):
    """An argument is invalid."""

    exit_code = 2


class RecipeError(Error, ValueError):
    """All mistakes of a recipe or a scene.

    Attributes
    ----------
    problems : list of dict
        Keys: file, line, column, pointer, problem, suggestion. The attributes of the exception are those of the first
        mistake.
    """

    exit_code = 3
    problems: list[dict[str, Any]] = []


class InputError(Error, ValueError):
    """A file is missing, unreadable or has the wrong content."""

    exit_code = 4


class StageError(Error):
    """A stage, a simulation or a measurement failed."""

    exit_code = 5


class CheckFailed(Error):
    """A run is complete, but a result differs from the expectation of its recipe.

    Attributes
    ----------
    results : Results
        All results of the run.
    """

    exit_code = 6
    results: Any = None


class BedWarning(UserWarning):
    """A scene or an argument is valid, but unusual. Python's `warnings` issues it."""


def check_options(function: str, options: Iterable[str], known: frozenset[str]) -> None:
    """Raise TypeError for an option that the function does not have."""
    for name in options:
        if name not in known:
            import difflib  # only for mistakes: it takes a while to load

            near = difflib.get_close_matches(name, known, 1)
            meant = f"did you mean {near[0]!r}? " if near else ""
            raise TypeError(f"{function}() has no option {name!r}; {meant}its options: {', '.join(sorted(known))}")


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


# Messages about a file begin with "profile.csv:3: ...".
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
