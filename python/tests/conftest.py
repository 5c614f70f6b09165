"""What the tests share."""

import ctypes
import subprocess

import numpy as np
import pytest

import shakebed
from shakebed.runs import program

SCENE = {
    "seed": 3,
    "replicas": 1,
    "disks": {"count": 60, "diameter": "3 mm", "density": "2700 kg/m^3", "restitution": 0.92,
              "contact_duration": "1 us"},
    "gravity": "9.81 m/s^2",
    "box": {"width": "30.9 mm", "sides": {"kind": "hard", "restitution": 0.92}, "lid": "open"},
    "floor": {"motion": "sinusoidal", "amplitude": "2.5 mm", "frequency": "20 Hz", "restitution": 0.92},
    "settle": "0.5 s",
    "measure": "2 s",
    "frames": {"count": 20, "phases": 16},
}


def pytest_configure(config):
    config.addinivalue_line("markers", "long: takes seconds; one of the long set, as the tests so labelled in C++ are")


@pytest.fixture
def scene():
    return dict(SCENE)


class _Mallinfo2(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in
                "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost".split()]


def growth(work, *, warm=5, times=8):
    """Bytes that are allocated more after `times` calls of work() than before, once `warm` calls were made (glibc)."""
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = _Mallinfo2

    def allocated():
        info = mallinfo()
        return info.uordblks + info.hblkhd

    for _ in range(warm):
        work()
    before = allocated()
    for _ in range(times):
        work()
    return allocated() - before


def shakebed_program(*arguments, **options):
    """The command line, as a user starts it."""
    return subprocess.run([program(), *map(str, arguments)], capture_output=True, text=True, **options)


def drawn_image(seed=1, shape=(180, 220), radius=9.0, count=40):
    """Dark disks at random places that do not touch, on a bright ground with noise; and their centres."""
    random = np.random.default_rng(seed)
    centres = []
    while len(centres) < count:
        place = random.uniform([radius + 2, radius + 2], [shape[1] - radius - 3, shape[0] - radius - 3])
        if all(np.hypot(*(place - other)) > 2 * radius + 1 for other in centres):
            centres.append(place)
    image = np.full(shape, 200.0)
    for cx, cy in centres:
        around = slice(int(cy - radius) - 1, int(cy + radius) + 3), slice(int(cx - radius) - 1, int(cx + radius) + 3)
        y, x = np.mgrid[around]
        image[around] -= 140 * np.clip(radius + 0.5 - np.hypot(x - cx, y - cy), 0, 1)
    image += random.normal(0, 3, shape)
    return np.clip(np.round(image), 0, 255).astype(np.uint8), np.array(centres)
