// From a profile in a file to one that can be fitted: the same for the fit stage, for fit-profile and for --data.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"
#include "pipelines/formats/profile_csv.hpp"

namespace shakebed::pipelines {

struct MeasuredProfile {
  fit::Profile profile;
  Kernel kernel;                        // what it was measured through; none where nobody says
  std::optional<double> column_number;  // N D/W
  std::vector<std::string> warnings;    // how the file was read, a sentence each
};

// With the covariance of that file, where one is given. `stated`: the kernel that an option names, before what the file
// says. Throws InputError.
MeasuredProfile read_measured_profile(const std::filesystem::path& profile,
                                      const std::optional<std::filesystem::path>& covariance = std::nullopt,
                                      const std::optional<Kernel>& stated = std::nullopt);

}  // namespace shakebed::pipelines
