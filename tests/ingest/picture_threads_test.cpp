// Several threads for one picture: how many, what they are asked, and that they change nothing.
#include "ingest/frames/picture_threads.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "ingest/find/rim_finder.hpp"
#include "ingest/frames/stop_question.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// Threads that work at pieces at once: each piece waits a while for a second thread, and long where one is expected.
std::size_t threads_at_work(bool expect_two) {
  std::mutex mutex;
  std::condition_variable began;
  std::set<std::thread::id> threads;
  for_each_piece(4, [&](std::size_t) {
    std::unique_lock<std::mutex> lock(mutex);
    threads.insert(std::this_thread::get_id());
    began.notify_all();
    if (PictureThreads::of_thread() != 1) ADD_FAILURE() << "a piece uses one thread";
    began.wait_for(lock, std::chrono::milliseconds(expect_two ? 60'000 : 10), [&] { return threads.size() > 1; });
  });
  return threads.size();
}

TEST(PictureThreads, AreOneUnlessMoreAreAllowed) {
  EXPECT_EQ(PictureThreads::of_thread(), 1);
  EXPECT_EQ(threads_at_work(false), 1U);
  {
    const PictureThreads threads(2);
    EXPECT_EQ(PictureThreads::of_thread(), 2);
    EXPECT_EQ(threads_at_work(true), 2U);
    {
      const PictureThreads fewer(1);
      EXPECT_EQ(threads_at_work(false), 1U);
    }
    EXPECT_EQ(PictureThreads::of_thread(), 2);
    EXPECT_EQ(threads_for(1000, 999), 1);
    EXPECT_EQ(threads_for(1000, 1000), 2);
  }
  EXPECT_EQ(threads_for(1000, 1000), 1);
}

struct PictureGivenUp {};

TEST(PictureThreads, AskTheQuestionOfTheirCaller) {
  const PictureThreads threads(2);
  std::atomic<int> asked = 0;
  const StopQuestion question([&] {
    if (++asked == 3) throw PictureGivenUp();
  });
  std::atomic<int> done = 0;
  for_each_piece(2, [&](std::size_t) { StopQuestion::ask(), ++done; });
  EXPECT_EQ(done, 2);
  EXPECT_THROW(for_each_piece(2, [&](std::size_t) { StopQuestion::ask(); }), PictureGivenUp);
}

// Rims of a picture and of its copies, and the beads in the gaps between them.
TEST(PictureThreads, FindTheSameRims) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 48; ++k)
    disks.push_back(
        {20 + 27.0 * (k % 8) + 4 * test::scattered(k, 1), 20 + 27.0 * (k / 8) + 4 * test::scattered(1, k), 9, 0, 0});
  const GrayFrame frame = render_frame(
      disks, {.width = 240, .height = 190, .background_level = 150, .bead_level = 70, .blur_px = 0.8, .read_noise = 4});
  const auto learned = [&] {
    PictureMaps maps(frame, quick_search.wanted_px);
    LearnedRims rims = learn_rims(maps, Polarity::dark_beads, 8.5, Known::beads);
    learn_gaps(maps, rims, false);
    return rims;
  };
  const LearnedRims one = learned();
  const PictureThreads threads(3);
  const LearnedRims three = learned();
  ASSERT_GE(one.disks.size(), 40U);
  ASSERT_EQ(three.disks.size(), one.disks.size());
  for (std::size_t k = 0; k < one.disks.size(); ++k) {
    EXPECT_EQ(three.disks[k].circle.x, one.disks[k].circle.x);
    EXPECT_EQ(three.disks[k].probability, one.disks[k].probability);
  }
  EXPECT_EQ(three.model.probability, one.model.probability);
  EXPECT_EQ(three.model.gaps->same_size, one.model.gaps->same_size);
}

}  // namespace
}  // namespace shakebed::ingest
