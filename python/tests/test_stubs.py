"""The types that the module states are those that it has. Needs mypy."""

import pathlib
import subprocess
import sys

import pytest

import shakebed

pytest.importorskip("mypy", reason="mypy is not installed: the types are not checked")

BUILT = pathlib.Path(shakebed.__file__).parent.parent


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """What mypy has found out about numpy: reading it takes most of the time."""
    return tmp_path_factory.mktemp("mypy")


def mypy(*arguments, cache):
    return subprocess.run([sys.executable, "-m", "mypy", *map(str, arguments)], cwd=BUILT, capture_output=True, text=True,
                          env={"PATH": "/usr/bin:/bin", "MYPYPATH": str(BUILT), "MYPY_CACHE_DIR": str(cache)})


@pytest.mark.long
def test_the_package_is_typed_strictly(cache):
    done = mypy("--strict", "-p", "shakebed", cache=cache)
    assert done.returncode == 0, done.stdout


def test_the_stubs_name_what_the_compiled_modules_have():
    for name in ("_core", "_images"):
        module = __import__(f"shakebed.{name}", fromlist=["*"])
        has = {key for key in vars(module) if not key.startswith("__")}
        stub = {}
        exec(compile("from __future__ import annotations\n" + (BUILT / "shakebed" / f"{name}.pyi").read_text(), name,
                     "exec"), stub)
        states = {key for key in stub if not key.startswith("__") and key not in
                  {"annotations", "Any", "Callable", "Optional", "np", "NDArray", "Array"}}
        states |= set(stub.get("__annotations__", {}))
        assert has == states, name
        for key in has:
            if isinstance(getattr(module, key), type):
                members = {m for m in vars(getattr(module, key)) if not m.startswith("_")}
                stated = {m for m in vars(stub[key]) if not m.startswith("_")} | set(
                    vars(stub[key]).get("__annotations__", {}))
                assert members == stated, f"{name}.{key}"


@pytest.mark.long
def test_a_users_mistake_is_found(tmp_path, cache):
    (tmp_path / "good.py").write_text(
        "import shakebed\n"
        "fit = shakebed.fit_profile([0.0, 1.0], [1.0, 0.5])\n"
        "number: float = fit.temperature.value\n"
        "heights = shakebed.measure_bed('photographs', '3 mm').profile.height + 1\n")
    (tmp_path / "bad.py").write_text("import shakebed\nnumber: str = shakebed.fit_profile([0.0], [1.0]).temperature.value\n")
    done = mypy("--strict", tmp_path / "good.py", tmp_path / "bad.py", cache=cache)
    assert done.returncode == 1 and "bad.py:2" in done.stdout and "good.py" not in done.stdout, done.stdout
