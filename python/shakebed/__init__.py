"""Shaken beds of disks under gravity: simulate, photograph, measure, fit.

>>> import shakebed
>>> bed = shakebed.simulate("bed.json")
>>> print(shakebed.fit_profile(bed.profile).brief())

Lengths are in D (the diameter of a disk) and temperatures in m g D, unless a unit is named. Arguments with a unit are
strings ("2.99 mm") or numbers in SI.
"""

from ._core import version as __version__
from .errors import BedWarning, CheckFailed, Error, InputError, RecipeError, StageError, UsageError
from .fits import Fit, close_packing_density, find_answer, fit_profile, gamma_to_temperature, theory
from .photographs import Disks, MeasuredBed, find_disks, measure_bed
from .quantities import Quantity
from .runs import Results, StageResults, Table, load, run
from .scenes import Bed, Profile, Simulation, Trajectory, density_profile, read_trajectory, simulate

__all__ = [
    "Bed", "BedWarning", "CheckFailed", "Disks", "Error", "Fit", "InputError", "MeasuredBed", "Profile", "Quantity",
    "RecipeError", "Results", "Simulation", "StageError", "StageResults", "Table", "Trajectory", "UsageError", "__version__",
    "close_packing_density", "density_profile", "find_answer", "find_disks", "fit_profile", "gamma_to_temperature", "load", "measure_bed",
    "read_trajectory", "run", "simulate", "theory",
]
