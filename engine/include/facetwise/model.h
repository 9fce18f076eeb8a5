// What is sampled and how: distribution, masking, shadowing, sampler, lane status.
//
// Conventions, everywhere in facetwise. Directions are unit vectors in the local frame (z is the shading
// normal n) that point away from the surface: `i` incident (the known one), `o` outgoing (the sampled
// one), `m` microfacet normal (m_z > 0). Roughness alpha_x, alpha_y is the distribution's own parameter,
// never its square or its root: see alpha_from_perceptual(). i_z <= 0 is legal: a shading normal that
// faces away, as normal mapping makes it, never the other side of the surface.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace facetwise {

// Distribution of microfacet normals (NDF).
enum class Distribution : std::uint8_t {
  ggx = 0,  // Walter et al. 2007, Eq. 33 (Trowbridge-Reitz); anisotropic as in Heitz 2014, Eq. 85
};

// Masking function G1.
enum class Masking : std::uint8_t {
  smith = 0,  // Heitz 2014, Eq. 43: G1(i) = i_z / projected_area(i)
};

// Masking-shadowing function G2, used by evaluation and by weights.
enum class Shadowing : std::uint8_t {
  correlated = 0,    // height-correlated, 1 / (1 + Lambda(i) + Lambda(o)): Heitz 2014, Eq. 99
  uncorrelated = 1,  // G1(i) G1(o)
};

// How directions are drawn. u1, u2, u3 are uniform in [0, 1); phi = 2 pi u2 for all.
// Stretched incident direction: (alpha_x i_x, alpha_y i_y, i_z) / nu, its z called c.
//
//   ndf      normals with density D(m) m_z, whatever i is (Walter 2007; Heitz & d'Eon 2014, section 3):
//            m ~ (alpha_x sqrt(u1) cos phi, alpha_y sqrt(u1) sin phi, sqrt(1 - u1)).
//   heitz    visible normals by the projected hemisphere (Heitz 2018), r = sqrt(u1).
//   cap      visible normals by a spherical cap (Dupuy & Benyoub 2023): o_z of the stretched frame is
//            1 - u1 (1 + c). Also named `visible`.
//   bounded  reflections by a smaller cap (Eto & Tokuyoshi 2023, Eq. 5, 6): 1 - u1 (1 + k c).
//   exact    reflections by exactly the visible normals whose reflection is not occluded, in exact
//            proportion: facetwise's own, docs/math.md. Uses u3 too.
//
// `bounded` and `exact` are for reflections alone; for i_z <= 0 both are `cap`.
enum class Sampler : std::uint8_t { ndf = 0, heitz = 1, cap = 2, bounded = 3, exact = 4 };

struct Model {
  Distribution distribution = Distribution::ggx;
  Masking masking = Masking::smith;
  Shadowing shadowing = Shadowing::correlated;
};

// What became of a lane.
//   accepted  the outputs are a sample, or the answer to a query.
//   occluded  the reflection goes below the surface (o_z <= 0) or, for `ndf`, the normal faces away from
//             i. The direction is returned; pdf, weight and value are 0.
//   smooth    alpha_x or alpha_y is in (0, 1e-4): a mirror. The mirror direction (-i_x, -i_y, i_z) and the
//             normal (0, 0, 1) are returned with pdf 0, since the density is a delta. The weight is 1
//             (the delta's own) where i_z > 0, else 0; value is 0; masking has the limit's values.
//   invalid   an input is NaN or infinite, alpha <= 0 or > 10, u outside [0, 1), or a direction is not of
//             unit length (| |v|^2 - 1 | > 1e-3; inside that it is used as it is). All outputs are 0.
enum class LaneStatus : std::uint8_t { accepted = 0, occluded = 1, smooth = 2, invalid = 3 };

inline constexpr float kSmallestAlpha = 1e-4f;  // below it a lane is smooth
inline constexpr float kLargestAlpha = 10.0f;   // above it a lane is invalid

// alpha of a "perceptual" roughness in [0, 1] as artists set it (Burley 2012): its square.
constexpr float alpha_from_perceptual(float roughness) { return roughness * roughness; }

// Names as used in flags, JSON and docs. parse_ returns nothing for an unknown name; `visible` is `cap`.
std::string_view name(Distribution);
std::string_view name(Masking);
std::string_view name(Shadowing);
std::string_view name(Sampler);
std::string_view name(LaneStatus);
std::optional<Distribution> parse_distribution(std::string_view);
std::optional<Masking> parse_masking(std::string_view);
std::optional<Shadowing> parse_shadowing(std::string_view);
std::optional<Sampler> parse_sampler(std::string_view);

// All samplers, in the enumeration's order.
std::span<const Sampler> all_samplers();

// True for samplers that draw normals (ndf, heitz, cap): those that sample_normal takes.
bool samples_normals(Sampler);
// True for samplers that read u3 (exact).
bool uses_u3(Sampler);

}  // namespace facetwise
