#pragma once
// Several threads for one large picture.

#include <cstddef>
#include <functional>

namespace shakebed::ingest {

// While it lives, the search for beads in a picture that this thread calls may use so many threads, this one among
// them. Without it: 1. They can be nested: the innermost holds. Results do not depend on it.
class PictureThreads {
 public:
  explicit PictureThreads(int threads);
  ~PictureThreads();
  PictureThreads(const PictureThreads&) = delete;
  PictureThreads& operator=(const PictureThreads&) = delete;

  static int of_thread();

 private:
  int outer_;
};

// Those of this thread for a picture of a million pixels or more; for a smaller one threads take longer to begin than
// they save.
int threads_for(int width, int height);

// Calls work(i) once for every i below `count`, each of which uses one thread. They ask the question of this thread
// (stop_question.hpp). Throws as for_each_index() does.
void for_each_piece(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace shakebed::ingest
