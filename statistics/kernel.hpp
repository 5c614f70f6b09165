// The kernel through which a density is measured. Every measured profile is the true one convolved with a kernel. A
// model is convolved with the same kernel before the two are compared. Lengths in D.
//
// Any number of threads may call; values own what they hold.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace shakebed {

enum class KernelKind {
  none,        // densities at points
  gaussian,    // standard deviation `width`
  top_hat,     // a bin or running window of full width `width`
  disk_chord,  // covered area: a disk of diameter `width` (1 for the beads themselves) spread over its own chord
};
inline constexpr KernelKind kernel_kinds[] = {KernelKind::none, KernelKind::gaussian, KernelKind::top_hat,
                                              KernelKind::disk_chord};

struct Kernel {
  KernelKind kind = KernelKind::none;
  double width = 0;  // [D]; 0 for none

  bool operator==(const Kernel&) const = default;
};

// The window and the distance of heights [D] with which every part measures a profile unless others are asked for. A
// Gaussian does not alias with the rows of a crystal.
inline constexpr Kernel measuring_kernel{KernelKind::gaussian, 0.5};
inline constexpr double measuring_spacing = 0.25;

// Whether the width is finite and not negative; a width of 0 is a point.
bool kernel_is_valid(const Kernel& kernel);
// Half the extent beyond which it is nothing: 6.5 standard deviations of a Gaussian hold all but 1e-10 of it. [D]
double kernel_reach(const Kernel& kernel);
// K(offset), integral 1 [1/D]. Not for none.
double kernel_density(const Kernel& kernel, double offset);
// Integral of K from -infinity to offset; a step for a point.
double kernel_cumulative(const Kernel& kernel, double offset);

// "none", "gaussian", "top_hat", "disk_chord": the one spelling in files, options and messages.
std::string_view to_string(KernelKind kind);
std::optional<KernelKind> kernel_kind_from(std::string_view name);
// "gaussian:0.5", "none". Of a name without a width, the width is 0.5 (gaussian) or 1 (top_hat, disk_chord). Nothing
// where the text is none of these.
std::optional<Kernel> kernel_from(std::string_view text);
std::string to_string(const Kernel& kernel);

// Heights lowest + i spacing.
struct HeightGrid {
  double lowest = 0, spacing = measuring_spacing;  // [D]
  std::size_t points = 0;
  double height(std::size_t i) const { return lowest + static_cast<double>(i) * spacing; }
};

// The one way from centres to a density: adds K(height(i) - (centre - shift))/width of every centre to density[i]. A
// centre on the edge of a top hat counts half. width: of the bed [D]; density: grid.points values [1/D^2]. A centre
// that is not a number makes all of it NaN. Throws std::invalid_argument for KernelKind::none and for widths or
// spacings that are not above 0.
void add_density(const HeightGrid& grid, const Kernel& kernel, double width, std::span<const double> centres,
                 double shift, std::span<double> density);

}  // namespace shakebed
