// The name of a figure's numbers beside its drawing NAME.svg.
#pragma once

#include <string_view>

namespace shakebed::pipelines {

inline constexpr std::string_view plot_data_suffix = ".plot.json";

}  // namespace shakebed::pipelines
