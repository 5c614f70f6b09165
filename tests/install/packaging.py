"""What can be checked of the packages that are not built here: pip's and conda's, the Dockerfile, the Debian scripts.

    packaging.py TREE

One version everywhere; every option of CMake that they set is one of ours; every file and component they name is there.
"""

import re
import sys
import tomllib
from pathlib import Path

tree = Path(sys.argv[1])
faults = []


def text(name):
    return (tree / name).read_text(encoding="utf-8")


def expect(condition, what):
    if not condition:
        faults.append(what)


cmake = {str(p.relative_to(tree)): p.read_text(encoding="utf-8")
         for p in [*tree.glob("*/CMakeLists.txt"), *tree.glob("cmake/*.cmake"), tree / "CMakeLists.txt"]}
all_cmake = "\n".join(cmake.values())
pip = tomllib.loads(text("pyproject.toml"))
conda = text("packaging/conda/meta.yaml")
deb, docker = text("packaging/build_deb.sh"), text("packaging/Dockerfile")

version = re.search(r"project\(shakebed VERSION ([\d.]+)", cmake["CMakeLists.txt"])[1]
for name, found in {
    "pyproject.toml": pip["project"]["version"],
    "packaging/conda/meta.yaml": re.search(r'version: "([^"]+)"', conda)[1],
    "CITATION.cff": re.search(r'^version: "?([\d.]+)', text("CITATION.cff"), re.M)[1],
    "CHANGELOG.md": re.search(r"^## \[?v?(\d[\d.]*\d)", text("CHANGELOG.md"), re.M)[1],
}.items():
    expect(found == version, f"{name} says version {found}, CMakeLists.txt {version}")

ours = set(re.findall(r"option\((SHAKEBED_\w+)", all_cmake)) | set(
    re.findall(r"set\((SHAKEBED_\w+)[^)]*?CACHE", all_cmake, re.S))
set_by = {"pyproject.toml": set(pip["tool"]["scikit-build"]["cmake"]["define"])}
for name, content in (("packaging/conda/meta.yaml", conda), ("packaging/build_deb.sh", deb)):
    set_by[name] = set(re.findall(r"-D(\w+)=", content))
for name, options in set_by.items():
    expect(options, f"{name} sets no option")
    for option in sorted(o for o in options if o.startswith("SHAKEBED_")):
        expect(option in ours, f"{name} sets {option}, which is no option of CMakeLists.txt")

components = set(re.findall(r"COMPONENT (\w+)", all_cmake))
for component in pip["tool"]["scikit-build"]["install"]["components"]:
    expect(component in components, f"pyproject.toml installs the component {component}, which there is not")
module, function = pip["project"]["scripts"]["shakebed"].split(":")
expect(f"def {function}(" in text(f"python/{module.replace('.', '/')}.py"), f"pyproject.toml: there is no {module}:{function}")

python = re.search(r"find_package\(Python3 ([\d.]+)", all_cmake)[1]
expect(pip["project"]["requires-python"] == f">={python}", f"pyproject.toml: CMakeLists.txt asks for Python {python}")
pybind = re.search(r"find_package\(pybind11 ([\d.]+)", all_cmake)[1]
expect(f"pybind11>={pybind}" in pip["build-system"]["requires"], f"pyproject.toml: CMakeLists.txt asks for pybind11 {pybind}")
minimum = re.search(r"cmake_minimum_required\(VERSION ([\d.]+)\)", cmake["CMakeLists.txt"])[1]
expect(pip["tool"]["scikit-build"]["cmake"]["version"] == f">={minimum}", f"pyproject.toml: CMake must be {minimum}")

named = [pip["project"]["readme"], re.search(r"license_file: (\S+)", conda)[1], "packaging/build_deb.sh", "packages.txt"]
named += ["pipelines/" + recipe for recipe in re.findall(r"share/shakebed/(recipes/\S+\.json)", conda)]
for file in named:
    expect((tree / file).is_file(), f"{file} is named by a package and is not there")
for imported in re.search(r"imports: \[([^]]+)\]", conda)[1].split(", "):
    name = imported.rpartition(".")[2]
    expect(imported == "shakebed" or (tree / f"python/shakebed/{name}.pyi").is_file(), f"conda: there is no module {imported}")
expect(re.search(r"^# Only", text("packages.txt"), re.M) and "/^# Only/Q" in docker,
       "the Dockerfile cuts packages.txt at a line that is not there")

# What CMake looks for comes with each of them.
names = {"OpenCV": "opencv", "GSL": "gsl", "Eigen3": "eigen", "nlohmann_json": "nlohmann", "CLI11": "cli11", "fmt": "fmt"}
searched = set(re.findall(r"find_package\((\w+)", "\n".join(v for k, v in cmake.items() if not k.startswith("tests/"))))
for package, word in names.items():
    expect(package in searched, f"{package} is no longer searched: take it out of this test and of the packages")
    for name, content in (("packages.txt", text("packages.txt")), ("packaging/conda/meta.yaml", conda)):
        expect(word in content, f"{name} does not name {package}")

print("\n".join(faults) or f"version {version}: the packages name what there is")
sys.exit(bool(faults))
