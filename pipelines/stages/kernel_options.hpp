// The kernel as an option: {"kind": "gaussian", "width": 0.5}, the same in every stage.
#pragma once

#include "pipelines/formats/config.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

inline void describe_kernel(Fields& fields, Kernel& kernel) {
  std::vector<Choice<KernelKind>> choices;
  for (const KernelKind kind : kernel_kinds) choices.push_back({kind, to_string(kind)});
  fields.choice("kind", kernel.kind, choices,
                {.help = "kind of kernel. none: densities at points. gaussian, top_hat: smoothed densities. "
                         "disk_chord: density from the covered area. The density of a crystal oscillates with its "
                         "rows: a top hat of 1 D can show false beats, a Gaussian does not"});
  fields.number(
      "width", kernel.width,
      {.help = "width of the kernel in D: standard deviation (gaussian), full width (top_hat) or diameter (disk_chord)",
       .range = from_to(0, 100)});
}

// The same for a stage that measures a density, which needs a window of some width.
inline void describe_measuring_kernel(Fields& fields, Kernel& kernel) {
  describe_kernel(fields, kernel);
  if (!fields.decoding()) return;
  fields.require(kernel.kind != KernelKind::none, "kind",
                 "a density is measured with a kernel, and \"none\" is not one",
                 "Choose gaussian, top_hat or disk_chord");
  fields.require(kernel.kind == KernelKind::none || kernel.width >= 1e-3, "width",
                 "must be at least 0.001 D to measure a density");
}

}  // namespace shakebed::pipelines
