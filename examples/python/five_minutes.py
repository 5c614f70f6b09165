# %% [markdown]
# # Five minutes with a shaken bed
# 100 beads of 3 mm between two walls, on a floor that shakes with 4 g.

# %%
import numpy as np
import shakebed

scene = {
    "seed": 1,
    "disks": {"count": 100, "diameter": "3 mm", "density": "2700 kg/m^3", "restitution": 0.92,
              "contact_duration": "1 us"},
    "gravity": "9.81 m/s^2",
    "box": {"width": "30.9 mm", "sides": {"kind": "hard", "restitution": 0.92}, "lid": "open"},
    "floor": {"motion": "sinusoidal", "gamma": 4, "frequency": "20 Hz", "restitution": 0.92},
    "settle": "1 s", "measure": "5 s", "frames": {"count": 50},
}
bed = shakebed.simulate(scene)
print(bed.brief())

# %% [markdown]
# Numbers carry their errors and units; arrays are numpy's.

# %%
for name, quantity in bed.observables.items():
    print(f"{name:24s} {quantity}")
trajectory = bed.trajectory()
print("frames x disks x (x, z, vx, vz, spin):", trajectory.array.shape)
print("fastest disk: %.2f sqrt(g D)" % np.hypot(*np.moveaxis(trajectory.velocities, 2, 0)).max())

# %% [markdown]
# Is there one temperature? Its density profile is asked, and its velocities.

# %%
answer = bed.answer()
print(answer["verdict"], ": T from %.2f to %.2f m g D" % (answer["low"], answer["high"]))
print(answer["why"])

# %% [markdown]
# The same bed, simulated step by step.

# %%
live = shakebed.Simulation(scene)
for _ in range(3):
    live.step(10)
    print("time %3.0f  highest disk %.2f D" % (live.time, live.positions[:, 1].max()))
