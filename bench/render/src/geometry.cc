// SPDX-License-Identifier: Apache-2.0
#include "src/geometry.h"

#include <algorithm>
#include <array>
#include <limits>

#include "absl/strings/str_cat.h"

namespace facetwise::render {
namespace {

constexpr std::size_t kPacket = 16;

// Fills a packet's rays from lane `first` on; lanes past `end` are told to be left out.
template <class Ray>
void fill(Ray& packet, std::array<int, kPacket>& valid, const RayColumns& rays, std::size_t first, std::size_t end,
          float near) {
  const std::size_t count = std::min(kPacket, end - first);
  for (std::size_t k = 0; k < kPacket; ++k) {
    const std::size_t lane = first + std::min(k, count - 1);
    valid[k] = k < count ? -1 : 0;
    packet.org_x[k] = rays.ox[lane], packet.org_y[k] = rays.oy[lane], packet.org_z[k] = rays.oz[lane];
    packet.dir_x[k] = rays.dx[lane], packet.dir_y[k] = rays.dy[lane], packet.dir_z[k] = rays.dz[lane];
    packet.tnear[k] = near;
    packet.tfar[k] = std::numeric_limits<float>::infinity();
    packet.time[k] = 0;
    packet.mask[k] = ~0u;
    packet.id[k] = packet.flags[k] = 0;
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<Geometry>> Geometry::create(const scene::Mesh& mesh) {
  std::unique_ptr<Geometry> result(new Geometry);
  result->device_ = rtcNewDevice(nullptr);
  if (!result->device_) return absl::InternalError(absl::StrCat("Embree: error ", rtcGetDeviceError(nullptr)));
  RTCGeometry geometry = rtcNewGeometry(result->device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(scene::Vector), mesh.positions.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), mesh.triangles.size());
  if (vertices && indices) {
    std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<scene::Vector*>(vertices));
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<std::array<std::uint32_t, 3>*>(indices));
    rtcCommitGeometry(geometry);
    result->scene_ = rtcNewScene(result->device_);
    rtcSetSceneFlags(result->scene_, RTC_SCENE_FLAG_ROBUST);
    rtcAttachGeometry(result->scene_, geometry);
  }
  rtcReleaseGeometry(geometry);
  if (result->scene_) rtcCommitScene(result->scene_);
  if (const RTCError error = rtcGetDeviceError(result->device_); error != RTC_ERROR_NONE)
    return absl::InternalError(absl::StrCat("Embree: error ", error, " while building the scene"));
  return result;
}

Geometry::~Geometry() {
  if (scene_) rtcReleaseScene(scene_);
  if (device_) rtcReleaseDevice(device_);
}

void Geometry::intersect(const RayColumns& rays, const HitColumns& hits, std::size_t begin, std::size_t end, float near,
                         bool coherent) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) RTCRayHit16 packet;
  alignas(64) std::array<int, kPacket> valid;
  for (std::size_t first = begin; first < end; first += kPacket) {
    fill(packet.ray, valid, rays, first, end, near);
    std::fill(std::begin(packet.hit.geomID), std::end(packet.hit.geomID), RTC_INVALID_GEOMETRY_ID);
    std::fill(std::begin(packet.hit.instID[0]), std::end(packet.hit.instID[0]), RTC_INVALID_GEOMETRY_ID);
    rtcIntersect16(valid.data(), scene_, &context, &packet);
    const std::size_t count = std::min(kPacket, end - first);
    for (std::size_t k = 0; k < count; ++k) {
      const bool hit = packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
      hits.triangle[first + k] = hit ? packet.hit.primID[k] : kMissed;
      hits.u[first + k] = packet.hit.u[k];
      hits.v[first + k] = packet.hit.v[k];
      hits.distance[first + k] = packet.ray.tfar[k];
    }
  }
}

void Geometry::occlude(const RayColumns& rays, std::uint8_t* visible, std::size_t begin, std::size_t end,
                       float near) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) RTCRay16 packet;
  alignas(64) std::array<int, kPacket> valid;
  for (std::size_t first = begin; first < end; first += kPacket) {
    fill(packet, valid, rays, first, end, near);
    const std::size_t count = std::min(kPacket, end - first);
    bool any = false;
    for (std::size_t k = 0; k < count; ++k) {
      if (!visible[first + k]) valid[k] = 0;
      any |= valid[k] != 0;
    }
    if (!any) continue;
    rtcOccluded16(valid.data(), scene_, &context, &packet);
    for (std::size_t k = 0; k < count; ++k)
      if (valid[k] && packet.tfar[k] < 0) visible[first + k] = 0;
  }
}

}  // namespace facetwise::render
