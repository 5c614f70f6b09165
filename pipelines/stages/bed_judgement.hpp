// What speaks against taking the numbers of a simulated bed for those of its scene: one verdict with its reasons.
#pragma once

#include <cstddef>
#include <string>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/replicas.hpp"
#include "pipelines/stages/scene_options.hpp"

namespace shakebed::pipelines {

// Of T: so much error by the contact duration is left without a word.
inline constexpr double allowed_contact_effect = 0.02;

// Of a shaken bed, for observables.json: {"verdict", "why", "advice"}, the gravest reason first. Verdicts: "rows lock",
// "at rest", "contact duration too long", "still changing", "beds differ", "one bed", "real contacts may matter",
// "holds". `joined` is what observables.json says of all beds.
Json judgement_of(const SceneOptions& bed, const Json& joined, std::size_t beds);

// Whether a judgement says anything against the numbers.
bool speaks_against(const Json& judgement);

// "T_x = 0.174 ± 0.003, T_z = 0.36 ± 0.01 m g D, rise 1.02 ± 0.01 D. One bed: ..."; "" where there is no judgement.
std::string judgement_text(const Json& observables);

}  // namespace shakebed::pipelines
