// The images module: the bodies of the stages that touch images. Compiled into libshakebed_images.so, never into the
// program (see images_module.hpp).
// implements: pipelines/stages/images_module.hpp
#include <fmt/format.h>

#include <cstring>
#include <limits>
#include <stdexcept>

#include "ingest/frames/picture_threads.hpp"
#include "pipelines/stages/extract_images.hpp"
#include "pipelines/stages/preview.hpp"
#include "pipelines/stages/proposals.hpp"
#include "pipelines/stages/render_images.hpp"
#include "pipelines/version.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {
namespace {

Previewed preview_images(const PreviewRequest& request) {
  const ingest::PictureThreads threads(processors());
  ingest::FrameSourceOptions kept;
  kept.skip = request.options.skip, kept.stride = request.options.stride;
  const std::vector<ingest::FrameOrigin> pictures = first_pictures(request.files, kept);
  const std::optional<FirstLook> look = look_at_first(pictures, request.options, LookFor::preview);
  if (!look) throw InputError(fmt::format("{}: none of the first pictures can be read", pictures.front().path));
  require_inside(request.options, *look);
  std::string why;
  if (!look->survey.found)
    why = "no beads: " + look->survey.why_not;
  else if (const auto scale = request.options.scale)
    why = ingest::why_not_scale(request.options.diameter, *scale, look->survey.candidates.front().rims.radius_px);
  std::vector<Proposal> proposals;
  if (!why.empty()) proposals = proposals_for(*look, request.options, RefusedBy::first_look);
  write_preview(request.folder, *look, request.files, request.options, proposals);
  if (!why.empty())
    return {false, fmt::format("{}: {}. {}", look->path, why, advice_for(proposals, pictures, request.options))};
  const ingest::SurveyCandidate& best = look->survey.candidates.front();
  return {true, fmt::format("a first look, without the fit of each bead: about {} {} beads of {:.1f} px radius in "
                            "channel {}; expected share of false beads {:.1f} %. The run may find more",
                            best.disks.size(), best.rims.polarity == ingest::Polarity::bright_beads ? "bright" : "dark",
                            best.rims.radius_px, ingest::name_of(best.channel), 100 * best.expected_wrong)};
}

// ingest's own errors become ours.
template <class Work>
void translated(const Work& work) {
  try {
    work();
  } catch (const ingest::InputError& error) {
    throw InputError(error.what());
  } catch (const std::invalid_argument& error) {
    throw StageError(error.what());
  }
}

class Module : public ImagesModule {
 public:
  void render(const RenderOptions& options, RunContext& context) const override {
    translated([&] { render_frames(options, context); });
  }
  void extract(const ExtractOptions& options, RunContext& context) const override {
    translated([&] { extract_disks(options, context); });
  }
  std::uint64_t count_frames(const std::vector<std::string>& files) const override {
    std::uint64_t count = 0;
    translated([&] {
      ingest::FrameSource source = ingest::FrameSource::open(files, {});
      const auto known = source.count_if_known();
      count = known ? *known : source.first_origins(std::numeric_limits<std::size_t>::max()).size();
    });
    return count;
  }
  Previewed preview(const PreviewRequest& request) const override {
    Previewed previewed;
    translated([&] { previewed = preview_images(request); });
    return previewed;
  }
};

}  // namespace
}  // namespace shakebed::pipelines

extern "C" __attribute__((visibility("default"))) const shakebed::pipelines::ImagesModule* shakebed_images(
    const char* version) {
  static const shakebed::pipelines::Module module;
  return std::strcmp(version, SHAKEBED_VERSION) == 0 ? &module : nullptr;
}
