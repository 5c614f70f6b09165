#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <vector>

#include "sim/engine/checkpoint_bytes.hpp"
#include "sim/measure/archive.hpp"

namespace shakebed::sim {
namespace {

struct Kept {
  std::int32_t number = 0;
  std::vector<double> values;
  template <class Archive>
  void visit(Archive& archive) {
    archive(number, values);
  }
};
struct AllKept {
  double first = 0;
  std::vector<Kept> some;
  std::vector<std::vector<std::uint8_t>> bytes;
  std::uint64_t last = 0;
  template <class Archive>
  void visit(Archive& archive) {
    archive(first, some, bytes, last);
  }
};
AllKept all_kept() { return {0.1, {{7, {1, 2.5}}, {-3, {}}}, {{1, 2, 3}, {}, {255}}, 1234567890123}; }
std::vector<std::uint8_t> archived() {
  AllKept all = all_kept();
  ArchiveWriter writer;
  writer(all);
  return writer.take();
}

TEST(Archive, GivesBackWhatItHolds) {
  const std::vector<std::uint8_t> bytes = archived();
  // A number has its bytes, a vector eight more for its size: 8 + (8 + (4 + 8 + 16) + (4 + 8)) + (8 + 11 + 8 + 9) + 8.
  EXPECT_EQ(bytes.size(), 100U);
  ArchiveReader reader(bytes);
  AllKept back;
  back.some.resize(9);
  EXPECT_FALSE(reader.at_end());
  reader(back);
  EXPECT_TRUE(reader.at_end());
  const AllKept all = all_kept();
  EXPECT_EQ(back.first, all.first);
  EXPECT_EQ(back.last, all.last);
  EXPECT_EQ(back.bytes, all.bytes);
  ASSERT_EQ(back.some.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(back.some[k].number, all.some[k].number);
    EXPECT_EQ(back.some[k].values, all.some[k].values);
  }
  std::uint8_t more = 0;
  EXPECT_THROW(reader(more), std::invalid_argument);
}

TEST(Archive, IsRefusedWhereverItIsCutShort) {
  const std::vector<std::uint8_t> bytes = archived();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::vector<std::uint8_t> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    ArchiveReader reader(part);
    AllKept back;
    EXPECT_THROW(reader(back), std::invalid_argument) << size;
  }
  // Nothing is set aside for a size that the bytes cannot hold.
  for (const std::uint64_t size : {std::uint64_t{9}, std::uint64_t{1} << 60}) {
    std::uint64_t claimed = size;
    std::vector<std::uint8_t> eight(8);
    ArchiveWriter writer;
    writer(claimed);
    std::vector<std::uint8_t> wrong = writer.take();
    wrong.insert(wrong.end(), eight.begin(), eight.end());
    ArchiveReader reader(wrong);
    std::vector<std::uint8_t> back;
    EXPECT_THROW(reader(back), std::invalid_argument);
  }
}

// FNV-1a of 64 bits, by the published values for "", "a" and "foobar".
TEST(CheckpointBytes, HaveThePublishedChecksum) {
  const auto of = [](const char* text) {
    const std::string_view view(text);
    const auto* at = reinterpret_cast<const std::uint8_t*>(view.data());
    return checkpoint_bytes::checksum(at, at + view.size());
  };
  EXPECT_EQ(of(""), 0xcbf29ce484222325U);
  EXPECT_EQ(of("a"), 0xaf63dc4c8601ec8cU);
  EXPECT_EQ(of("foobar"), 0x85944171f73967e8U);
}

TEST(CheckpointBytes, AreTakenInTheirOrderUpToTheirEnd) {
  std::vector<std::uint8_t> bytes;
  checkpoint_bytes::put(bytes, 0.25);
  checkpoint_bytes::put(bytes, std::uint16_t{513});
  ASSERT_EQ(bytes.size(), 10U);
  EXPECT_EQ(bytes[8], 1);
  EXPECT_EQ(bytes[9], 2);
  const std::uint8_t* at = bytes.data();
  const std::uint8_t* const end = at + bytes.size();
  double first = 0;
  std::uint16_t second = 0;
  checkpoint_bytes::take(at, end, first);
  EXPECT_THROW(checkpoint_bytes::take(at, end, first), std::invalid_argument);
  checkpoint_bytes::take(at, end, second);
  EXPECT_EQ(first, 0.25);
  EXPECT_EQ(second, 513);
  EXPECT_EQ(at, end);
  EXPECT_THROW(checkpoint_bytes::take(at, end, second), std::invalid_argument);
}

// A checkpoint begins with its mark and the number of disks, then come the intervals planned and those done. The
// checksum is its end.
TEST(CheckpointBytes, MayBeThoseOfALaterInterval) {
  std::vector<std::uint8_t> bytes;
  checkpoint_bytes::put(bytes, checkpoint_bytes::magic);
  checkpoint_bytes::put(bytes, std::uint32_t{5});
  checkpoint_bytes::put(bytes, std::uint64_t{77});
  checkpoint_bytes::put(bytes, std::uint64_t{1000});
  checkpoint_bytes::put(bytes, 0.75);
  checkpoint_bytes::put(bytes, checkpoint_bytes::checksum(bytes.data(), bytes.data() + bytes.size()));
  const std::vector<std::uint8_t> later = checkpoint_bytes::put_later(bytes, std::uint64_t{1} << 40);
  ASSERT_EQ(later.size(), 44U);
  const std::uint8_t* at = later.data();
  const std::uint8_t* const end = at + later.size();
  std::uint64_t mark = 0, planned = 0, done = 0, sum = 0;
  std::uint32_t number = 0;
  double rest = 0;
  checkpoint_bytes::take(at, end, mark);
  checkpoint_bytes::take(at, end, number);
  checkpoint_bytes::take(at, end, planned);
  checkpoint_bytes::take(at, end, done);
  checkpoint_bytes::take(at, end, rest);
  checkpoint_bytes::take(at, end, sum);
  EXPECT_EQ(mark, checkpoint_bytes::magic);
  EXPECT_EQ(number, 5U);
  EXPECT_EQ(planned, 77U);
  EXPECT_EQ(done, (std::uint64_t{1} << 40) + 1000);
  EXPECT_EQ(rest, 0.75);
  EXPECT_EQ(sum, checkpoint_bytes::checksum(later.data(), later.data() + 36));
  bytes.resize(35);
  EXPECT_THROW(checkpoint_bytes::put_later(bytes, 1), std::invalid_argument);
  bytes.resize(36);
  EXPECT_NO_THROW(checkpoint_bytes::put_later(bytes, 1));
}

}  // namespace
}  // namespace shakebed::sim
