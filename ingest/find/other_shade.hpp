#pragma once
// Beads of another shade than those found: fainter ones, or darker than the background where the others are brighter.
//
// The beads found are painted over with what is behind them. What is left is searched for beads as any picture is. A
// circle counts when edges that belong to none of the beads found make up its rim. The place of a missing bead between
// others looks round, too, but by the rims of its neighbours alone.

#include "ingest/find/find_disks.hpp"

namespace shakebed::ingest {

// Looks for beads of another shade in this frame, in which `found` are the beads of the calibration. When there are
// some, they become the calibration's `other_shade`, `found` holds them, too, and a warning tells their number.
// Pictures that were enlarged by repeating pixels are not searched.
void learn_other_shade(const GrayFrame& frame, const FindOptions& options, FinderCalibration& calibration,
                       FindResult& found);

// Adds the beads of the other shade to those found, which no bead of the other shade overlaps.
void add_other_shade(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options,
                     FindResult& found);

}  // namespace shakebed::ingest
