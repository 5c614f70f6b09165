// Density profiles as CSV: what simulate and extract write, and what people have. The one reader of profiles.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/results.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

// Heights in D, densities n D^2. In files: height,number_density,std_error,area_fraction,samples.
struct ProfileTable {
  std::vector<double> height;          // rising [D]
  std::vector<double> number_density;  // [1/D^2]
  std::vector<double> std_error;       // above 0 everywhere [1/D^2]; empty where the file has none
  std::vector<double> area_fraction;   // covered fraction; pi/4 number_density where the file has none
  std::vector<double> samples;         // disk positions seen through the window at this height; 0 where not known

  std::string description = "density profile";
  std::string origin = "the floor's mean position";  // height 0
  std::optional<Kernel> kernel;                      // what it was measured through, where that is known
  std::optional<double> column_number;               // N D/W
  std::optional<double> phase;                       // of the shaking, in periods
  std::vector<std::string> notes;  // what a reader must know of how it was read: a sentence each, with the file's name

  std::size_t size() const { return height.size(); }
};

// Writes NAME.csv and NAME.csv-metadata.json below a stage's output folder.
void write_profile_csv(const std::filesystem::path& path, const ProfileTable& profile);

// Reads any CSV with a header that names a height (height, z, zeta) and a density. The density is number_density (phi,
// density) or area_fraction (nu). Cells are separated by commas, semicolons, tabs or blanks. Optional columns:
// std_error (error, sigma, stderr), area_fraction, samples (count). Kernel and column number come from the metadata
// beside the file, else from lines "# kernel: gaussian:0.5" and "# column_number: 10.2". Rows are sorted by height.
//
// Some rows may have no standard error (an empty cell or 0) while others do. Each such row takes the error of the
// nearest height that has one (the larger of two). One note names the rows. Throws InputError naming the line.
ProfileTable read_profile_csv(const std::filesystem::path& path);

// Covariance of the densities of a profile, row by row, from covariance.csv: height_i,height_j,covariance for j >= i.
// Heights that the file does not name keep their own variance.
struct ProfileCovariance {
  std::vector<double> values;  // size() x size()
  int independent_samples = 0;
};
ProfileCovariance read_covariance_csv(const std::filesystem::path& path, const ProfileTable& profile);
// The covariance of rows first, first + 1, ... of `heights`, n x n, row by row.
void write_covariance_csv(const std::filesystem::path& path, const std::vector<double>& heights,
                          const std::vector<double>& covariance, std::size_t independent_samples);

// The columns of a density profile above `origin`, and those of a covariance between its heights.
std::vector<StatedColumn> profile_columns(const std::string& origin = "the floor's mean position");
std::vector<StatedColumn> covariance_columns();

}  // namespace shakebed::pipelines
