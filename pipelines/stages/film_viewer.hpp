// The film of an extract stage as part of a page: every frame kept with the disks found over it.
#pragma once

#include <string>

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

// <figure> for the script of the page (report/page/film.js): the small pictures of film.json, the disks of disks.csv,
// the density profiles of single frames. `still` (HTML) is shown where scripts do not run. "" where there is no
// film.json. Throws InputError when a file is damaged.
std::string film_viewer(const FinishedStage& stage);

}  // namespace shakebed::pipelines
