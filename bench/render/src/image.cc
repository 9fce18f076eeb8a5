// SPDX-License-Identifier: Apache-2.0
// Reading pictures: EXR with OpenEXR, the rest with stb.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <stb_image.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <iterator>

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
  const float x = (u - std::floor(u)) * static_cast<float>(width) - 0.5f;
  const float y = (v - std::floor(v)) * static_cast<float>(height) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  // fx and fy are -1 at least, and at most the last.
  const int x0 = fx < 0 ? width - 1 : std::min(static_cast<int>(fx), width - 1), x1 = x0 + 1 == width ? 0 : x0 + 1;
  const int y0 = fy < 0 ? height - 1 : std::min(static_cast<int>(fy), height - 1), y1 = y0 + 1 == height ? 0 : y0 + 1;
  const float s = x - fx, t = y - fy;
  const float *a = at(x0, y0), *b = at(x1, y0), *c = at(x0, y1), *d = at(x1, y1);
  Color result;
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = (1 - t) * ((1 - s) * a[k] + s * b[k]) + t * ((1 - s) * c[k] + s * d[k]);
  return result;
}

absl::StatusOr<Image> decode_image(std::string_view bytes, const std::string& name) {
  Image image;
  int channels = 0;
  stbi_uc* values = stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()),
                                          static_cast<int>(bytes.size()), &image.width, &image.height, &channels, 3);
  if (values == nullptr) return absl::InvalidArgumentError(absl::StrCat(name, ": ", stbi_failure_reason()));
  image.values.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  std::transform(values, values + image.values.size(), image.values.begin(),
                 [](stbi_uc value) { return static_cast<float>(value) / 255.0f; });
  stbi_image_free(values);
  return image;
}

absl::StatusOr<Image> load_image(const std::string& path) {
  if (path.ends_with(".exr")) return load_exr_image(path);
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::NotFoundError(absl::StrCat(path, ": cannot be read"));
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return decode_image(bytes, path);
}

void make_linear(Image& image) {
  for (float& v : image.values) v = v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

}  // namespace facetwise::render
