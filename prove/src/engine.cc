// SPDX-License-Identifier: Apache-2.0
#include "facetwise/bsdf.h"

namespace facetwise::prove {
namespace {

class OfEngine : public Bsdf {
 public:
  OfEngine(std::string name, std::unique_ptr<Engine> engine, const Model& model, Sampler sampler, float eta)
      : name_(std::move(name)), engine_(std::move(engine)), model_(model), sampler_(sampler), eta_(eta) {}

  std::string name() const override { return name_; }

  absl::Status sample(Lanes& lanes) override {
    Batch batch = batch_of(lanes);
    batch.u1 = lanes.u1, batch.u2 = lanes.u2, batch.u3 = lanes.u3;
    batch.out.outgoing = {lanes.ox, lanes.oy, lanes.oz};
    batch.out.pdf = lanes.pdf, batch.out.weight = lanes.weight;
    return engine_->run(transmits() ? Operation::sample_scattering : Operation::sample_reflection, batch).status();
  }
  absl::Status evaluate(Lanes& lanes) override {
    Batch batch = batch_of(lanes);
    batch.outgoing = {lanes.ox, lanes.oy, lanes.oz};
    batch.out.pdf = lanes.pdf, batch.out.value = lanes.value;
    return engine_->run(transmits() ? Operation::evaluate_scattering : Operation::evaluate_reflection, batch).status();
  }

 private:
  bool transmits() const { return model_.interface == Interface::dielectric; }
  Batch batch_of(const Lanes& lanes) const {
    Batch batch;
    batch.model = model_;
    batch.sampler = sampler_;
    batch.lanes = lanes.count();
    batch.incident = {lanes.ix, lanes.iy, lanes.iz};
    batch.alpha_x = lanes.alpha_x, batch.alpha_y = lanes.alpha_y;
    if (transmits()) batch.eta = eta_;
    if (model_.interface == Interface::schlick) batch.f0 = 0.5f;
    return batch;
  }

  const std::string name_;
  const std::unique_ptr<Engine> engine_;
  const Model model_;
  const Sampler sampler_;
  const float eta_;
};

}  // namespace

std::unique_ptr<Bsdf> of_engine(std::string name, std::unique_ptr<Engine> engine, const Model& model, Sampler sampler,
                                float eta) {
  return std::make_unique<OfEngine>(std::move(name), std::move(engine), model, sampler, eta);
}

}  // namespace facetwise::prove
