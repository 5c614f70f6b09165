#pragma once
// The probability that a circle is a bead, by the visible share of its rim. Circles of the picture are compared with
// those of copies in which no bead is round, found by the same search (target and decoy [EliasGygi]).

#include <vector>

#include "ingest/find/circle_search.hpp"

namespace shakebed::ingest {

// What is known before circles are judged: nothing, that they are wide, the radius of the beads, or that beads were
// found. Outlines tell whether wide circles are round, and whether many fairly wide ones are.
enum class Known { nothing, fairly_wide, wide, radius, beads };

// The probability for support 0, 1/20, 2/20 .. 1 (the visible share of the rim). `copies`: the circles of each copy. A
// class of support without a circle is joined to the next better one, which lowers that one's probability. Where the
// radius is known, only classes at most 0.2 below are joined: half of a large oval passes as a poor small circle. So it
// is with wide circles seen nearly whole, since clutter closes no rim, and with many of them that are fairly wide: 20
// beside four copies, 80 beside one. Where beads are known most classes are empty, and they stay separate. The
// probability never falls with the support: neighbouring classes that violate this are pooled (isotonic regression
// [Barlow]).
std::vector<double> probabilities_by_support(const std::vector<Circle>& seen,
                                             const std::vector<std::vector<Circle>>& copies,
                                             Known known = Known::nothing);

// Of `count` circles of which `wrong` are expected to be due to chance: their share, a standard deviation more. And the
// largest with which circles are believed to be beads.
double share_by_chance_at_worst(double wrong, double count);
inline constexpr double most_by_chance = 0.2;

// Linear between the table's values; 0 for an empty table.
double probability_at(const std::vector<double>& by_support, double support);

}  // namespace shakebed::ingest
