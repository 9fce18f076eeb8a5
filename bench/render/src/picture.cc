// SPDX-License-Identifier: Apache-2.0
// Writing pictures, and reading our own to go on from.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "facetwise/render.h"

namespace facetwise::render {
namespace {

constexpr const char* kMadeBy = "facetwise.madeBy";
constexpr const char* kScene = "facetwise.scene";

// The channels that hold a Pixel, by its own floats.
struct Channel {
  const char* name;
  float Picture::Pixel::*plain;  // or
  std::size_t color;
  float Picture::Sum::*part;
};
constexpr Channel kChannels[] = {
    {"samples", &Picture::Pixel::samples, 0, nullptr},   {"rejected", &Picture::Pixel::rejected, 0, nullptr},
    {"surfaces", &Picture::Pixel::surfaces, 0, nullptr}, {"sum.R", nullptr, 0, &Picture::Sum::high},
    {"sum.G", nullptr, 1, &Picture::Sum::high},          {"sum.B", nullptr, 2, &Picture::Sum::high},
    {"sum_low.R", nullptr, 0, &Picture::Sum::low},       {"sum_low.G", nullptr, 1, &Picture::Sum::low},
    {"sum_low.B", nullptr, 2, &Picture::Sum::low},
};

float& channel_of(Picture::Pixel& pixel, const Channel& channel) {
  return channel.plain ? pixel.*channel.plain : pixel.radiance[channel.color].*channel.part;
}

void insert(Imf::FrameBuffer& frame, std::vector<Picture::Pixel>& pixels, int width) {
  for (const Channel& channel : kChannels)
    frame.insert(channel.name,
                 Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&channel_of(pixels[0], channel)),
                            sizeof(Picture::Pixel), sizeof(Picture::Pixel) * static_cast<std::size_t>(width)));
}

// Hable 2010's curve, as games and viewers use it: highlights roll off instead of clipping.
float filmic_curve(float x) {
  const auto curve = [](float v) {
    return (v * (0.15f * v + 0.05f) + 0.004f) / (v * (0.15f * v + 0.5f) + 0.06f) - 0.02f / 0.3f;
  };
  return curve(2 * x) / curve(11.2f);
}

std::uint8_t encode(float linear) {
  const float v = std::clamp(linear, 0.0f, 1.0f);
  const float srgb = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(255 * srgb));
}

}  // namespace

Color Picture::color(std::size_t at) const {
  const Pixel& pixel = pixels[at];
  Color result{};
  for (std::size_t k = 0; k < 3 && pixel.samples > 0; ++k)
    result[k] = static_cast<float>(pixel.radiance[k].value() / pixel.samples);
  return result;
}

double Picture::mean_depth() const {
  double surfaces = 0, samples = 0;
  for (const Pixel& pixel : pixels) surfaces += pixel.surfaces, samples += pixel.samples;
  return samples > 0 ? surfaces / samples : 0;
}

absl::Status save_exr(const Picture& picture, const std::string& path) {
  // Renamed at the end, so that no reader meets half a picture and an error keeps the one before.
  const std::string part = path + ".part";
  try {
    Imf::Header header(picture.width, picture.height);
    header.insert(kMadeBy, Imf::StringAttribute(picture.made_by));
    header.insert(kScene, Imf::StringAttribute(picture.scene));
    std::vector<Picture::Pixel> pixels = picture.pixels;
    std::vector<Color> mean(pixels.size());
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] = picture.color(k);
    Imf::FrameBuffer frame;
    insert(frame, pixels, picture.width);
    const char* names[] = {"R", "G", "B"};
    for (std::size_t k = 0; k < 3; ++k)
      frame.insert(names[k], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&mean[0][k]), sizeof(Color),
                                        sizeof(Color) * static_cast<std::size_t>(picture.width)));
    for (const Channel& channel : kChannels) header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
    for (const char* channel : names) header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    Imf::OutputFile file(part.c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(picture.height);
  } catch (const std::exception& error) {
    std::remove(part.c_str());
    return absl::UnavailableError(absl::StrCat(path, ": ", error.what()));
  }
  if (std::rename(part.c_str(), path.c_str()) != 0)
    return absl::UnavailableError(absl::StrCat(path, ": cannot be replaced"));
  return absl::OkStatus();
}

absl::StatusOr<Picture> load_exr(const std::string& path) {
  try {
    Imf::InputFile file(path.c_str());
    const auto box = file.header().dataWindow();
    const auto* made_by = file.header().findTypedAttribute<Imf::StringAttribute>(kMadeBy);
    const auto* scene = file.header().findTypedAttribute<Imf::StringAttribute>(kScene);
    if (made_by == nullptr || scene == nullptr || box.min.x != 0 || box.min.y != 0)
      return absl::InvalidArgumentError(absl::StrCat(path, ": not a picture that facetwise wrote"));
    for (const Channel& channel : kChannels)
      if (file.header().channels().findChannel(channel.name) == nullptr)
        return absl::InvalidArgumentError(absl::StrCat(path, ": no channel ", channel.name));
    Picture picture;
    picture.made_by = made_by->value();
    picture.scene = scene->value();
    picture.width = box.max.x + 1;
    picture.height = box.max.y + 1;
    picture.pixels.resize(static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height));
    Imf::FrameBuffer frame;
    insert(frame, picture.pixels, picture.width);
    file.setFrameBuffer(frame);
    file.readPixels(0, box.max.y);
    return picture;
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", error.what()));
  }
}

std::vector<std::uint8_t> tone_map(const Picture& picture, float exposure, bool filmic) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * picture.pixels.size());
  for (std::size_t k = 0; k < picture.pixels.size(); ++k)
    for (const float value : picture.color(k))
      bytes.push_back(encode(filmic ? filmic_curve(exposure * value) : exposure * value));
  return bytes;
}

std::string png_bytes(int width, int height, const std::vector<std::uint8_t>& rgb) {
  std::string bytes;
  stbi_write_png_to_func(
      [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
      },
      &bytes, width, height, 3, rgb.data(), 3 * width);
  return bytes;
}

absl::Status save_png(const Picture& picture, const std::string& path, float exposure, bool filmic) {
  std::ofstream file(path, std::ios::binary);
  file << png_bytes(picture.width, picture.height, tone_map(picture, exposure, filmic));
  file.close();
  return file ? absl::OkStatus() : absl::UnavailableError(absl::StrCat(path, ": cannot be written"));
}

double rmse(const Picture& a, const Picture& b, double first, double last) {
  const auto begin = static_cast<std::size_t>(std::lround(first * a.width));
  const auto end = static_cast<std::size_t>(std::lround(last * a.width));
  const auto width = static_cast<std::size_t>(a.width);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < std::min(a.pixels.size(), b.pixels.size()); ++k) {
    if (k % width < begin || k % width >= end) continue;
    const Color x = a.color(k), y = b.color(k);
    for (std::size_t c = 0; c < 3; ++c) sum += (x[c] - y[c]) * static_cast<double>(x[c] - y[c]);
    ++count;
  }
  return std::sqrt(sum / (3.0 * static_cast<double>(std::max<std::size_t>(1, count))));
}

Picture merge(const Picture& a, const Picture& b) {
  Picture both = a;
  for (std::size_t k = 0; k < both.pixels.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      both.pixels[k].radiance[c].add(b.pixels[k].radiance[c].high);
      both.pixels[k].radiance[c].add(b.pixels[k].radiance[c].low);
    }
    both.pixels[k].samples += b.pixels[k].samples;
    both.pixels[k].rejected += b.pixels[k].rejected;
    both.pixels[k].surfaces += b.pixels[k].surfaces;
  }
  both.sampled += b.sampled;
  both.paths += b.paths;
  return both;
}

}  // namespace facetwise::render
