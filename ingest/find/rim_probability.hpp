#pragma once
// How likely a circle is a bead, by the share of its rim that is seen: circles of the picture against those that the
// same search makes up in copies of it where no bead is round (target and decoy [EliasGygi]).

#include <vector>

#include "ingest/find/circle_search.hpp"

namespace shakebed::ingest {

// Classes of support in which no circle is seen belong to the next better one, which makes it more doubtful; of
// `few_circles`, most classes are empty, and they are left apart.
// For support 0, 1/20, 2/20 .. 1. `copies`: the circles of each copy. Better support is never less likely a bead's:
// neighbouring classes that say otherwise are put together (isotonic regression [Barlow]).
std::vector<double> probabilities_by_support(const std::vector<Circle>& seen,
                                             const std::vector<std::vector<Circle>>& copies, bool few_circles = false);

// Linear between the table's values; 0 for an empty table.
double probability_at(const std::vector<double>& by_support, double support);

}  // namespace shakebed::ingest
