# %% [markdown]
# # A trajectory of your own
# Extended XYZ, as ASE and OVITO write it, or a dump of LAMMPS, which ASE reads. Lengths in the diameter of a disk. Name a
# file, the width of the bed and the coordinate that is the height (z or y) as arguments. Without them, one is written
# here, of an ideal gas: its density falls as exp(-z/T).

# %%
import sys
import tempfile
from pathlib import Path

import numpy as np
import shakebed

if len(sys.argv) > 1:
    file, width, up = sys.argv[1], float(sys.argv[2]), (sys.argv[3:] or ["z"])[0]
else:
    width, temperature, up = 2000.0, 3.0, "z"
    random = np.random.default_rng(4)
    file = str(Path(tempfile.mkdtemp()) / "gas.extxyz")
    with open(file, "w") as out:
        for frame in range(200):
            out.write(f'100\nLattice="{width} 0 0 0 1 0 0 0 60" Properties=species:S:1:pos:R:3 Time={frame}\n')
            for x, z in zip(random.uniform(0, width, 100), random.exponential(temperature, 100)):
                out.write(f"A {x} 0 {z}\n")

# %%
if file.endswith((".xyz", ".extxyz", ".zst")):
    heights = shakebed.read_trajectory(file, up=up).array[:, :, 1]
else:
    import ase.io
    heights = np.array([frame.positions[:, "xyz".index(up)] for frame in ase.io.read(file, index=":")])
print("frames x disks:", heights.shape)
# For find_answer, a bed between hard side walls also needs sides="hard" here: T is then corrected for the walls.
profile = shakebed.density_profile(heights, width, highest=15)
fit = shakebed.fit_profile(profile)
print(fit.brief())
print(fit.full())
