#include "pipelines/cli/exit_code.hpp"

#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {
namespace {

// A stderr that cannot be written (a full disk) changes nothing about how the program ends.
void say(const std::string& what) { std::fputs(("error: " + what + "\n").c_str(), stderr); }

}  // namespace

int exit_code_of(const std::function<int()>& program) {
  try {
    return program();
  } catch (const ConfigError& error) {
    for (const Problem& problem : error.problems()) say(to_string(problem));
    return error.code();
  } catch (const Error& error) {
    say(error.what());
    return error.code();
  } catch (const std::bad_alloc&) {
    say("out of memory");
    return exit_stage_failed;
  } catch (const std::exception& error) {
    say(error.what());
    return exit_stage_failed;
  }
}

}  // namespace shakebed::pipelines
