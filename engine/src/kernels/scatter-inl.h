// SPDX-License-Identifier: Apache-2.0
// A dielectric's two events at a microfacet: reflection and transmission (Walter 2007), chosen by u3 or forced to
// transmit.
//
// c = i.m; g = eta cos of the refracted direction; F the reflectance. The refracted direction is
// o = (-i + (c - g) m) / eta, where c - g = (1 - eta^2) / (c + g) does not cancel, and
// p(o) = p(m) eta^2 |o.m| / (i.m + eta o.m)^2 = p(m) eta g / (c - g)^2.

#if defined(FACETWISE_SCATTER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SCATTER_INL_H_
#undef FACETWISE_SCATTER_INL_H_
#else
#define FACETWISE_SCATTER_INL_H_
#endif

#include "src/kernels/inputs-inl.h"
#include "src/kernels/output-inl.h"
#include "src/kernels/sampler-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// A microfacet normal m seen from i: its reflectance, and where refraction goes.
template <class D>
struct Refraction {
  using V = Vec<D>;
  V f, g, bend;  // bend: c - g
  HWY_INLINE Refraction(D d, V c, V eta) {
    f = DielectricReflectance(d, c, eta, g);
    bend = (Set(d, 1.0f) - eta) * (Set(d, 1.0f) + eta) / Max(c + g, Set(d, 0x1p-40f));
  }
  // A component of the refracted direction.
  HWY_INLINE V Direction(V i, V m, V inverse_eta) const { return Fms(bend, m, i) * inverse_eta; }
};

// Lanes with eta = 1 go straight on, like smooth ones.
template <class D>
HWY_INLINE Mask<D> Unbent(D d, const Tile& tile, std::size_t lane) {
  return LoadU(d, tile.in[kEta] + lane) == Set(d, 1.0f);
}

// sample_scattering and sample_transmission.
template <class D, class S, class Drawer>
struct Scatter {
  using V = Vec<D>;
  SampleInputs<D, S, Drawer::kUsesU3> in;
  V u3;

  HWY_INLINE Scatter(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane), u3(in.u3) {
    if (!tile.transmits) u3 = LoadU(d, tile.in[kU3] + lane);
  }
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    return in.AllOrdinary(d, tile, lane) && AllTrue(d, InUnitInterval(d, u3)) && AllFalse(d, Unbent(d, tile, lane));
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    const V loaded_eta = LoadU(d, tile.in[kEta] + lane);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in, [&](LaneClasses<D>& classes) {
      classes.valid = And(classes.valid, InUnitInterval(d, u3));
      classes.smooth = And(classes.valid, Or(classes.smooth, Unbent(d, tile, lane)));
    });
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);
    const V eta = exceptions.Computable(loaded_eta, 1.5f), inverse_eta = one / eta;

    Drawn<D> drawn;
    V u = exceptions.Computable(u3, 0.0f);
    Drawer::Draw(d, i, exceptions.Computable(in.u1, 0.0f), exceptions.Computable(in.u2, 0.0f), u, drawn);
    if (tile.transmits) u = zero;

    const Normal m(d, drawn);
    const Reflected r(d, i, drawn);
    const Refracted t(d, i, m, eta, inverse_eta);
    const Choice choice(d, tile, m, r, t, u);
    // Where nothing is refracted the occluded direction is the reflection's.
    const auto bends = AndNot(choice.reflects, And(m.seen, t.refraction.g > zero));
    const V oz = Select(bends, t.z, r.z);

    V pdf = zero;
    if (tile.wanted & kWantsPdf) pdf = Density(d, i, drawn, m, r, t, choice, eta);
    Store(d, tile, kOutPdf, lane, exceptions.Output(pdf, zero));
    const V radiance = tile.importance ? one : inverse_eta * inverse_eta;
    const Mirror mirror(d, in, tile, loaded_eta, u3);
    if (tile.wanted & kWantsWeight)
      Store(d, tile, kOutWeight, lane,
            exceptions.Output(Weight(d, tile, i, drawn, m, r, t, choice, inverse_eta, radiance), mirror.weight));

    V out_x = Select(bends, t.x, r.x), out_y = Select(bends, t.y, r.y), mirror_x = mirror.x, mirror_y = mirror.y;
    V out_mx = m.x, out_my = m.y;
    Turn(d, tile, Not(bends), out_x, out_y);
    Turn(d, tile, Not(bends), out_mx, out_my);
    Turn(d, tile, mirror.reflects, mirror_x, mirror_y);
    in.Out(out_x, out_y);
    in.Out(out_mx, out_my);
    in.Out(mirror_x, mirror_y);
    Store(d, tile, kOutOx, lane, exceptions.Output(out_x, mirror_x));
    Store(d, tile, kOutOy, lane, exceptions.Output(out_y, mirror_y));
    Store(d, tile, kOutOz, lane, exceptions.Output(oz, mirror.z));
    Store(d, tile, kOutMx, lane, exceptions.Output(out_mx, zero));
    Store(d, tile, kOutMy, lane, exceptions.Output(out_my, zero));
    Store(d, tile, kOutMz, lane, exceptions.Output(m.z, one));
    Store(d, tile, kOutIm, lane, exceptions.Output(m.c, in.z));
    Store(d, tile, kOutBranch, lane, exceptions.Output(choice.branch, mirror.branch));
    const V scale_t = tile.importance ? one : loaded_eta * loaded_eta;
    const auto transmits = And(choice.accepted, Not(choice.reflects));
    Store(d, tile, kOutEtaScale, lane,
          exceptions.Output(Select(transmits, scale_t, one), Select(mirror.reflects, one, scale_t)));
    if (tile.event != nullptr) {
      const V event = exceptions.Output(IfThenElseZero(transmits, one), IfThenElseZero(Not(mirror.reflects), one));
      const Rebind<int32_t, D> di;
      const Rebind<uint8_t, D> db;
      StoreU(DemoteTo(db, ConvertTo(di, event)), db, tile.event + lane);
    }
    exceptions.Finish(tile, lane, Not(choice.accepted), statistics);
  }

 private:
  // The microfacet normal, c = i.m, and whether i sees it.
  struct Normal {
    V x, y, z, c;
    Mask<D> seen;
    HWY_INLINE Normal(D d, const Drawn<D>& drawn) {
      const V one = Set(d, 1.0f), inverse_length = one / Sqrt(drawn.mm);
      x = drawn.mx * inverse_length;
      y = drawn.my * inverse_length;
      z = drawn.mz * inverse_length;
      c = Min(Max(drawn.im, Set(d, kSmallestIm)) * inverse_length, one);
      seen = drawn.im > (Drawer::kVisible ? Zero(d) : Set(d, kSmallestIm));
      if constexpr (Drawer::kVisible) seen = Not(NoLanes(d));
    }
  };
  // Where each event goes.
  struct Reflected {
    V rho, x, y, z;
    HWY_INLINE Reflected(D d, const Incident<D, S>& i, const Drawn<D>& drawn) {
      rho = (drawn.im + drawn.im) / drawn.mm;
      if constexpr (!Drawer::kUnit) rho = Max(rho, Set(d, kSmallestRho<S>));
      x = Fms(rho, drawn.mx, i.x);
      y = Fms(rho, drawn.my, i.y);
      z = Fms(rho, drawn.mz, i.z);
    }
  };
  struct Refracted {
    Refraction<D> refraction;
    V x, y, z;
    HWY_INLINE Refracted(D d, const Incident<D, S>& i, const Normal& m, V eta, V inverse_eta)
        : refraction(d, m.c, eta) {
      x = refraction.Direction(i.x, m.x, inverse_eta);
      y = refraction.Direction(i.y, m.y, inverse_eta);
      z = refraction.Direction(i.z, m.z, inverse_eta);
      // A small eta makes the length inexact.
      const V scale = NegFma(Set(d, 0.5f), Dot(x, y, z, x, y, z), Set(d, 1.5f));
      x = x * scale;
      y = y * scale;
      z = z * scale;
    }
  };
  // Which of them happens: in proportion to F and 1 - F of what ends on its side.
  struct Choice {
    V total, branch;
    Mask<D> reflects, accepted;
    HWY_INLINE Choice(D d, const Tile& tile, const Normal& m, const Reflected& r, const Refracted& t, V u) {
      const V zero = Zero(d), one = Set(d, 1.0f);
      const auto reflectable = And(m.seen, r.z > zero);
      const auto refractable = And(And(m.seen, t.z < zero), t.refraction.g > zero);
      V reflected = IfThenElseZero(reflectable, t.refraction.f);
      const V transmitted = IfThenElseZero(refractable, one - t.refraction.f);
      if (tile.transmits) reflected = zero;
      total = reflected + transmitted;
      // A chosen event is a valid one, however u total rounds.
      reflects = And(Or(u * total < reflected, transmitted <= zero), Not(Forced(d, tile)));
      accepted = total > zero;
      branch = IfThenElseZero(accepted, Select(reflects, reflected, transmitted) / total);
    }
  };

  static HWY_INLINE V Density(D d, const Incident<D, S>& i, const Drawn<D>& drawn, const Normal& m, const Reflected& r,
                              const Refracted& t, const Choice& choice, V eta) {
    const V one = Set(d, 1.0f), four = Set(d, 4.0f), largest = Set(d, kLargestDensity);
    V numerator, denominator;
    Drawer::Density(d, i, drawn, r.rho, numerator, denominator);
    denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay) * drawn.two_n * denominator;
    const Refraction<D>& refraction = t.refraction;
    const V bent = four * m.c * eta * (refraction.g / (refraction.bend * refraction.bend));
    const V jacobian = Select(choice.reflects, one, bent);
    return IfThenElseZero(choice.accepted,
                          Min(Min(numerator / denominator, largest) * jacobian * choice.branch, largest));
  }

  static HWY_INLINE V Weight(D d, const Tile& tile, const Incident<D, S>& i, const Drawn<D>& drawn, const Normal& m,
                             const Reflected& r, const Refracted& t, const Choice& choice, V inverse_eta, V radiance) {
    const V reflected = S::Masking::template Weight<Drawer>(d, i, drawn, r.x, r.y, r.z, tile.uncorrelated);
    V transmitted = S::Masking::TransmissionMasking(d, i, m.z, m.c, t.refraction.g * inverse_eta, t.x, t.y, t.z);
    if constexpr (Drawer::kOwnShift) {
      if (!i.all_front) transmitted = transmitted * S::Masking::OverVisible(d, i, drawn);
    } else if constexpr (!Drawer::kNIsSigma) {
      V numerator = drawn.two_n;
      if constexpr (S::Distribution::kShifts && !Drawer::kShifted)
        if (!i.all_front) numerator = numerator * Exp(d, i.shift);
      transmitted = transmitted * (numerator / S::Masking::VisibleTwoN(d, i, m.z, m.c));
    }
    // F over its probability is `total`; so is 1 - F over the other. A forced event keeps 1 - F.
    const V weight = Select(choice.reflects, reflected, transmitted * radiance) * choice.total;
    return Min(IfThenElseZero(choice.accepted, weight), Set(d, kLargestDensity));
  }

  static HWY_INLINE Mask<D> Forced(D d, const Tile& tile) { return tile.transmits ? Not(NoLanes(d)) : NoLanes(d); }
  static HWY_INLINE void Turn(D d, const Tile& tile, Mask<D> lanes, V& x, V& y) {
    if (!tile.retro) return;
    const V sign = IfThenElseZero(lanes, SignBit(d));
    x = Xor(x, sign);
    y = Xor(y, sign);
  }

  // What a smooth lane does: the same choice at m = n.
  struct Mirror {
    V x, y, z, weight, branch;
    Mask<D> reflects;
    template <class In>
    HWY_INLINE Mirror(D d, const In& in, const Tile& tile, V eta, V u) {
      const V zero = Zero(d), one = Set(d, 1.0f), inverse_eta = one / eta;
      const auto front = in.z > zero;
      const Refraction<D> refraction(d, in.z, eta);
      V reflected = IfThenElseZero(front, refraction.f);
      const V transmitted = IfThenElseZero(And(front, refraction.g > zero), one - refraction.f);
      if (tile.transmits) reflected = zero;
      const V total = reflected + transmitted;
      reflects = Or(And(Not(Forced(d, tile)), u * total < reflected), transmitted <= zero);
      x = Select(reflects, Neg(in.x), Neg(in.x) * inverse_eta);
      y = Select(reflects, Neg(in.y), Neg(in.y) * inverse_eta);
      z = Select(reflects, in.z, Neg(refraction.g) * inverse_eta);
      const V radiance = tile.importance ? one : inverse_eta * inverse_eta;
      weight = total * Select(reflects, one, radiance);
      branch = IfThenElseZero(total > zero, Select(reflects, reflected, transmitted) / total);
    }
  };
};

// evaluate_scattering and evaluate_transmission.
template <class D, class S, class Drawer>
struct ScatterQuery {
  using V = Vec<D>;
  using Distribution = typename S::Distribution;
  QueryInputs<D, S> in;

  HWY_INLINE ScatterQuery(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    return in.AllOrdinary(d, tile, lane) && AllFalse(d, Unbent(d, tile, lane));
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f), four = Set(d, 4.0f), largest = Set(d, kLargestDensity);
    const V loaded_eta = LoadU(d, tile.in[kEta] + lane);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in, [&](LaneClasses<D>& classes) {
      classes.smooth = And(classes.valid, Or(classes.smooth, Unbent(d, tile, lane)));
    });
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);
    const V eta = exceptions.Computable(loaded_eta, 1.5f), inverse_eta = one / eta;
    V x = exceptions.Computable(in.ox, 0.0f), y = exceptions.Computable(in.oy, 0.0f);
    const V z = exceptions.Computable(in.oz, 1.0f);
    const auto reflects = z > zero;
    if (tile.retro) {
      const V sign = IfThenElseZero(reflects, SignBit(d));
      x = Xor(x, sign);
      y = Xor(y, sign);
    }

    // m ~ i + o, or i + eta o turned upwards.
    const V index = Select(reflects, one, eta);
    V hx = Fma(index, x, i.x), hy = Fma(index, y, i.y), hz = Fma(index, z, i.z);
    const auto straight = hz > zero;
    const V upwards = And(hz, SignBit(d));
    const V h2 = Dot(hx, hy, hz, hx, hy, hz);
    hx = Xor(hx, upwards);
    hy = Xor(hy, upwards);
    hz = Xor(hz, upwards);
    const V dot_i = Dot(hx, hy, hz, i.x, i.y, i.z), dot_o = Dot(hx, hy, hz, x, y, z);
    // A reflection's half vector points up and faces both; o = -i has none.
    auto reached = Select2(reflects, And(straight, h2 > Set(d, 0x1p-40f)),
                           And(And(And(z<zero, hz> zero), And(dot_i > zero, dot_o < zero)), h2 > Set(d, 1e-30f)));
    if (tile.transmits) reached = And(reached, Not(reflects));

    const V length2 = Select(reached, h2, one);
    const V inverse_length = one / Sqrt(length2);
    const V mx = IfThenElseZero(reached, hx * inverse_length), my = IfThenElseZero(reached, hy * inverse_length);
    const V mz = Select(reached, hz * inverse_length, one);
    const V c = Min(Select(reached, Select(reflects, Set(d, 0.5f) * length2, dot_i) * inverse_length, one), one);
    const V om = Abs(dot_o) * inverse_length;

    const Refraction<D> refraction(d, c, eta);
    // The event that o means is valid; is the other?
    const V rz = Fms(c + c, mz, i.z), tz = refraction.Direction(i.z, mz, inverse_eta);
    const V f = refraction.f, rest = one - f;
    const V reflected = IfThenElseZero(Or(reflects, rz > zero), f);
    const V transmitted = IfThenElseZero(Or(Not(reflects), And(refraction.g > zero, tz < zero)), rest);
    V branch = one;
    if (!tile.transmits) {
      const V total = reflected + transmitted;
      branch = IfThenElseZero(total > zero, Select(reflects, reflected, transmitted) / total);
    }
    branch = IfThenElseZero(reached, branch);

    const V density = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, one, i.shift));
    const V denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay);
    // p(o) over that of a reflection: 4 c eta^2 |o.m| / |i + eta o|^2
    const V jacobian = Select(reflects, one, four * c * (eta * eta) * om / length2);

    if (tile.wanted & kWantsPdf) {
      V numerator = density, two_n;
      SampledDensity<Drawer>(d, i, mx, my, mz, one, c, reached, numerator, two_n);
      const V pdf = Min(Min(numerator / (denominator * two_n), largest) * jacobian * branch, largest);
      Store(d, tile, kOutPdf, lane, exceptions.Output(pdf, zero));
    }
    if (tile.wanted & kWantsValue) {
      V two_n, w;
      S::Masking::Value(d, i, mz, c, x, y, z, tile.uncorrelated, two_n, w);
      const V reflection = Min(density / (denominator * two_n), largest) * IfThenElseZero(reflects, w) * f;
      const V masking = S::Masking::TransmissionMasking(d, i, mz, c, om, x, y, z);
      const V radiance = tile.importance ? one : inverse_eta * inverse_eta;
      const V transmission = Min(density / (denominator * S::Masking::VisibleTwoN(d, i, mz, c)), largest) * jacobian *
                             (masking * rest * radiance);
      const V value = Min(IfThenElseZero(reached, Select(reflects, reflection, transmission)), largest);
      Store(d, tile, kOutValue, lane, exceptions.Output(value, zero));
    }
    Store(d, tile, kOutBranch, lane, exceptions.Output(branch, zero));
    // A reflection that no microfacet makes is not an occluded one, as in pdf_reflection.
    auto answered = Or(reflects, reached);
    if (tile.transmits) answered = reached;
    exceptions.Finish(tile, lane, Not(answered), statistics);
  }

 private:
  static HWY_INLINE Mask<D> Select2(Mask<D> which, Mask<D> yes, Mask<D> no) {
    return Or(And(which, yes), AndNot(which, no));
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
