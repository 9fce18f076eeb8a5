// SPDX-License-Identifier: Apache-2.0
// What is sampled and how: distribution, masking, shadowing, sampler, lane status.
//
// Conventions, everywhere in facetwise. Directions are unit vectors in the local frame (z is the shading
// normal n) that point away from the surface: `i` incident (the known one), `o` outgoing (the sampled
// one), `m` microfacet normal (m_z > 0). Roughness alpha_x, alpha_y is the distribution's own parameter,
// never its square or its root: see alpha_from_perceptual(). i_z <= 0 is legal: a shading normal that
// faces away, as normal mapping makes it, never the other side of the surface.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace facetwise {

class SlopeTable;  // slope_table.h

// Distribution of microfacet normals (NDF), by its density of slopes (x, y) = (-m_x / m_z, -m_y / m_z). With
// r^2 = (x / alpha_x)^2 + (y / alpha_y)^2:
enum class Distribution : std::uint8_t {
  ggx = 0,        // 1 / (pi ax ay (1 + r^2)^2): Walter et al. 2007, Eq. 33; anisotropic as in Heitz 2014, Eq. 85
  beckmann = 1,   // exp(-r^2) / (pi ax ay): Heitz 2014, Eq. 83
  student_t = 2,  // 8 / (pi ax ay (2 + r^2)^3): Ribardiere et al. 2017 with gamma = 3, between the two above
  phong = 3,      // D = m_z^n / (pi ax ay), n = (2 / ax^2) cos^2 + (2 / ay^2) sin^2 - 2 of m's azimuth: Ashikhmin &
                  // Shirley 2000. alpha up to 1 (n >= 0). Its projected area has no closed form: V-cavity only
  table = 4,      // Model::table, stretched by alpha
};

// Masking function G1.
enum class Masking : std::uint8_t {
  smith = 0,    // Heitz 2014, Eq. 43: G1(i) = i_z / projected_area(i)
  vcavity = 1,  // min(2 m_z |i_z| / i.m, 1): Cook & Torrance 1982; single-sided behind, Tokuyoshi 2021, Eq. 3.
                // Behind (i_z < 0) phong has no exact sampler: its normals are weighted (docs/models.md)
};

// Masking-shadowing function G2 of Smith, used by evaluation and by weights. V-cavity takes the smaller of
// the two directions' maskings.
enum class Shadowing : std::uint8_t {
  correlated = 0,    // height-correlated, 1 / (1 + Lambda(i) + Lambda(o)): Heitz 2014, Eq. 99
  uncorrelated = 1,  // G1(i) G1(o)
};

// What densities of visible normals are divided by where i_z < 0.
enum class Normalisation : std::uint8_t {
  unbiased = 0,  // the visible projected area: Tokuyoshi 2021, Eq. 1
  biased = 1,    // that of |i_z| instead of i_z, as if all were hit: the older practice, whose densities integrate
                 // to less than one. Changes pdf, weight and value, not the samples
};

// What happens at a microfacet.
enum class Interface : std::uint8_t {
  conductor = 0,   // reflects all: F = 1
  schlick = 1,     // reflects F = f0 + (f90 - f0) (1 - i.m)^5: Schlick 1994
  dielectric = 2,  // reflects by Fresnel's equations with eta = eta_o / eta_i, and transmits the rest: Walter 2007
};

// What transmission carries: radiance is scaled by 1 / eta^2 on its way, importance is not (Veach 1997, section 5.2).
enum class Transport : std::uint8_t { radiance = 0, importance = 1 };

// What is added for the light that is scattered more than once between microfacets, which single scattering loses.
enum class Compensation : std::uint8_t {
  none = 0,
  // Weights and values times 1 + F0 (1 - E(i)) / E(i), E the directional albedo: Turquin 2019. Right in sum for F0 = 1; not
  // reciprocal. Of a dielectric, which absorbs nothing: times 1 / (reflected and transmitted albedo). Without a mean slope.
  turquin = 1,
  // A further lobe, F_ms (1 - E(i)) (1 - E(o)) / (pi (1 - mean E)): Kelemen & Szirmay-Kalos 2001. Reciprocal, and right in
  // sum for F0 = 1. F_ms: the reflectance of light scattered again and again by the mean F (Kulla & Conty 2017). Samples take
  // it with probability 1 - E(i), by u3. Of reflections by conductors and schlick; sample_normal does not know it.
  kelemen = 2,
};

// How directions are drawn. u1, u2, u3 are uniform in [0, 1); phi = 2 pi u2.
// Stretched incident direction: (alpha_x i_x, alpha_y i_y, i_z) / nu, its z called c.
//
//   ndf      normals with density D(m) m_z, whatever i is (Walter 2007; Heitz & d'Eon 2014, section 3). GGX:
//            m ~ (alpha_x sqrt(u1) cos phi, alpha_y sqrt(u1) sin phi, sqrt(1 - u1)).
//   visible  visible normals by each model's own routine: `cap` for GGX with Smith masking, slope inversion for
//            Beckmann and Student-t (Heitz & d'Eon 2014, section 4), tables (section 5), flipping for V-cavity.
//   heitz    visible normals by the projected hemisphere (Heitz 2018), r = sqrt(u1). GGX with Smith masking.
//   cap      visible normals by a spherical cap (Dupuy & Benyoub 2023): o_z of the stretched frame is
//            1 - u1 (1 + c). GGX with Smith masking.
//   bounded  reflections by a smaller cap (Eto & Tokuyoshi 2023, Eq. 5, 6): 1 - u1 (1 + k c). GGX with Smith masking.
//   exact    reflections by the visible normals whose reflection is not occluded: for GGX in exact proportion, for
//            Beckmann and for V-cavity nearly so. facetwise's own, docs/math.md. Uses u3 too.
//
// `bounded` and `exact` are for reflections only; for i_z <= 0 both are `visible`.
enum class Sampler : std::uint8_t { ndf = 0, heitz = 1, cap = 2, bounded = 3, exact = 4, visible = 5 };

struct Model {
  Distribution distribution = Distribution::ggx;
  Masking masking = Masking::smith;
  Shadowing shadowing = Shadowing::correlated;
  Normalisation normalisation = Normalisation::unbiased;
  Interface interface = Interface::conductor;
  Transport transport = Transport::radiance;
  Compensation compensation = Compensation::none;
  // Retro-reflection by the back-vector (Raab 2025): reflects as if i were (-i_x, -i_y, i_z). The normals and i.m
  // returned are those of the turned i. What a dielectric transmits is not turned.
  bool retro = false;
  std::shared_ptr<const SlopeTable> table{};  // of Distribution::table
};

// What became of a lane.
//   accepted  the outputs are a sample, or the answer to a query.
//   occluded  a reflection goes below the surface (o_z <= 0), a transmission above it (o_z >= 0) or nowhere (total
//             internal reflection), or the normal faces away from i (`ndf`). The direction is returned; pdf, weight
//             and value are 0.
//   smooth    a principal roughness is in [0, 1e-4): a mirror or a window. The mirror direction (-i_x, -i_y, i_z), or
//             the refracted one, and the normal (0, 0, 1) are returned with pdf 0, since the density is a delta.
//             The weight is the delta's own (F or 1 - F, 1 for a conductor) where i_z > 0, else 0; value is 0;
//             masking has the limit's values. So is a transmission with eta = 1, which goes straight on.
//   invalid   an input is NaN or infinite, alpha < 0 or a principal roughness above the distribution's largest (10;
//             Phong 1), |slope_correlation| >= 1, a mean slope beyond +-100, eta outside [0.01, 100], f0 or f90 outside
//             [0, 1], u outside [0, 1), or a direction is not of unit length (| |v|^2 - 1 | > 1e-3; inside that it is
//             used as it is). All outputs are 0.
enum class LaneStatus : std::uint8_t { accepted = 0, occluded = 1, smooth = 2, invalid = 3 };

// What a scattering sample did at its microfacet.
enum class Event : std::uint8_t { reflection = 0, transmission = 1 };

inline constexpr float kSmallestAlpha = 1e-4f;  // below it a lane is smooth
inline constexpr float kLargestAlpha = 10.0f;   // above it a lane is invalid
inline constexpr float kLargestPhongAlpha = 1.0f;
inline constexpr float kLargestMeanSlope = 100.0f;
inline constexpr float kSmallestEta = 0.01f, kLargestEta = 100.0f;

// alpha of a "perceptual" roughness in [0, 1] as artists set it (Burley 2012): its square.
constexpr float alpha_from_perceptual(float roughness) { return roughness * roughness; }

// Names as used in flags, JSON and docs. parse_ returns nothing for an unknown name.
std::string_view name(Distribution);
std::string_view name(Masking);
std::string_view name(Shadowing);
std::string_view name(Normalisation);
std::string_view name(Interface);
std::string_view name(Transport);
std::string_view name(Compensation);
std::string_view name(Sampler);
std::string_view name(LaneStatus);
std::optional<Distribution> parse_distribution(std::string_view);
std::optional<Masking> parse_masking(std::string_view);
std::optional<Shadowing> parse_shadowing(std::string_view);
std::optional<Normalisation> parse_normalisation(std::string_view);
std::optional<Interface> parse_interface(std::string_view);
std::optional<Transport> parse_transport(std::string_view);
std::optional<Compensation> parse_compensation(std::string_view);
std::optional<Sampler> parse_sampler(std::string_view);

// All samplers, in the enumeration's order.
std::span<const Sampler> all_samplers();

// True for samplers that draw normals (all but bounded and exact): those that sample_normal takes.
bool samples_normals(Sampler);
// True for samplers that read u3 with this model: with kelemen all do.
bool uses_u3(const Model&, Sampler);

}  // namespace facetwise
