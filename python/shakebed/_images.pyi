# The compiled half that touches images. Users call shakebed/photographs.py.
from typing import Any, Callable, Optional

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

class Disks:
    status: str
    ok: bool
    message: str
    radius: float
    radius_std_error: float
    bright: bool
    expected_wrong: float
    warnings: list[str]
    def columns(self) -> dict[str, Array]: ...
    def brief(self) -> str: ...
    def full(self) -> str: ...

class Bed:
    status: str
    ok: bool
    message: str
    width: float
    scale: float
    scale_error: float
    radius: float
    floor: float
    floor_std_error: float
    floor_reference: str
    shaken: bool
    walls_seen: bool
    column_number: Optional[float]
    frames: int
    disks_a_frame: float
    warnings: list[str]
    def objections(self) -> list[tuple[str, str]]: ...
    def profile(self) -> dict[str, Any]: ...
    def disks(self) -> dict[str, Array]: ...
    def brief(self) -> str: ...
    def full(self) -> str: ...

def find_disks(image: NDArray[Any], options: dict[str, Any]) -> Disks: ...
def measure_arrays(
    images: list[NDArray[Any]], options: dict[str, Any], progress: Optional[Callable[[float], None]]
) -> Bed: ...
def measure_files(paths: list[str], options: dict[str, Any], progress: Optional[Callable[[float], None]]) -> Bed: ...
