// A picture as numbers, for pages that draw it again so that a reader can ask it: NAME.plot.json beside NAME.svg.
#pragma once

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/plot_data_name.hpp"
#include "pipelines/stages/figure.hpp"

namespace shakebed::pipelines {

// Axes (labels, limits or null, logarithmic or not), bands, and the series of both panels. Numbers have 7 digits; all
// of them are in NAME.dat.
Json plot_data(const Picture& picture);

}  // namespace shakebed::pipelines
