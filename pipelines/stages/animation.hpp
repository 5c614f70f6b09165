// A bed in motion, for pages: a canvas that plays frames of a trajectory, all of it inside the page.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace shakebed::pipelines {

// <figure> with the frames (and their density profiles) for the script of the page, and a still picture for browsers
// without scripts. "" when the file holds no frame or too many disks (more than 5000). At most 96 frames are shown.
// `period` is that of the floor in the trajectory's unit of time, sqrt(D/g); 0 when it stands still. Frames farther
// apart than an eighth of it are played in the order of the floor's phase, as a stroboscope shows them. The caption
// then says so. Throws InputError when the file is damaged.
std::string animation_html(const std::filesystem::path& trajectory, double period);

}  // namespace shakebed::pipelines
