# %% [markdown]
# # Temperature against Gamma, with replicas
# Four accelerations, three beds each that differ by their seed. The scatter between the beds is the error.

# %%
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import shakebed


def bed_of(gamma, seed):
    return shakebed.simulate({
        "seed": seed,
        "disks": {"count": 60, "diameter": "3 mm", "density": "2700 kg/m^3", "restitution": 0.92,
                  "contact_duration": "1 us"},
        "gravity": "9.81 m/s^2",
        "box": {"width": "30.9 mm", "sides": {"kind": "hard", "restitution": 0.92}},
        "floor": {"motion": "sinusoidal", "gamma": gamma, "frequency": "20 Hz", "restitution": 0.92},
        "settle": "2 s", "measure": "4 s",
    })


# %%
gammas, seeds = (2, 3, 4, 6), (1, 2, 3)
with ThreadPoolExecutor() as pool:  # simulate() releases the interpreter: the beds run side by side
    beds = list(pool.map(lambda case: bed_of(*case), [(g, s) for g in gammas for s in seeds]))

# %%
readings = {g: shakebed.gamma_to_temperature(gamma=g, frequency="20 Hz", diameter="3 mm",
                                             initial_height=60 / 10.3 / shakebed.close_packing_density)
            for g in gammas}
print("Gamma  T_x (m g D)        T_z (m g D)        readings of the map in range")
for k, gamma in enumerate(gammas):
    replicas = beds[len(seeds) * k : len(seeds) * (k + 1)]
    t = np.array([[float(b.observables[name]) for name in ("temperature_x", "temperature_z")] for b in replicas])
    mean, error = t.mean(axis=0), t.std(axis=0, ddof=1) / np.sqrt(len(replicas))
    in_range = sum(reading["in_range"] for reading in readings[gamma]["readings"])
    print(f"{gamma:5.1f}  {mean[0]:.4f} +- {error[0]:.4f}  {mean[1]:.4f} +- {error[1]:.4f}  {in_range:3d} of "
          f"{len(readings[gamma]['readings'])}")
