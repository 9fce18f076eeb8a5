// SPDX-License-Identifier: Apache-2.0
// Tables of albedo as bytes and files, and those that the process keeps.
//
// The bytes (src/table/sealed.h): 8 of magic, the version, distribution, masking and shadowing as uint32, the id of the
// table of slopes as uint64, the seven sizes as uint32, four bytes of zero, the values.
#include "facetwise/albedo_table.h"

#include <cstring>
#include <mutex>

#include "absl/strings/str_cat.h"
#include "facetwise/slope_table.h"
#include "src/albedo/layout.h"
#include "src/tasks.h"
#include "src/table/sealed.h"

namespace facetwise {
namespace {

constexpr Seal kSeal = {{'f', 'w', 'a', 'l', 'b', 'e', 'd', '\x1a'}, 2, "albedo", "AlbedoTable"};
struct Header {
  char magic[8];
  std::uint32_t version, distribution, masking, shadowing;
  std::uint64_t slopes;
  AlbedoSizes sizes;
  std::uint32_t zero;
};
static_assert(sizeof(Header) == 64 && sizeof(AlbedoSizes) == 28);

template <class... Parts>
absl::Status invalid(const Parts&... parts) {
  return absl::InvalidArgumentError(absl::StrCat(parts...));
}

// A model's table, built by the first who asks.
struct Kept {
  std::mutex mutex;
  std::shared_ptr<const AlbedoTable> table;
};
class KeptTables {
 public:
  std::shared_ptr<Kept> of(const AlbedoTable::Key& key) {
    const std::lock_guard lock(mutex_);
    for (auto& [at, kept] : all_)
      if (at == key) return kept;
    return all_.emplace_back(key, std::make_shared<Kept>()).second;
  }
  void drop(std::uint64_t slopes) {
    const std::lock_guard lock(mutex_);
    std::erase_if(all_, [&](const auto& entry) { return entry.first.slopes == slopes; });
  }
  static KeptTables& instance() {
    static KeptTables tables;
    return tables;
  }

 private:
  std::mutex mutex_;
  std::vector<std::pair<AlbedoTable::Key, std::shared_ptr<Kept>>> all_;
};

}  // namespace

absl::Status check_sizes(const AlbedoSizes& sizes) {
  const auto check = [](std::initializer_list<std::uint32_t> used) {
    for (const std::uint32_t size : used)
      if (size < 2 || size > 1025) return invalid("sizes: ", size, " nodes, not 2 to 1025");
    return absl::OkStatus();
  };
  if (sizes.dielectric() && (sizes.ratio_v | sizes.ratio_a | sizes.ratio_r | sizes.ratio_t))
    return invalid("sizes: a dielectric has no ratios");
  const auto status = sizes.dielectric()
                          ? check({sizes.v, sizes.a, sizes.e})
                          : check({sizes.v, sizes.a, sizes.ratio_v, sizes.ratio_a, sizes.ratio_r, sizes.ratio_t});
  if (!status.ok()) return status;
  // Kernels address nodes by 32 bits.
  if (sizes.total() > std::size_t{1} << 28) return invalid("sizes: ", sizes.total(), " nodes, more than 2^28");
  return absl::OkStatus();
}

std::shared_ptr<const AlbedoTable> AlbedoTableMaker::make(const AlbedoSizes& sizes, const AlbedoTable::Key& key,
                                                          std::vector<float> values) {
  std::shared_ptr<AlbedoTable> table(new AlbedoTable);
  table->values_ = std::move(values);
  table->key_ = key;
  AlbedoTableView& view = table->view_;
  view.isotropic = table->values_.data();
  view.ratio = view.isotropic + sizes.isotropic();
  view.mean = view.ratio + sizes.ratio();
  if (sizes.dielectric()) {
    view.both = table->values_.data();
    view.share = view.both + sizes.isotropic() * sizes.e;
    view.mean = view.share + sizes.isotropic() * sizes.e;
    view.isotropic = view.ratio = nullptr;
  }
  view.sizes = sizes;
  view.inverse_range = static_cast<float>(1 / albedo_range(key.distribution));
  return table;
}

AlbedoTable::Key AlbedoTable::key_of(const Model& model) {
  return {model.distribution, model.masking,
          // V-cavity has no other.
          model.masking == Masking::smith ? model.shadowing : Shadowing::correlated,
          model.table != nullptr ? model.table->id() : 0, model.interface == Interface::dielectric};
}

bool AlbedoTable::fits(const Model& model) const { return key_ == key_of(model); }

std::string AlbedoTable::description() const {
  const auto text = [](auto value) { return absl::string_view(name(value).data(), name(value).size()); };
  std::string description = absl::StrCat(text(key_.distribution), " with ", text(key_.masking), " masking");
  if (key_.masking == Masking::smith) absl::StrAppend(&description, ", ", text(key_.shadowing), " shadowing");
  if (key_.dielectric) absl::StrAppend(&description, ", dielectric");
  return description;
}

std::string AlbedoTable::serialise() const {
  Header header{{},
                kSeal.version,
                static_cast<std::uint32_t>(key_.distribution),
                static_cast<std::uint32_t>(key_.masking),
                static_cast<std::uint32_t>(key_.shadowing),
                key_.slopes,
                view_.sizes,
                0};
  std::memcpy(header.magic, kSeal.magic, sizeof kSeal.magic);
  return seal(header, values_);
}

absl::StatusOr<std::shared_ptr<const AlbedoTable>> AlbedoTable::parse(std::string_view bytes) {
  auto unsealed = unseal<Header>(bytes, kSeal);
  if (!unsealed.ok()) return unsealed.status();
  auto& [header, values] = *unsealed;
  if (header.distribution > static_cast<std::uint32_t>(Distribution::table) ||
      header.masking > static_cast<std::uint32_t>(Masking::vcavity) ||
      header.shadowing > static_cast<std::uint32_t>(Shadowing::uncorrelated) || header.zero != 0)
    return corrupted_by_hash();
  // A dielectric's share is a difference.
  const float least = header.sizes.dielectric() ? -1.0f : 0.0f;
  for (const float value : values)
    if (!(value >= least && value < 1000)) return invalid("an albedo of ", value, "; rebuild it");
  return AlbedoTableMaker::make(header.sizes,
                                {static_cast<Distribution>(header.distribution), static_cast<Masking>(header.masking),
                                 static_cast<Shadowing>(header.shadowing), header.slopes, header.sizes.dielectric()},
                                std::move(values));
}

absl::Status AlbedoTable::save(const std::string& path) const { return replace_file(path, serialise()); }

absl::StatusOr<std::shared_ptr<const AlbedoTable>> AlbedoTable::load(const std::string& path) {
  return load_table<AlbedoTable>(path);
}

absl::StatusOr<std::shared_ptr<const AlbedoTable>> albedo_table(const Model& model,
                                                                const std::function<void(double)>& progress) {
  const auto kept = KeptTables::instance().of(AlbedoTable::key_of(model));
  const std::lock_guard lock(kept->mutex);
  if (kept->table != nullptr) return kept->table;
  absl::StatusOr<std::shared_ptr<const AlbedoTable>> built;
  // Isolated: a task of the caller's that this thread took up meanwhile might ask for the same table.
  isolated([&] { built = AlbedoTable::build(model, {.progress = progress}); });
  if (built.ok()) kept->table = *built;
  return built;
}

void use_albedo_table(std::shared_ptr<const AlbedoTable> table) {
  const auto kept = KeptTables::instance().of(table->key());
  const std::lock_guard lock(kept->mutex);
  kept->table = std::move(table);
}

void drop_albedo_tables(std::uint64_t slopes) { KeptTables::instance().drop(slopes); }

}  // namespace facetwise
