// Manual pages and completions of the program, from the same tables that read its command line.
#pragma once

#include <filesystem>

namespace CLI {
class App;
}

namespace shakebed::pipelines {

// Below `folder`: man/man1/shakebed.1 and shakebed-<command>.1, bash-completion/completions/shakebed,
// zsh/site-functions/_shakebed. Throws StageError where they cannot be written.
void write_command_pages(const CLI::App& app, const std::filesystem::path& folder);

}  // namespace shakebed::pipelines
