// The program: its commands, in the order of --help.
#include <cstdlib>

#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/exit_code.hpp"
#include "pipelines/cli/program.hpp"

int main(int argc, char** argv) {
  using namespace shakebed::pipelines;
  // Decoders of films write lines of their own about a damaged file. The program names the file and what to do.
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
  return exit_code_of([&] {
    Program program(argc, argv);
    for (const auto add :
         {add_reproduce, add_run,    add_fit_images, add_infer_bed, add_fit_profile, add_theory,   add_map,
          add_audit,     add_init,   add_live,       add_schema,    add_reference,   add_validate, add_explain,
          add_graph,     add_status, add_verify,     add_rerun,     add_clean,       add_bench,    add_submit})
      add(program);
    return program.run();
  });
}
