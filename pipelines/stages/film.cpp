#include "pipelines/stages/film.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "ingest/frames/small_picture.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"

namespace shakebed::pipelines {
namespace {

// Of pictures and disks together: 1.3 MB are 1.7 MB in base64, less than half of a page of 4 MB.
constexpr std::size_t film_bytes = 1'300'000;
// A disk on the page: place, radius, quality, order, probability, step (film_viewer.cpp).
constexpr std::size_t bytes_of_disk = 10;
// Disks of 20 px in frames 620 px wide are 12 px wide then; at this quality their rims are still sharp (looked at).
constexpr int picture_width = 400, picture_quality = 32;

// Widths of the picture: a frame is not reduced below them before it is drawn.
constexpr double least_reduced = 2;

struct Kept {
  std::size_t frame = 0, disks = 0;
  std::string picture{};
};

// Every `every`-th of the good frames; doubled whenever what is kept grows too large.
class Thinning {
 public:
  bool wants(std::size_t number) const { return number % every_ == 0; }
  void add(std::size_t number, Kept one) {
    bytes_ += size(one);
    kept_.emplace_back(number, std::move(one));
    while (bytes_ > film_bytes && kept_.size() > 1) {
      every_ *= 2;
      std::erase_if(kept_, [&](const auto& at) {
        if (at.first % every_ == 0) return false;
        bytes_ -= size(at.second);
        return true;
      });
    }
  }
  std::size_t every() const { return every_; }
  // How many like the kept ones fit into the film.
  std::size_t fit() const { return bytes_ == 0 ? 1 : film_bytes * kept_.size() / bytes_; }
  const std::vector<std::pair<std::size_t, Kept>>& kept() const { return kept_; }

 private:
  static std::size_t size(const Kept& one) { return one.picture.size() + bytes_of_disk * one.disks; }
  std::vector<std::pair<std::size_t, Kept>> kept_;
  std::size_t every_ = 1, bytes_ = 0;
};

// The pictures that are drawn of so many frames where at most `fit` of them are kept: later ones ever more rarely.
std::size_t pictures_drawn(std::size_t frames, std::size_t fit) {
  std::size_t every = 1, kept = 0, drawn = 0;
  for (std::size_t number = 0; number < frames; number += every) {
    ++drawn;
    if (++kept > std::max<std::size_t>(fit, 1)) {
      kept = (kept + 1) / 2;
      every *= 2;
      number -= number % every;
    }
  }
  return drawn;
}

Json marks_json(const DisksOnTheWay::Marks* marks) {
  Json out{{"missed", Json::array()}, {"false", Json::array()}};
  if (marks == nullptr) return out;
  for (const auto& [x, y] : marks->missed)
    out["missed"].push_back(std::round(10 * x) / 10), out["missed"].push_back(std::round(10 * y) / 10);
  for (const std::size_t disk : marks->wrong) out["false"].push_back(disk);
  return out;
}

}  // namespace

void write_film(RunContext& context, const FilmFiles& film, const ingest::Measurement& found,
                const DisksOnTheWay& on_the_way, std::optional<double> rate,
                const std::function<void(double)>& progress) {
  ingest::FrameSourceOptions shown = film.source;
  const double recorded_width = static_cast<double>(found.finder.width) * film.source.reduction;
  shown.reduction = film.reduction_shown(std::floor(recorded_width / (least_reduced * picture_width)));
  ingest::FrameSource source = ingest::FrameSource::open(film.paths, shown);
  Thinning thinned;
  const auto frames = static_cast<std::size_t>(
      std::count_if(found.frames.begin(), found.frames.end(),
                    [](const ingest::FrameReport& one) { return one.status == ingest::FrameStatus::good; }));
  std::size_t good = 0, drawn = 0, to_draw = frames;
  int width = 0, height = 0;
  for (auto item = source.next_item(); item && item->index < found.frames.size(); item = source.next_item()) {
    const ingest::FrameReport& report = found.frames[item->index];
    if (report.status != ingest::FrameStatus::good) continue;
    const std::size_t number = good++;
    if (!thinned.wants(number)) continue;
    context.check_interrupted();
    progress(static_cast<double>(drawn++) / static_cast<double>(to_draw));
    const ingest::GrayFrame frame = item->decode();
    width = frame.width * shown.reduction, height = frame.height * shown.reduction;
    thinned.add(number, {item->index, report.disks, ingest::small_webp(frame, picture_width, picture_quality)});
    if (std::has_single_bit(drawn)) to_draw = std::max(drawn + 1, pictures_drawn(frames, thinned.fit()));
  }
  if (thinned.kept().empty()) return;
  Json out{{"kind", "webp"},
           {"width", width},
           {"height", height},
           {"picture_width", std::min(width, picture_width)},
           {"every", thinned.every()},
           {"of", good},
           {"floor", found.calibration.floor_px},
           {"frames", Json::array()},
           {"pictures", Json::array()}};
  if (rate) out["rate"] = *rate;
  for (const auto& [ignored, one] : thinned.kept()) {
    out["frames"].push_back(one.frame);
    out["pictures"].push_back(base64(one.picture));
    if (on_the_way.truth()) out["marks"].push_back(marks_json(on_the_way.marks(one.frame)));
  }
  write_file(context.output("film.json"), dump_canonical(out) + "\n");
}

}  // namespace shakebed::pipelines
