// Reading pictures: EXR with OpenEXR, the rest with stb.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <stb_image.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "absl/strings/str_cat.h"
#include "facetwise/render.h"

namespace facetwise::render {
namespace {

absl::StatusOr<Image> load_exr_image(const std::string& path) {
  try {
    Imf::InputFile file(path.c_str());
    const auto box = file.header().dataWindow();
    Image image;
    image.width = box.max.x - box.min.x + 1;
    image.height = box.max.y - box.min.y + 1;
    image.values.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (const char* channel : {"R", "G", "B"})
      if (file.header().channels().findChannel(channel) == nullptr)
        return absl::InvalidArgumentError(absl::StrCat(path, ": no channel ", channel));
    Imf::FrameBuffer frame;
    constexpr std::size_t kPixel = 3 * sizeof(float);
    const std::size_t row = kPixel * static_cast<std::size_t>(image.width);
    char* origin = reinterpret_cast<char*>(image.values.data()) -
                   (box.min.x * static_cast<std::ptrdiff_t>(kPixel) + box.min.y * static_cast<std::ptrdiff_t>(row));
    frame.insert("R", Imf::Slice(Imf::FLOAT, origin, kPixel, row));
    frame.insert("G", Imf::Slice(Imf::FLOAT, origin + sizeof(float), kPixel, row));
    frame.insert("B", Imf::Slice(Imf::FLOAT, origin + 2 * sizeof(float), kPixel, row));
    file.setFrameBuffer(frame);
    file.readPixels(box.min.y, box.max.y);
    for (float& value : image.values) {
      if (!std::isfinite(value)) return absl::InvalidArgumentError(absl::StrCat(path, ": a value is NaN or infinite"));
      value = std::max(value, 0.0f);  // a filter's ringing, when a probe was made smaller
    }
    return image;
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", error.what()));
  }
}

}  // namespace

Color Image::sample(float u, float v) const {
  const auto wrap = [](int k, int n) { return ((k % n) + n) % n; };
  const float x = (u - std::floor(u)) * static_cast<float>(width) - 0.5f;
  const float y = (v - std::floor(v)) * static_cast<float>(height) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  const int x0 = wrap(static_cast<int>(fx), width), x1 = wrap(x0 + 1, width);
  const int y0 = wrap(static_cast<int>(fy), height), y1 = wrap(y0 + 1, height);
  const float s = x - fx, t = y - fy;
  Color result;
  for (int k = 0; k < 3; ++k)
    result[static_cast<std::size_t>(k)] =
        (1 - t) * ((1 - s) * at(x0, y0)[k] + s * at(x1, y0)[k]) + t * ((1 - s) * at(x0, y1)[k] + s * at(x1, y1)[k]);
  return result;
}

absl::StatusOr<Image> load_image(const std::string& path) {
  if (path.ends_with(".exr")) return load_exr_image(path);
  Image image;
  int channels = 0;
  stbi_uc* bytes = stbi_load(path.c_str(), &image.width, &image.height, &channels, 3);
  if (bytes == nullptr) return absl::InvalidArgumentError(absl::StrCat(path, ": ", stbi_failure_reason()));
  image.values.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  std::transform(bytes, bytes + image.values.size(), image.values.begin(),
                 [](stbi_uc value) { return static_cast<float>(value) / 255.0f; });
  stbi_image_free(bytes);
  return image;
}

}  // namespace facetwise::render
