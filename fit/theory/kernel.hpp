#pragma once

#include <string_view>

// What a measurement does to a profile: every measured density is a mean of the true one over a window. The model is
// put through the same window before the two are compared.
namespace shakebed::fit {

enum class KernelKind {
  none,        // densities at points
  top_hat,     // a bin or running window of full width `width` [D]
  gaussian,    // standard deviation `width` [D]
  disk_chord,  // covered area: a disk of diameter `width` [D] (1 for the beads themselves) spread over its own chord
};

struct Kernel {
  KernelKind kind = KernelKind::none;
  double width = 0.0;  // [D]; ignored for none
};

// "none", "top-hat", "gaussian", "disk-chord".
std::string_view to_string(KernelKind kind);
// False when there is no such name.
bool kernel_kind_from_string(std::string_view name, KernelKind& kind);

// K(s), normalised to 1 [1/D]; not for none.
double kernel_density(const Kernel& kernel, double offset);
// integral_-inf^s K.
double kernel_cumulative(const Kernel& kernel, double offset);
// Half the extent beyond which K is nothing (6.5 standard deviations for a Gaussian: 1e-10 of its weight). [D]
double kernel_reach(const Kernel& kernel);
// Whether the width is finite and not negative.
bool kernel_is_valid(const Kernel& kernel);

}  // namespace shakebed::fit
