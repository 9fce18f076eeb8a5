// The batch's float columns as a table. The order is that of tile.h's indices.
#include <array>

#include "facetwise/batch.h"
#include "src/tile.h"

namespace facetwise {
namespace {

using enum Operation;

constexpr unsigned kSample = bit(sample_normal) | bit(sample_reflection);
constexpr unsigned kReflection = bit(sample_reflection);
constexpr unsigned kQuery = bit(pdf_reflection) | bit(evaluate_reflection) | bit(evaluate_and_pdf);
constexpr unsigned kEvery = kSample | kQuery | bit(masking);

constexpr std::array<InputField, kInputs> kInputFields = {{
    {"incident.x", [](Batch& b) -> Column<float>& { return b.incident.x; }, kEvery},
    {"incident.y", [](Batch& b) -> Column<float>& { return b.incident.y; }, kEvery},
    {"incident.z", [](Batch& b) -> Column<float>& { return b.incident.z; }, kEvery},
    {"alpha_x", [](Batch& b) -> Column<float>& { return b.alpha_x; }, kEvery},
    {"alpha_y", [](Batch& b) -> Column<float>& { return b.alpha_y; }, kEvery},
    {"outgoing.x", [](Batch& b) -> Column<float>& { return b.outgoing.x; }, kQuery},
    {"outgoing.y", [](Batch& b) -> Column<float>& { return b.outgoing.y; }, kQuery},
    {"outgoing.z", [](Batch& b) -> Column<float>& { return b.outgoing.z; }, kQuery},
    {"u1", [](Batch& b) -> Column<float>& { return b.u1; }, kSample},
    {"u2", [](Batch& b) -> Column<float>& { return b.u2; }, kSample},
    {"u3", [](Batch& b) -> Column<float>& { return b.u3; }, kSample},
}};

constexpr std::array<OutputField, kOutputs> kOutputFields = {{
    {"out.outgoing.x", [](Batch& b) -> OutputColumn<float>& { return b.out.outgoing.x; }, kReflection},
    {"out.outgoing.y", [](Batch& b) -> OutputColumn<float>& { return b.out.outgoing.y; }, kReflection},
    {"out.outgoing.z", [](Batch& b) -> OutputColumn<float>& { return b.out.outgoing.z; }, kReflection},
    {"out.normal.x", [](Batch& b) -> OutputColumn<float>& { return b.out.normal.x; }, kSample},
    {"out.normal.y", [](Batch& b) -> OutputColumn<float>& { return b.out.normal.y; }, kSample},
    {"out.normal.z", [](Batch& b) -> OutputColumn<float>& { return b.out.normal.z; }, kSample},
    {"out.incident_dot_normal", [](Batch& b) -> OutputColumn<float>& { return b.out.incident_dot_normal; },
     kSample},
    {"out.pdf", [](Batch& b) -> OutputColumn<float>& { return b.out.pdf; },
     kSample | bit(pdf_reflection) | bit(evaluate_and_pdf)},
    {"out.weight", [](Batch& b) -> OutputColumn<float>& { return b.out.weight; }, kReflection},
    {"out.value", [](Batch& b) -> OutputColumn<float>& { return b.out.value; },
     bit(evaluate_reflection) | bit(evaluate_and_pdf)},
    {"out.masking", [](Batch& b) -> OutputColumn<float>& { return b.out.masking; }, bit(masking)},
    {"out.projected_area", [](Batch& b) -> OutputColumn<float>& { return b.out.projected_area; }, bit(masking)},
    {"out.share_unoccluded", [](Batch& b) -> OutputColumn<float>& { return b.out.share_unoccluded; },
     bit(masking)},
}};

}  // namespace

std::span<const InputField> input_fields() { return kInputFields; }
std::span<const OutputField> output_fields() { return kOutputFields; }

Statistics& Statistics::operator+=(const Statistics& other) {
  accepted += other.accepted;
  occluded += other.occluded;
  smooth += other.smooth;
  invalid += other.invalid;
  return *this;
}

}  // namespace facetwise
