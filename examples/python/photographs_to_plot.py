import sys
import matplotlib
matplotlib.use("agg")
import matplotlib.pyplot as plt
import shakebed

if len(sys.argv) != 3: sys.exit('usage: photographs_to_plot.py FOLDER DIAMETER, as in: photographs "2.99 mm"')
folder, diameter = sys.argv[1:3]
profile = shakebed.measure_bed(folder, diameter).profile
plt.errorbar(profile.height, profile.number_density, profile.std_error, fmt=".")
plt.xlabel("height / D")
plt.ylabel("n D^2")
plt.savefig("profile.png")
