// The batch's float columns as a table. The order is that of tile.h's indices.
#include <array>

#include "facetwise/batch.h"
#include "src/tile.h"

namespace facetwise {
namespace {

using enum Operation;

constexpr unsigned kReflected = bit(sample_reflection), kTransmitted = bit(sample_transmission) | bit(sample_scattering);
constexpr unsigned kSample = bit(sample_normal) | kReflected | kTransmitted;
constexpr unsigned kSides = bit(evaluate_transmission) | bit(evaluate_scattering);
constexpr unsigned kQuery = bit(pdf_reflection) | bit(evaluate_reflection) | bit(evaluate_and_pdf) | kSides;
constexpr unsigned kEvery = kSample | kQuery | bit(masking);
constexpr unsigned kFresnel = kEvery & ~(bit(sample_normal) | bit(pdf_reflection) | bit(masking));

constexpr std::array<InputField, kInputs> kInputFields = {{
    {"incident.x", [](Batch& b) -> Column<float>& { return b.incident.x; }, kEvery, {}},
    {"incident.y", [](Batch& b) -> Column<float>& { return b.incident.y; }, kEvery, {}},
    {"incident.z", [](Batch& b) -> Column<float>& { return b.incident.z; }, kEvery, {}},
    {"alpha_x", [](Batch& b) -> Column<float>& { return b.alpha_x; }, kEvery, {}},
    {"alpha_y", [](Batch& b) -> Column<float>& { return b.alpha_y; }, kEvery, {}},
    {"mean_slope_x", [](Batch& b) -> Column<float>& { return b.mean_slope_x; }, kEvery, 0.0f},
    {"mean_slope_y", [](Batch& b) -> Column<float>& { return b.mean_slope_y; }, kEvery, 0.0f},
    {"slope_correlation", [](Batch& b) -> Column<float>& { return b.slope_correlation; }, kEvery, 0.0f},
    {"eta", [](Batch& b) -> Column<float>& { return b.eta; }, kFresnel, {}},
    {"f0", [](Batch& b) -> Column<float>& { return b.f0; }, kFresnel & ~(kTransmitted | kSides), {}},
    {"f90", [](Batch& b) -> Column<float>& { return b.f90; }, kFresnel & ~(kTransmitted | kSides), 1.0f},
    {"outgoing.x", [](Batch& b) -> Column<float>& { return b.outgoing.x; }, kQuery, {}},
    {"outgoing.y", [](Batch& b) -> Column<float>& { return b.outgoing.y; }, kQuery, {}},
    {"outgoing.z", [](Batch& b) -> Column<float>& { return b.outgoing.z; }, kQuery, {}},
    {"u1", [](Batch& b) -> Column<float>& { return b.u1; }, kSample, {}},
    {"u2", [](Batch& b) -> Column<float>& { return b.u2; }, kSample, {}},
    {"u3", [](Batch& b) -> Column<float>& { return b.u3; }, kSample, {}},
}};

constexpr unsigned kDirection = kReflected | kTransmitted;
constexpr unsigned kPdf = kSample | bit(pdf_reflection) | bit(evaluate_and_pdf) | kSides;
constexpr unsigned kValue = bit(evaluate_reflection) | bit(evaluate_and_pdf) | kSides;

constexpr std::array<OutputField, kOutputs> kOutputFields = {{
    {"out.outgoing.x", [](Batch& b) -> OutputColumn<float>& { return b.out.outgoing.x; }, kDirection},
    {"out.outgoing.y", [](Batch& b) -> OutputColumn<float>& { return b.out.outgoing.y; }, kDirection},
    {"out.outgoing.z", [](Batch& b) -> OutputColumn<float>& { return b.out.outgoing.z; }, kDirection},
    {"out.normal.x", [](Batch& b) -> OutputColumn<float>& { return b.out.normal.x; }, kSample},
    {"out.normal.y", [](Batch& b) -> OutputColumn<float>& { return b.out.normal.y; }, kSample},
    {"out.normal.z", [](Batch& b) -> OutputColumn<float>& { return b.out.normal.z; }, kSample},
    {"out.incident_dot_normal", [](Batch& b) -> OutputColumn<float>& { return b.out.incident_dot_normal; },
     kSample},
    {"out.pdf", [](Batch& b) -> OutputColumn<float>& { return b.out.pdf; }, kPdf},
    {"out.weight", [](Batch& b) -> OutputColumn<float>& { return b.out.weight; }, kDirection},
    {"out.value", [](Batch& b) -> OutputColumn<float>& { return b.out.value; }, kValue},
    {"out.masking", [](Batch& b) -> OutputColumn<float>& { return b.out.masking; }, bit(masking)},
    {"out.projected_area", [](Batch& b) -> OutputColumn<float>& { return b.out.projected_area; }, bit(masking)},
    {"out.share_unoccluded", [](Batch& b) -> OutputColumn<float>& { return b.out.share_unoccluded; },
     bit(masking)},
    {"out.branch_probability", [](Batch& b) -> OutputColumn<float>& { return b.out.branch_probability; },
     bit(sample_scattering) | bit(evaluate_scattering)},
    {"out.eta_scale", [](Batch& b) -> OutputColumn<float>& { return b.out.eta_scale; }, kTransmitted},
}};

constexpr std::array<ByteField, kByteOutputs> kByteFields = {{
    {"out.status", [](Batch& b) -> OutputColumn<std::uint8_t>& { return b.out.status; }, kEvery},
    {"out.event", [](Batch& b) -> OutputColumn<std::uint8_t>& { return b.out.event; }, bit(sample_scattering)},
}};

}  // namespace

std::span<const InputField> input_fields() { return kInputFields; }
std::span<const OutputField> output_fields() { return kOutputFields; }
std::span<const ByteField> byte_fields() { return kByteFields; }

Statistics& Statistics::operator+=(const Statistics& other) {
  accepted += other.accepted;
  occluded += other.occluded;
  smooth += other.smooth;
  invalid += other.invalid;
  return *this;
}

}  // namespace facetwise
