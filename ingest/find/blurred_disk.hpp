#pragma once
// A disk of any radial contrast seen through a Gaussian blur: what renderer and finder both believe a bead looks like.

#include <cstddef>
#include <functional>
#include <vector>

namespace shakebed::ingest {

// Gauss-Legendre nodes and weights on (0, 1); the weights sum to 1.
struct GaussLegendre {
  std::vector<double> node, weight;
};
GaussLegendre gauss_legendre(std::size_t count);

// Contrast against rho = r/R inside the disk, before any blur.
using RadialContrast = std::function<double(double rho)>;

// The disk of radius `radius_px` with contrast c(rho), blurred by a Gaussian of sigma `blur_px` > 0 in both directions.
// The value at `distance_px` from its centre, to about 1e-6:
//   F(d) = integral_0^R c(r/R) r/b^2 exp(-(r^2 + d^2)/2b^2) I_0(r d/b^2) dr.
double blurred_disk_contrast(double radius_px, double blur_px, const RadialContrast& contrast, double distance_px);

// The same for the shapes 1, sqrt(1 - rho^2), 1 - rho^2, 1 - rho, (1 - rho^2)^2 at once (cheaper than five calls).
struct BlurredShapes {
  double flat = 0, sphere = 0, parabola = 0, cone = 0, quartic = 0;
};
BlurredShapes blurred_disk_shapes(double radius_px, double blur_px, double distance_px);

}  // namespace shakebed::ingest
