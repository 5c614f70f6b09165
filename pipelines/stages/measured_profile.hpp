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
  std::optional<Kernel> kernel;         // what it was measured through; nothing where the file does not say
  std::optional<double> column_number;  // N D/W
  std::vector<std::string> warnings;    // how the file was read, a sentence each
};

// With the covariance of that file, where one is given. Throws InputError.
MeasuredProfile read_measured_profile(const std::filesystem::path& profile,
                                      const std::optional<std::filesystem::path>& covariance = std::nullopt);

}  // namespace shakebed::pipelines
