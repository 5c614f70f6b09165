// film.json of an extract stage: the frames of a film as small pictures, with what is known of the truth in them, for
// the viewer of the page. Which disks were found is in disks.csv.
#pragma once

#include <optional>

#include "ingest/profile/measure_bed.hpp"
#include "pipelines/stages/disks_on_the_way.hpp"
#include "pipelines/stages/extract_files.hpp"

namespace shakebed::pipelines {

// {"kind": "webp", "width", "height" (of the frames, in px), "picture_width", "every", "of" (good frames), "floor" (row
// in px), "rate" (frames a second, where it was given), "frames": [numbers], "pictures": [base64], "marks": [{"missed":
// [x, y, ...], "false": [number of the disk]}] where the truth is known}. Every frame is in it, as long as pictures and
// disks stay within film_bytes; else every second, every fourth, ... of the good ones.
void write_film(RunContext& context, const FilmFiles& film, const ingest::Measurement& found,
                const DisksOnTheWay& on_the_way, std::optional<double> rate);

}  // namespace shakebed::pipelines
