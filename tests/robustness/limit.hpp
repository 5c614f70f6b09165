#pragma once

#include <sys/resource.h>

#include <algorithm>

namespace shakebed::tests {

// A resource limit for the programs started while this lives.
class Limit {
 public:
  Limit(__rlimit_resource_t what, rlim_t value) : what_(what) {
    ::getrlimit(what, &before_);
    const rlimit now{std::min(value, before_.rlim_max), before_.rlim_max};
    ::setrlimit(what, &now);
  }
  ~Limit() { ::setrlimit(what_, &before_); }
  Limit(const Limit&) = delete;

 private:
  __rlimit_resource_t what_;
  rlimit before_{};
};

}  // namespace shakebed::tests
