#include "ingest/frames/picture_threads.hpp"

#include <utility>

#include "ingest/frames/stop_question.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::ingest {

namespace {
thread_local int threads_allowed = 1;
}

PictureThreads::PictureThreads(int threads) : outer_(std::exchange(threads_allowed, threads)) {}
PictureThreads::~PictureThreads() { threads_allowed = outer_; }
int PictureThreads::of_thread() { return threads_allowed; }

int threads_for(int width, int height) {
  constexpr double large_px = 1e6;
  return static_cast<double>(width) * height < large_px ? 1 : PictureThreads::of_thread();
}

void for_each_piece(std::size_t count, const std::function<void(std::size_t)>& work) {
  const std::function<void()> question = StopQuestion::of_thread();
  for_each_index(count, threads_allowed, [&](std::size_t i) {
    const PictureThreads alone(1);
    const StopQuestion asked(question);
    work(i);
  });
}

}  // namespace shakebed::ingest
