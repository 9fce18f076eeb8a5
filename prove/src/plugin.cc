// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>

#include "absl/strings/str_cat.h"
#include "facetwise/bsdf.h"
#include "facetwise_plugin.h"

namespace facetwise::prove {
namespace {

class Plugin : public Bsdf {
 public:
  Plugin(void* library, const fw_plugin& plugin) : library_(library), plugin_(plugin) {}
  ~Plugin() override { dlclose(library_); }

  std::string name() const override { return plugin_.name != nullptr ? plugin_.name : "a plugin without a name"; }
  absl::Status sample(Lanes& lanes) override {
    const fw_plugin_lanes in = inputs(lanes);
    plugin_.sample(&in, lanes.ox.data(), lanes.oy.data(), lanes.oz.data(), lanes.pdf.data(), lanes.weight.data());
    return absl::OkStatus();
  }
  absl::Status evaluate(Lanes& lanes) override {
    const fw_plugin_lanes in = inputs(lanes);
    plugin_.evaluate(&in, lanes.pdf.data(), lanes.value.data());
    return absl::OkStatus();
  }

 private:
  static fw_plugin_lanes inputs(const Lanes& lanes) {
    return {lanes.count(),        lanes.ix.data(),      lanes.iy.data(), lanes.iz.data(),
            lanes.alpha_x.data(), lanes.alpha_y.data(), lanes.u1.data(), lanes.u2.data(),
            lanes.u3.data(),      lanes.ox.data(),      lanes.oy.data(), lanes.oz.data()};
  }
  void* const library_;
  const fw_plugin& plugin_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Bsdf>> open_plugin(const std::string& path) {
  // A name without a slash would be looked for among the system's libraries.
  const std::string file = path.find('/') == std::string::npos ? "./" + path : path;
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return absl::NotFoundError(dlerror());
  const auto open = reinterpret_cast<const fw_plugin* (*)()>(dlsym(library, "fw_plugin_open"));
  const auto failed = [&](auto error, const char* why) {
    dlclose(library);
    return error(absl::StrCat(path, ": ", why));
  };
  if (open == nullptr) return failed(absl::NotFoundError, "exports no fw_plugin_open (facetwise_plugin.h)");
  const fw_plugin* const plugin = open();
  if (plugin == nullptr) return failed(absl::FailedPreconditionError, "its fw_plugin_open returned NULL");
  if (plugin->version != FW_PLUGIN_VERSION)
    return failed(absl::FailedPreconditionError, "is of another version of facetwise_plugin.h");
  if (plugin->sample == nullptr || plugin->evaluate == nullptr)
    return failed(absl::FailedPreconditionError, "lacks sample or evaluate");
  return std::make_unique<Plugin>(library, *plugin);
}

}  // namespace facetwise::prove
