# Plots a sweep: python3 plot_sweep.py results/rise/sweep.csv rise.png   (needs numpy and matplotlib)
import sys

import matplotlib.pyplot as plt
import numpy

points = numpy.genfromtxt(sys.argv[1], delimiter=",", names=True, dtype=None, encoding="utf-8")
plt.errorbar(points["bed_floor_gamma"], points["bed_center_of_mass_rise"], points["bed_center_of_mass_rise_std_error"], fmt="o")
plt.savefig(sys.argv[2])
