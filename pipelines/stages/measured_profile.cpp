#include "pipelines/stages/measured_profile.hpp"

#include <utility>

namespace shakebed::pipelines {

MeasuredProfile read_measured_profile(const std::filesystem::path& profile,
                                      const std::optional<std::filesystem::path>& covariance,
                                      const std::optional<Kernel>& stated) {
  ProfileTable table = read_profile_csv(profile);
  MeasuredProfile out;
  if (covariance) {
    ProfileCovariance read = read_covariance_csv(*covariance, table);
    out.profile.covariance = std::move(read.values), out.profile.covariance_samples = read.independent_samples;
  }
  out.profile.height = std::move(table.height), out.profile.number_density = std::move(table.number_density);
  out.profile.std_error = std::move(table.std_error);
  out.column_number = table.column_number;
  out.warnings = std::move(table.notes);
  if (out.profile.std_error.empty())
    out.warnings.push_back(profile.string() +
                           ": the profile has no standard errors. The errors of the fit follow from the scatter of the "
                           "points about the fitted curve.");
  const std::optional<Kernel> kernel = stated ? stated : table.kernel;
  out.kernel = kernel.value_or(Kernel{});
  if (!kernel)
    out.warnings.push_back(profile.string() +
                           ": the profile does not state through which kernel it was measured. It is taken as "
                           "densities at points. Give the kernel if the profile was smoothed.");
  return out;
}

}  // namespace shakebed::pipelines
