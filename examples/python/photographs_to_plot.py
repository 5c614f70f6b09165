import sys
import matplotlib
matplotlib.use("agg")
import matplotlib.pyplot as plt
import shakebed

folder, diameter = sys.argv[1:3]  # photographs/ "2.99 mm"
profile = shakebed.measure_bed(folder, diameter).profile
plt.errorbar(profile.height, profile.number_density, profile.std_error, fmt=".")
plt.xlabel("height / D")
plt.ylabel("n D^2")
plt.savefig("profile.png")
