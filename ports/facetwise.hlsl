// SPDX-License-Identifier: Apache-2.0
// facetwise.hlsl: GGX reflection sampling that wastes no sample, to paste into a shader. Shader model 5.0 and later. The same
// as facetwise.hpp beside it, which says more. Made of facetwise.glsl by tests/ports/hlsl_from_glsl.py.
//
//   fw_sample_exact    reflections by the visible normals whose reflection is not occluded, in exact proportion: every sample
//                      leaves the surface. pdf = D(m) / (4 K), K the projected area of those normals. The facetwise project,
//                      docs/math.md, "The exact reflection sampler".
//   fw_sample_bounded  Eto & Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX Reflections".
//   fw_sample_cap      Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
//
// Conventions: unit vectors in the local frame (z is the shading normal) that point away from the surface; i is the known
// direction, o the sampled one. Roughness `alpha` (x, y) in [1e-4, 10], perceptual roughness squared. u uniform in [0, 1).
// i.z <= 0, a shading normal that faces away, is answered by visible normals (Tokuyoshi 2021).

struct FwSample {
  float3 o;
  float pdf;     // of o, 1/sr; 0 where o is occluded
  float weight;  // f cos(theta_o) / pdf with F = 1, Smith's height-correlated masking; 0 where o is occluded
};

static const float FW_PI = 3.14159265;
static const float FW_TINY = 8.7e-19;     // stands for 0 in quotients
static const float FW_HORIZON = 9.3e-10;  // a cosine of 0 where it is squared

// i stretched by the roughness: w, A = w_x^2 + w_y^2, nu = |w|, and twice the projected area, 2 sigma = w_z + nu.
struct FwStretched {
  float3 w;
  float a, nu, two_sigma;
};
FwStretched fw_stretch(float3 i, float2 alpha) {
  FwStretched s;
  s.w = float3(alpha * i.xy, i.z);
  s.a = dot(s.w.xy, s.w.xy);
  s.nu = sqrt(s.a + i.z * i.z);
  // Behind the surface w_z + nu cancels.
  s.two_sigma = i.z > 0.0 ? s.nu + i.z : max(s.a, 8.9e-16) / (s.nu - i.z);
  return s;
}

// The weight of visible normals, G2 / G1(i): nothing cancels.
float fw_shadowing(FwStretched s, float3 o, float2 alpha) {
  float2 xy = alpha * o.xy;
  float z = max(o.z, FW_TINY), a = dot(xy, xy);
  float lit = s.two_sigma * z * (z + sqrt(z * z + a));
  return lit / (lit + abs(s.w.z) * a);
}

// M = L m_hat -> o and what goes with it. two_n: 2 N of pdf = D / (4 N).
FwSample fw_reflect(float3 i, FwStretched s, float3 h, float2 alpha, float two_n, bool exact) {
  float3 m = float3(alpha * h.xy, h.z);
  float mm = dot(m, m), rho = 2.0 * max(dot(s.w, h), 5e-26) / mm;
  FwSample r;
  r.o = rho * m - i;
  r.pdf = r.weight = 0.0;
  if (exact) r.o.z = max(r.o.z, FW_HORIZON);  // rounding could put it below
  if (!(r.o.z > 0.0)) return r;
  float q = mm / dot(h, h);  // pi ax ay D = (M.M)^2 / |m_hat|^4
  r.pdf = min(q * q / (2.0 * FW_PI * alpha.x * alpha.y * two_n), 3e38);
  r.weight = fw_shadowing(s, r.o, alpha) * (two_n / s.two_sigma);
  return r;
}

// m_hat by a cap of the stretched frame that ends at `above` over -nu: t = nu + z - above.
float3 fw_half_vector(FwStretched s, float t, float above, float2 u) {
  float phi = 2.0 * FW_PI * u.y, height = t * u.x, radius = sqrt(max(height * (2.0 * s.nu - height), 0.0));
  return float3(radius * cos(phi) + s.w.x, radius * sin(phi) + s.w.y, max(t * (1.0 - u.x) + above, FW_TINY));
}

// Of `bounded`, i.z > 0: t and above.
float2 fw_bound(float3 i, FwStretched s, float2 alpha) {
  float a = alpha.x == alpha.y ? alpha.x : min(min(alpha.x, alpha.y), 1.0);
  float l = 1.0 + length(i.xy), s2 = l * l, z2 = i.z * i.z;
  float p = a > 1.0 ? z2 : s2, q = a > 1.0 ? s2 : z2, scale = i.z / (a * a * q + p);
  return float2(s.nu + (1.0 - a) * (1.0 + a) * p * scale, a * a * (s2 + z2) * scale);
}

// The elliptic cone of the normals m_hat whose reflection is not occluded, i.z > 0: lambda is the positive root of
//   lambda - i_z = w_x^2 / (lambda + i_z ax^2) + w_y^2 / (lambda + i_z ay^2), and (v, 1) the axis.
struct FwCone {
  float lambda;
  float2 p0, p, v;
  float n2, two_k;
};
FwCone fw_cone(float3 i, FwStretched s, float2 alpha) {
  FwCone c;
  c.p0 = i.z * alpha * alpha;
  float2 w2 = s.w.xy * s.w.xy;
  bool isotropic = alpha.x == alpha.y;
  // The root for isotropic roughness; else a lower bound, near it.
  float mean = isotropic ? c.p0.x : dot(w2, c.p0) / max(s.a, 8.9e-16);
  float difference = i.z - mean, root = sqrt((i.z + mean) * (i.z + mean) + 4.0 * s.a);
  float l = difference >= 0.0 ? 0.5 * (difference + root) : 2.0 * (i.z * mean + s.a) / (root - difference);
  // One Halley step is enough for alpha up to 1, three for alpha up to 10.
  float rough = max(alpha.x, alpha.y);
  int steps = isotropic ? 0 : rough > 4.0 ? 3 : rough > 1.0 ? 2 : 1;
  for (int step = 0; step < 3; ++step) {
    if (step >= steps) break;
    float2 r = 1.0 / (l + c.p0), x = w2 * r, x1 = x * r;
    float f = l - i.z - (x.x + x.y), f1 = x1.x + x1.y + 1.0, f2 = dot(x1, r);
    l -= f * f1 / (f1 * f1 + f * f2);
  }
  c.lambda = l;
  c.p = l + c.p0;
  c.v = s.w.xy / c.p;
  c.n2 = dot(c.v, c.v) + 1.0;
  c.two_k = 2.0 * l * l / (c.n2 * sqrt(c.p.x * c.p.y));
  return c;
}

float fw_pdf(float3 i, float3 o, float2 alpha, float two_n) {
  float3 h = i + o;
  if (!(o.z > 0.0) || !(h.z > 0.0) || dot(h, h) < 9.1e-13) return 0.0;
  float axy = alpha.x * alpha.y;
  float3 t = float3(h.x * alpha.y, h.y * alpha.x, h.z * axy);
  float q = dot(h, h) * axy * axy / dot(t, t);  // pi ax ay D, h of any length
  return min(q * q / (2.0 * FW_PI * axy * two_n), 3e38);
}

// Visible normals by a spherical cap. Some reflections are occluded: then pdf and weight are 0.
FwSample fw_sample_cap(float3 i, float2 alpha, float2 u) {
  FwStretched s = fw_stretch(i, alpha);
  return fw_reflect(i, s, fw_half_vector(s, s.two_sigma, 0.0, u), alpha, s.two_sigma, false);
}
float fw_pdf_cap(float3 i, float3 o, float2 alpha) { return fw_pdf(i, o, alpha, fw_stretch(i, alpha).two_sigma); }

// A smaller cap, which leaves out many of those that are occluded, not all.
FwSample fw_sample_bounded(float3 i, float2 alpha, float2 u) {
  if (!(i.z > 0.0)) return fw_sample_cap(i, alpha, u);
  FwStretched s = fw_stretch(i, alpha);
  float2 b = fw_bound(i, s, alpha);
  return fw_reflect(i, s, fw_half_vector(s, b.x, b.y, u), alpha, b.x, false);
}
float fw_pdf_bounded(float3 i, float3 o, float2 alpha) {
  if (!(i.z > 0.0)) return fw_pdf_cap(i, o, alpha);
  return fw_pdf(i, o, alpha, fw_bound(i, fw_stretch(i, alpha), alpha).x);
}

// Only normals whose reflection is not occluded.
FwSample fw_sample_exact(float3 i, float2 alpha, float3 u) {
  if (!(i.z > 0.0)) return fw_sample_cap(i, alpha, u.xy);
  FwStretched s = fw_stretch(i, alpha);
  FwCone c = fw_cone(i, s, alpha);
  float phi = 2.0 * FW_PI * u.y;
  float2 turn = float2(cos(phi), sin(phi));
  // A point of the cone's ellipse, uniformly.
  float2 xi = sqrt(c.lambda * u.x / c.p) * turn;
  // The point of the sphere above it along the axis is at y + zeta, its mirror image at zeta - y.
  float y = -dot(xi, c.v) / c.n2;
  float inside = dot(turn * turn / c.p, c.lambda * (1.0 - u.x) + c.p0);  // 1 - |xi|^2
  float zeta = sqrt(y * y + inside / c.n2);
  // One of the two, in proportion to w.m_hat.
  float g = c.lambda * zeta, facing = c.lambda * y + dot(xi, s.w.xy) + g;
  if (u.z * 2.0 * g >= facing) {
    xi = -xi;
    y = -y;
  }
  float z = max(zeta + y, FW_HORIZON);
  return fw_reflect(i, s, float3(z * c.v + xi, z), alpha, c.two_k, true);
}
float fw_pdf_exact(float3 i, float3 o, float2 alpha) {
  if (!(i.z > 0.0)) return fw_pdf_cap(i, o, alpha);
  return fw_pdf(i, o, alpha, fw_cone(i, fw_stretch(i, alpha), alpha).two_k);
}

// f cos(theta_o) with F = 1: the BRDF times the cosine.
float fw_evaluate(float3 i, float3 o, float2 alpha) {
  return fw_pdf_cap(i, o, alpha) * fw_shadowing(fw_stretch(i, alpha), o, alpha);
}

// K / sigma: the share of the visible normals whose reflection is not occluded, and so what `cap` keeps.
float fw_share_unoccluded(float3 i, float2 alpha) {
  if (!(i.z > 0.0)) return 1.0;
  FwStretched s = fw_stretch(i, alpha);
  return min(fw_cone(i, s, alpha).two_k / s.two_sigma, 1.0);
}
