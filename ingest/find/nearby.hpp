#pragma once
// Which of many places lie near one another, or near a point: columns as wide as the distance asked for, each in the
// order of heights. Costs grow with the number of places and of what is near, whatever the frame's size.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace shakebed::ingest {

class Nearby {
 public:
  // `place_of(i)` gives the i-th of `count` places as {x, y}, finite; `distance` > 0 is the largest to be asked for.
  template <class PlaceOf>
  Nearby(std::size_t count, double distance, const PlaceOf& place_of) : distance_(distance) {
    ranked_.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto [x, y] = place_of(i);
      ranked_.push_back({x, y, i});
    }
    std::sort(ranked_.begin(), ranked_.end(),
              [](const Place& a, const Place& b) { return a.y != b.y ? a.y < b.y : a.index < b.index; });
    if (ranked_.empty()) return;
    const auto [left, right] =
        std::minmax_element(ranked_.begin(), ranked_.end(), [](const Place& a, const Place& b) { return a.x < b.x; });
    left_ = left->x;
    // Far fewer places than columns, strewn over a long way, need no more columns than there are places.
    width_ = std::max(distance_, (right->x - left_) / static_cast<double>(count));
    columns_.resize(column_of(right->x) + 1);
    for (std::size_t rank = 0; rank < ranked_.size(); ++rank) columns_[column_of(ranked_[rank].x)].push_back(rank);
  }

  // visit(i) for all places nearer to (x, y) than `distance`, in the order of their heights y; until it returns true.
  // Whether it did.
  template <class Visit>
  bool any_near(double x, double y, const Visit& visit) const {
    if (ranked_.empty()) return false;
    std::vector<std::size_t> ranks;
    collect(x, [&](const std::vector<std::size_t>& column) {
      auto from = std::lower_bound(column.begin(), column.end(), y - distance_,
                                   [&](std::size_t rank, double low) { return ranked_[rank].y < low; });
      for (; from != column.end() && ranked_[*from].y <= y + distance_; ++from)
        if (near(ranked_[*from], x, y)) ranks.push_back(*from);
    });
    std::sort(ranks.begin(), ranks.end());
    return std::any_of(ranks.begin(), ranks.end(), [&](std::size_t rank) { return visit(ranked_[rank].index); });
  }
  [[nodiscard]] bool any_near(double x, double y) const {
    return any_near(x, y, [](std::size_t) { return true; });
  }

  // visit(i, j) for all pairs nearer to one another than `distance`, i the higher one (smaller y). Both run in the
  // order of heights. Once visit returns true, the remaining pairs of i are left out.
  template <class Visit>
  void pairs(const Visit& visit) const {
    std::vector<std::size_t> first(columns_.size(), 0), ranks;  // the first of a column that comes after this place
    for (std::size_t rank = 0; rank < ranked_.size(); ++rank) {
      const Place& one = ranked_[rank];
      ranks.clear();
      collect(one.x, [&](const std::vector<std::size_t>& column) {
        std::size_t& at = first[static_cast<std::size_t>(&column - columns_.data())];
        while (at < column.size() && column[at] <= rank) ++at;
        for (std::size_t k = at; k < column.size() && ranked_[column[k]].y <= one.y + distance_; ++k)
          if (near(ranked_[column[k]], one.x, one.y)) ranks.push_back(column[k]);
      });
      std::sort(ranks.begin(), ranks.end());
      for (const std::size_t other : ranks)
        if (visit(one.index, ranked_[other].index)) break;
    }
  }

 private:
  struct Place {
    double x, y;
    std::size_t index;
  };
  [[nodiscard]] std::size_t column_of(double x) const {
    return width_ > 0 ? static_cast<std::size_t>((x - left_) / width_) : 0;
  }
  [[nodiscard]] bool near(const Place& place, double x, double y) const {
    const double dx = place.x - x, dy = place.y - y;
    return dx * dx + dy * dy < distance_ * distance_;
  }
  // The columns within the distance of x.
  template <class Use>
  void collect(double x, const Use& use) const {
    const double low = (x - distance_ - left_) / width_, high = (x + distance_ - left_) / width_;
    if (high < 0 || low >= static_cast<double>(columns_.size())) return;
    const auto last = std::min(columns_.size() - 1, static_cast<std::size_t>(high));
    for (auto column = static_cast<std::size_t>(std::max(0.0, low)); column <= last; ++column) use(columns_[column]);
  }

  double distance_, left_ = 0, width_ = 0;
  std::vector<Place> ranked_;
  std::vector<std::vector<std::size_t>> columns_;  // ranks by height
};

}  // namespace shakebed::ingest
