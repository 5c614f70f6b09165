# %% [markdown]
# # From a folder of photographs to a profile with error bars
# Name a folder as the first argument. Without one, twelve photographs are drawn from a simulated bed.

# %%
import json
import sys
import tempfile
from pathlib import Path

import shakebed

if len(sys.argv) > 1:
    folder, diameter = sys.argv[1], sys.argv[2]
else:
    work = Path(tempfile.mkdtemp())
    recipe = {"name": "film", "stages": [
        {"stage": "simulate", "id": "bed", "seed": 2,
         "disks": {"count": 60, "diameter": "3 mm", "density": "2700 kg/m^3", "restitution": 0.92,
                   "contact_duration": "1 us"},
         "gravity": "9.81 m/s^2", "box": {"width": "30.9 mm", "sides": {"kind": "hard", "restitution": 0.92}},
         "floor": {"motion": "sinusoidal", "gamma": 3, "frequency": "20 Hz", "restitution": 0.92},
         "settle": "1 s", "measure": "3 s", "frames": {"count": 12, "phases": 4}},
        {"stage": "render", "id": "film", "from": "bed", "scale": "0.2 mm/px"}]}
    (work / "film.json").write_text(json.dumps(recipe))
    shakebed.run(work / "film.json", work / "out")
    folder, diameter = str(work / "out" / "film" / "frames"), "3 mm"

# %%
bed = shakebed.measure_bed(folder, diameter)
print(bed.brief())
for warning in bed.warnings:
    print("warning:", warning)
profile = bed.profile
fit = shakebed.fit_profile(profile, diameter=diameter)
print(fit.brief())
answer = bed.answer()
print(answer["verdict"] + ":", answer["why"])

# %%
try:
    import matplotlib.pyplot as plt
except ImportError:
    print("matplotlib is not installed: no plot")
else:
    curve = fit.curve()
    plt.errorbar(profile.height, profile.number_density, profile.std_error, fmt=".")
    plt.plot(curve["height"], curve["smoothed_density"])
    plt.xlabel("height / D")
    plt.ylabel("n D^2")
    plt.savefig("profile.png")
