// A profile of the user's: what is read has finite numbers and is written and read back the same.
#include <cmath>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/formats/table.hpp"
#include "tests/robustness/fuzz/fuzz.hpp"

using namespace shakebed::pipelines;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto path = shakebed::fuzz::as_file({reinterpret_cast<const char*>(data), size}, ".csv");
  try {
    const ProfileTable table = read_profile_csv(path);
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (!std::isfinite(table.height[i]) || !std::isfinite(table.number_density[i]) ||
          !std::isfinite(table.area_fraction[i]) || (!table.std_error.empty() && !(table.std_error[i] > 0)) ||
          std::isnan(table.samples[i]))
        shakebed::fuzz::fail("a number that is none");
      if (i > 0 && table.height[i] < table.height[i - 1]) shakebed::fuzz::fail("rows are not sorted");
    }
    write_profile_csv(path, table);
    const ProfileTable again = read_profile_csv(path);
    std::filesystem::remove(metadata_path(path));
    if (again.height != table.height || again.number_density != table.number_density || again.kernel != table.kernel)
      shakebed::fuzz::fail("written and read back, not the same");
  } catch (const InputError& error) {
    if (std::string_view(error.what()).empty()) shakebed::fuzz::fail("an error without words");
  }
  return 0;
}
