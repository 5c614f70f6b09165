// The commands of the program, each a function from its arguments to an exit code. They throw Error.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace shakebed::pipelines {

struct CommonArguments {
  std::optional<std::string> out;
  bool json = false, quiet = false, verbose = false;
};
struct RunArguments {
  std::vector<std::string> settings;
  std::optional<std::string> preset, only, from, until, shard, data;
  bool force = false, dry_run = false, gather = false;
  int jobs = 0;
};
struct ImageArguments {
  std::vector<std::string> files;
  std::string diameter;
  std::optional<std::string> model, scale, frequency, amplitude, frame_rate, gravity, initial_height, polarity,
      second_diameter, kernel, channel;
  std::optional<double> plateau_density, floor, left_wall, right_wall, pixel_aspect, lens, radius;
  bool preview = false;
  std::optional<std::uint64_t> bead_number;
  std::vector<double> roi;
};
struct ProfileArguments {
  std::string file;
  std::optional<std::string> model, diameter, kernel;
  std::optional<double> plateau_density, column_number;
  bool plateau_density_free = false;
  std::vector<double> window;
};
struct TheoryArguments {
  std::optional<double> plateau_density, column_number;
  std::string equation = "enskog";
  std::optional<std::string> diameter, initial_height, temperature;
};
struct MapArguments {
  std::optional<double> gamma, plateau_density;
  double restitution = 0;
  std::string frequency, diameter, initial_height, equation = "enskog";
  std::optional<std::string> amplitude, gravity, temperature;
};
struct SlurmArguments {
  int shards = 1;
  std::vector<std::string> options;
};
struct Arguments {
  std::vector<std::string> command_line;
  CommonArguments common;
  RunArguments run;
  ImageArguments images;
  ProfileArguments profile;
  TheoryArguments theory;
  MapArguments map;
  SlurmArguments slurm;
  std::string recipe;  // the command's own first argument: a recipe, a folder, a name
  std::string format = "dot";
  std::string older_than;
};

int command_reproduce(const Arguments& arguments);
int command_run(const Arguments& arguments);
int command_fit_images(const Arguments& arguments);
int command_fit_profile(const Arguments& arguments);
int command_theory(const Arguments& arguments);
int command_map(const Arguments& arguments);
int command_audit(const Arguments& arguments);
int command_init(const Arguments& arguments);
int command_schema(const Arguments& arguments);
int command_validate(const Arguments& arguments);
int command_explain(const Arguments& arguments);
int command_graph(const Arguments& arguments);
int command_status(const Arguments& arguments);
int command_verify(const Arguments& arguments);
int command_rerun(const Arguments& arguments);
int command_clean(const Arguments& arguments);
int command_submit_slurm(const Arguments& arguments);
// Becomes the program shakebed-bench, with what stands behind "bench" on the command line.
int command_bench(const Arguments& arguments);

}  // namespace shakebed::pipelines
