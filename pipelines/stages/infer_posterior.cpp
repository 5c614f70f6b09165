// implements: pipelines/stages/infer.hpp
// The posterior of an inference. Beds answer smoothly to their parameters in part of the prior and abruptly in another:
// T falls by a factor of 100 where a bed lands at the wrong moment of the floor. One surrogate of them all takes such
// jumps for scatter. So the last surrogate is made from the beds where the posterior is.
#include <algorithm>
#include <cmath>

#include "pipelines/stages/infer.hpp"
#include "pipelines/stages/replica_seed.hpp"

namespace shakebed::pipelines {

namespace {

// Of 100 films, margins of 0.25 and 0.5 did as well (67 and 92 to 93 % of the truths within 68 and 95 % intervals).
// The region reaches over this share of the posterior, and by this part of its width beyond on each side.
constexpr double share_beyond = 0.001, margin = 0.25;
// It grows by this factor until so many beds of each parameter and one more are in it.
constexpr double growth = 1.25;
constexpr std::size_t beds_each = 20;
constexpr double least_half = 1e-3;  // of a side of the region, so that it can grow from a point
// The first surrogate, of the whole prior, is made from so many beds: its time grows with their third power.
constexpr std::size_t most_of_all = 200;
// Where more than this share of the posterior lies in the outermost tenth of a side, it is made again in a wider
// region.
constexpr double at_the_edge = 0.02, edge = 0.1;
// Where the region holds no fewer than this share of the beds of the one before, that one is kept.
constexpr double worthwhile = 0.8;
constexpr int most_regions = 5;

fit::LogLikelihood log_likelihood(const BedSurrogate& surrogate, const InferOptions& options, const Region& region,
                                  const std::vector<ScaledTarget>& targets) {
  return [&](std::span<const double> points) {
    const BedSurrogate::Fit found = surrogate.fit(region.place(points), targets);
    const std::size_t views = options.bed.views.size();
    std::vector<double> out(points.size() / options.dimensions(), -INFINITY);
    for (std::size_t i = 0; i < out.size(); ++i) {
      double sum = 0, greatest = -INFINITY;
      for (std::size_t v = 0; v < views; ++v) greatest = std::max(greatest, found.log_likelihood[i * views + v]);
      for (std::size_t v = 0; v < views; ++v)
        sum += surrogate.view_prior(v) * std::exp(found.log_likelihood[i * views + v] - greatest);
      if (std::isfinite(greatest)) out[i] = greatest + std::log(sum);
    }
    return out;
  };
}

fit::Posterior sampled(const RunContext& context, const InferOptions& options, const BedSurrogate& surrogate,
                       const Region& region, const std::vector<ScaledTarget>& targets) {
  fit::SamplingOptions sampling;
  sampling.seed = mixed(context.seed());
  sampling.threads = context.jobs();
  fit::Posterior out =
      fit::sample_posterior(options.dimensions(), log_likelihood(surrogate, options, region, targets), sampling);
  out.points = region.place(out.points);
  out.log_evidence += std::log(region.volume());
  return out;
}

std::vector<double> of_parameter(const fit::Posterior& posterior, std::size_t k) {
  std::vector<double> places;
  for (std::size_t i = 0; i < posterior.size(); ++i) places.push_back(posterior.point(i)[k]);
  return places;
}

Region whole(std::size_t dimensions) {
  return {std::vector<double>(dimensions, 0), std::vector<double>(dimensions, 1)};
}

Region about(const fit::Posterior& posterior) {
  Region out;
  for (std::size_t k = 0; k < posterior.dimensions; ++k) {
    const std::vector<double> places = of_parameter(posterior, k);
    const double low = fit::weighted_quantile(places, posterior.weight, share_beyond);
    const double high = fit::weighted_quantile(places, posterior.weight, 1 - share_beyond);
    out.low.push_back(std::max(0.0, low - margin * (high - low)));
    out.high.push_back(std::min(1.0, high + margin * (high - low)));
  }
  return out;
}

Region wider(const Region& region, double factor) {
  Region out = region;
  for (std::size_t k = 0; k < region.low.size(); ++k) {
    const double middle = (region.low[k] + region.high[k]) / 2;
    const double half = std::max(least_half, factor * (region.high[k] - region.low[k]) / 2);
    out.low[k] = std::max(0.0, middle - half), out.high[k] = std::min(1.0, middle + half);
  }
  return out;
}

// Share of the posterior at the edges of the region that are none of the prior.
double share_at_edges(const fit::Posterior& posterior, const Region& region) {
  double share = 0;
  for (std::size_t i = 0; i < posterior.size(); ++i) {
    bool out = false;
    for (std::size_t k = 0; k < posterior.dimensions; ++k) {
      const double at = posterior.point(i)[k], width = edge * (region.high[k] - region.low[k]);
      out = out || (region.low[k] > 0 && at < region.low[k] + width) ||
            (region.high[k] < 1 && at > region.high[k] - width);
    }
    if (out) share += posterior.weight[i];
  }
  return share;
}

std::vector<RunBed> beds_in(const Region& region, const InferOptions& options, const std::vector<RunBed>& beds) {
  std::vector<RunBed> out;
  std::vector<double> place(options.dimensions());
  for (const RunBed& bed : beds) {
    for (std::size_t k = 0; k < place.size(); ++k)
      place[k] = std::clamp(options.parameters[k].second.place(bed.values[k]), 0.0, 1.0);
    if (region.holds(place)) out.push_back(bed);
  }
  return out;
}

std::vector<RunBed> thinned(const std::vector<RunBed>& beds) {
  if (beds.size() <= most_of_all) return beds;
  std::vector<RunBed> out;
  for (std::size_t i = 0; i < most_of_all; ++i) out.push_back(beds[i * beds.size() / most_of_all]);
  return out;
}

// The posterior by the beds where the first one is; nothing where too few of these have all numbers.
class NearPosterior {
 public:
  NearPosterior(const RunContext& context, const InferOptions& options, const std::vector<RunBed>& beds,
                const std::vector<ScaledTarget>& targets)
      : context_(context), options_(options), beds_(beds), targets_(targets) {}

  std::shared_ptr<const BedSurrogate> surrogate(const std::vector<RunBed>& beds, const Region& region,
                                                bool every_number) const {
    return std::make_shared<const BedSurrogate>(options_, beds, targets_,
                                                BedSurrogate::Training{region, every_number, context_.jobs()});
  }
  fit::Posterior posterior(const BedSurrogate& surrogate, const Region& region) const {
    return sampled(context_, options_, surrogate, region, targets_);
  }
  // Beds enough for a surrogate, in a region that is made wider where they are too few.
  std::vector<RunBed> enough_in(Region& region) const {
    const std::size_t enough = std::min(beds_each * (options_.dimensions() + 1), beds_.size());
    std::vector<RunBed> some = beds_in(region, options_, beds_);
    for (; some.size() < enough; some = beds_in(region, options_, beds_)) region = wider(region, growth);
    return some;
  }
  // False: `known` stays as it is.
  bool made(const std::vector<RunBed>& some, const Region& region, KnownParameters& known) const {
    std::shared_ptr<const BedSurrogate> near;
    try {
      near = surrogate(some, region, true);
    } catch (const StageError&) {
      return false;
    }
    fit::Posterior found = posterior(*near, region);
    if (!(found.effective > 0)) return false;
    known.near = near, known.region = region, known.beds_near = some.size(), known.posterior = std::move(found);
    return true;
  }

 private:
  const RunContext& context_;
  const InferOptions& options_;
  const std::vector<RunBed>& beds_;
  const std::vector<ScaledTarget>& targets_;
};

}  // namespace

KnownParameters known_parameters(const RunContext& context, const InferOptions& options,
                                 const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets,
                                 std::shared_ptr<const BedSurrogate> of_all) {
  const NearPosterior near(context, options, beds, targets);
  KnownParameters known;
  known.region = whole(options.dimensions()), known.beds_near = beds.size();
  known.all = of_all ? std::move(of_all) : near.surrogate(thinned(beds), known.region, false);
  known.posterior = near.posterior(*known.all, known.region);
  Region region = known.posterior.effective > 0 ? about(known.posterior) : known.region;
  bool at_edges = false;
  for (int round = 0; round < most_regions; ++round) {
    const std::vector<RunBed> some = near.enough_in(region);
    const auto fewer = static_cast<std::size_t>(worthwhile * static_cast<double>(known.beds_near));
    if (!at_edges && some.size() > fewer) break;
    if (!near.made(some, region, known)) break;
    at_edges = share_at_edges(known.posterior, region) > at_the_edge;
    region = at_edges ? wider(region, growth * growth) : about(known.posterior);
  }
  if (known.near) return known;
  known.near = near.surrogate(beds, known.region, true);
  if (beds.size() > most_of_all) known.posterior = near.posterior(*known.near, known.region);
  return known;
}

}  // namespace shakebed::pipelines
