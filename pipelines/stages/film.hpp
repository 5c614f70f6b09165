// film.json of an extract stage: the frames of a film as small pictures, with what is known of the truth in them, for
// the viewer of the page. Which disks were found is in disks.csv.
#pragma once

#include <functional>
#include <optional>

#include "ingest/profile/measure_bed.hpp"
#include "pipelines/stages/disks_on_the_way.hpp"
#include "pipelines/stages/extract_files.hpp"

namespace shakebed::pipelines {

// Writes the film of a measurement as one JSON object:
//   "kind": "webp"
//   "width", "height": size of the frames [px]
//   "picture_width": width of the pictures in the film [px]
//   "every", "of": every n-th of this number of good frames is in the film
//   "floor": row of the floor [px]
//   "rate": frames per second, if given
//   "frames": numbers of the frames
//   "pictures": base64
//   "marks": [{"missed": [x, y, ...], "false": [number of the disk]}], if the true centres are known
// All frames are in it as long as pictures and disks stay within film_bytes. Else it holds every second or fourth
// frame.
void write_film(RunContext& context, const FilmFiles& film, const ingest::Measurement& found,
                const DisksOnTheWay& on_the_way, std::optional<double> rate,
                const std::function<void(double)>& progress);  // the share of the frames that is drawn

}  // namespace shakebed::pipelines
