"""Running recipes with the program, and reading results folders."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterator, KeysView, Mapping, Optional, Union

import numpy as np

from . import _core
from ._place import program as _program_place
from .errors import CheckFailed, StageError, error_of_code, input_error
from .quantities import Progress, Quantity, as_json, reporter, table_html
from .scenes import Trajectory, read_trajectory

if TYPE_CHECKING:
    from numpy.typing import NDArray

_percent = re.compile(r"^(\S+?):.*?(\d+) ?%")


def program() -> str:
    """The path of the program `shakebed` that belongs to this module."""
    if given := os.environ.get("SHAKEBED_PROGRAM"):
        return given
    beside = (Path(__file__).resolve().parent / _program_place).resolve()
    if beside.is_file():
        return str(beside)
    import shutil  # here, as below: `import shakebed` shall be quick

    if found := shutil.which("shakebed"):
        return found
    raise StageError(f"the program shakebed is neither at {beside} nor on the PATH; install it with this module")


class Table:
    """A CSV file of results. table["height"] is a column.

    Attributes
    ----------
    columns : dict of str to ndarray, shape (rows,)
        Numbers, with nan for an empty cell; or texts.
    units : dict of str to str
        Unit of each column; "1" for a plain number.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.units: dict[str, str] = {}
        with open(path, encoding="utf-8", newline="") as file:
            lines = csv.reader(line for line in file if not line.startswith("#"))
            names: list[str] = next(lines, [])
            rows = list(lines)
        self.columns: dict[str, NDArray[Any]] = {}
        for index, name in enumerate(names):
            cells = [row[index] for row in rows]
            try:
                self.columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
            except ValueError:
                self.columns[name] = np.array(cells)
        about = path.with_name(path.name + "-metadata.json")
        if about.is_file():
            for column in json.loads(about.read_text(encoding="utf-8"))["tableSchema"]["columns"]:
                self.units[column["name"]] = column.get("schema:unitText", "1")

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_") or name == "columns" or name not in self.columns:
            raise AttributeError(f"the table has no column {name!r}")
        return self.columns[name]

    def keys(self) -> KeysView[str]:
        return self.columns.keys()

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __repr__(self) -> str:
        return f"<shakebed.Table {self.path.name}: {len(self)} rows of {', '.join(self.columns)}>"


def _with_quantities(value: Any) -> Any:
    if isinstance(value, dict):
        if "value" in value and set(value) <= {"value", "std_error", "unit", "spread"}:
            number = np.nan if value["value"] is None else value["value"]
            return Quantity(number, value.get("std_error"), value.get("unit", "1"))
        return {key: _with_quantities(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_with_quantities(entry) for entry in value]
    return value


class StageResults:
    """The results of one stage.

    Attributes
    ----------
    numbers : dict
        Content of the result file, with quantities as Quantity.
    tables : dict of str to Table
        CSV files by name.
    """

    def __init__(self, folder: Path, numbers: Any) -> None:
        self.folder = folder
        self.numbers = _with_quantities(numbers)

    @property
    def tables(self) -> dict[str, Table]:
        return {path.stem: Table(path) for path in sorted(self.folder.glob("*.csv"))}

    def table(self, name: str) -> Table:
        """One CSV file, by its name without .csv."""
        path = self.folder / f"{name}.csv"
        if not path.is_file():
            raise input_error(f"{path}: there is no such table; choose from: "
                              f"{', '.join(sorted(p.stem for p in self.folder.glob('*.csv')))}", str(path))
        return Table(path)

    def __getitem__(self, name: str) -> Any:
        return self.numbers[name]

    def trajectory(self) -> Trajectory:
        """The frames of a simulation, as one array (see Trajectory)."""
        for name in ("trajectory.extxyz.zst", "trajectory.extxyz"):
            if (self.folder / name).is_file():
                return read_trajectory(self.folder / name)
        raise input_error(f"{self.folder}: there is no trajectory; add \"frames\" to the simulate stage of the recipe",
                          str(self.folder))

    def __repr__(self) -> str:
        return f"<shakebed.StageResults {self.folder.name}>"


class Results:
    """A results folder. results["fit"] is the stage fit.

    Attributes
    ----------
    summary, manifest : dict
        Content of summary.json and manifest.json.
    stages : dict of str to StageResults
        Stages of a single bed; empty for a sweep, whose numbers are in `sweep`.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.summary: dict[str, Any] = self._read("summary.json")
        self.manifest: dict[str, Any] = self._read("manifest.json")
        self.stages = {
            stage["id"]: StageResults(folder / stage["id"], self.summary.get(stage["id"], {}))
            for stage in self.manifest.get("stages", [])
            if (folder / stage["id"]).is_dir()
        }

    def _read(self, name: str) -> dict[str, Any]:
        path = self.folder / name
        try:
            content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            return content
        except OSError as error:
            raise input_error(f"{path}: cannot be read: {error.strerror}; check that this is a results folder",
                              str(path)) from None
        except ValueError as error:
            raise input_error(f"{path}: this is not JSON: {error}", str(path)) from None

    @property
    def sweep(self) -> Optional[Table]:
        """Collected numbers of a sweep (sweep.csv), one row per point; None if the recipe has no sweep."""
        path = self.folder / "sweep.csv"
        return Table(path) if path.is_file() else None

    @property
    def answer(self) -> Optional[dict[str, Any]]:
        """Temperature with its whole uncertainty and the verdict; None if the recipe has no answer."""
        answer: Optional[dict[str, Any]] = _with_quantities(self.summary.get("answer"))
        return answer

    @property
    def report(self) -> Path:
        """Path of report.html."""
        return self.folder / "report.html"

    def __getitem__(self, stage: str) -> StageResults:
        if stage not in self.stages:
            raise KeyError(f"there is no stage {stage!r} in {self.folder}; choose from: {', '.join(self.stages)}")
        return self.stages[stage]

    def __repr__(self) -> str:
        sweep = self.sweep
        held = f"a sweep of {len(sweep)} points" if sweep is not None else ", ".join(self.stages)
        return f"<shakebed.Results {self.folder}: {held}>"

    def _repr_html_(self) -> str:
        rows: dict[str, Any] = {"stages": ", ".join(self.stages), "report": self.report}
        notes = []
        if answer := self.answer:
            rows.update({"T": answer.get("temperature"), "verdict": answer.get("verdict")})
            notes = [answer.get("why") or ""]
        return table_html(str(self.folder), rows, notes)


def load(out: Union[str, "os.PathLike[str]"]) -> Results:
    """Read a results folder.

    Parameters
    ----------
    out : str or path

    Returns
    -------
    Results
        results["fit"]["temperature"] is a Quantity, results["bed"].table("profile")["height"] an array, and
        results["bed"].trajectory() contains the frames.

    Raises
    ------
    InputError
        The folder, or a file in it, is missing or cannot be read.
    """
    folder = Path(out)
    if not folder.is_dir():
        what = "is a file; pass the folder of the results" if folder.is_file() else "there is no such folder"
        raise input_error(f"{folder}: {what}", str(folder))
    return Results(folder)


def run(
    recipe: Union[str, "os.PathLike[str]"],
    out: Union[str, "os.PathLike[str]"],
    *,
    set: Optional[Mapping[str, Any]] = None,
    preset: Optional[str] = None,
    budget: Optional[str] = None,
    jobs: Optional[int] = None,
    force: bool = False,
    progress: Progress = None,
) -> Results:
    """Run a recipe as ``shakebed run`` does. Stages that are up to date in `out` are not repeated.

    Parameters
    ----------
    recipe : str or path
        Recipe file.
    out : str or path
        Results folder.
    set : mapping of JSON pointer to value, optional
        Changes of the recipe: {"/stages/bed/seed": 7}.
    preset : str, optional
        Preset of the recipe, applied before `set`.
    budget : str, optional
        Error of T_x, "1 %", or wall time, "30 s". A short pilot then chooses how long each simulated bed is measured, the
        number of beds and the contact duration.
    jobs : int, optional
        Number of threads. The results do not depend on it.
    force : bool
        Whether stages that are up to date are repeated.
    progress : callable or True, optional
        Function that is called with the fraction of the running stage; True: a bar, if tqdm is installed.

    Returns
    -------
    Results

    Raises
    ------
    RecipeError
        The recipe has mistakes. Nothing was run.
    InputError, StageError
        A stage failed.
    CheckFailed
        A number differs from the expectation of the recipe. Its `results` are complete.
    KeyboardInterrupt
        After Ctrl-C. Finished stages are kept, and the same call continues the run.
    """
    recipe, out = os.fspath(recipe), os.fspath(out)
    settings = [f"{pointer}={value if isinstance(value, str) else as_json(value)}"
                for pointer, value in (set or {}).items()]
    _core.check_recipe(recipe, settings, preset)
    command = [program(), "run", recipe, "--out", out]
    for setting in settings:
        command += ["--set", setting]
    command += ["--preset", preset] if preset else []
    command += ["--budget", budget] if budget else []
    command += ["--jobs", str(jobs)] if jobs else []
    command += ["--force"] if force else []
    call, close = reporter(progress, "running")
    try:
        code, errors = _follow(command, call)
    finally:
        close()
    if code == 0:
        return load(out)
    message = "\n".join(errors) or f"shakebed run ended with exit code {code}"
    error = error_of_code(message, code)
    if isinstance(error, CheckFailed):
        error.results = load(out)
    raise error


@contextlib.contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Ctrl-C acts when the block is left."""
    import threading

    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupts: list[tuple[int, Any]] = []
    signal.signal(signal.SIGINT, lambda number, frame: interrupts.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        for interrupt in interrupts:
            handler(*interrupt)


def _follow(command: list[str], progress: Optional[Callable[[float], None]]) -> tuple[int, list[str]]:
    """Run the program; return its exit code and its error messages. Ctrl-C ends the program first."""
    import subprocess

    process = None
    errors: list[str] = []
    try:
        with _interrupts_wait():  # until there is a program that can be ended
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                                       errors="replace", start_new_session=True)
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("error: "):
                errors.append(line[len("error: "):].rstrip("\n"))
            elif progress is not None and (match := _percent.match(line)):
                progress(int(match.group(2)) / 100)
        return process.wait(), errors
    except BaseException:
        if process is not None:
            process.send_signal(signal.SIGINT)
            process.wait()
        raise
    finally:
        if process is not None and process.stderr is not None:
            process.stderr.close()
