// SPDX-License-Identifier: Apache-2.0
// Tracing with Embree.
#include <embree3/rtcore.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "facetwise/scene.h"
#include "facetwise/vector.h"
#include "src/material.h"

namespace facetwise::scene {
namespace {

constexpr std::uint32_t kWidth = 1280, kHeight = 960;
// Rows are taken in this stride (the golden ratio's, without a common divisor), so that any run of them,
// and so any batch, is spread over the whole image.
constexpr std::uint32_t kRowStride = 593;
// From above and the front, in a mesh's own y-up frame.
constexpr Vector kView = {0.62f, 0.38f, 0.69f};
constexpr float kDistance = 2.2f;  // in diagonals of the bounding box

struct Hit {
  Vector incident;
  Roughness alpha;
};

}  // namespace

struct Camera::State {
  Mesh mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  // Image plane: the eye, the corner's direction, and the steps of one pixel.
  Vector eye, corner, right, up;
  Vector center;
  float size = 1;  // of the mesh: the diagonal of its bounding box

  std::vector<Hit> waiting;  // hits of the last pass that no lane has used yet
  std::size_t used = 0;
  std::uint32_t passes = 0;
  std::uint64_t rays = 0, hits = 0;

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  // Points the camera at the mesh so that the image is the smallest rectangle around it.
  void frame() {
    constexpr float kHuge = std::numeric_limits<float>::max();
    Vector low = {kHuge, kHuge, kHuge}, high = {-kHuge, -kHuge, -kHuge};
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t vertex : triangle)
        for (int k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], mesh.positions[vertex][k]);
          high[k] = std::max(high[k], mesh.positions[vertex][k]);
        }
    center = 0.5f * (low + high);
    size = std::sqrt(dot(high - low, high - low));
    const Vector back = normalized(kView);
    const Vector across = normalized(cross({0, 1, 0}, back));
    const Vector upward = cross(back, across);
    eye = center + kDistance * size * back;
    float left = kHuge, rightmost = -kHuge, bottom = kHuge, top = -kHuge;
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t vertex : triangle) {
        const Vector to = mesh.positions[vertex] - eye;
        const float depth = -dot(to, back), x = dot(to, across) / depth, y = dot(to, upward) / depth;
        left = std::min(left, x), rightmost = std::max(rightmost, x);
        bottom = std::min(bottom, y), top = std::max(top, y);
      }
    corner = left * across + bottom * upward - back;
    right = ((rightmost - left) / kWidth) * across;
    up = ((top - bottom) / kHeight) * upward;
  }

  bool shoot(std::uint32_t x, std::uint32_t y, Hit& hit) const {
    const std::uint32_t pixel = y * kWidth + x;
    const float dx = static_cast<float>(x) + hash_uniform(pixel, passes, 0);
    const float dy = static_cast<float>(y) + hash_uniform(pixel, passes, 1);
    const Vector direction = normalized(corner + dx * right + dy * up);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    RTCRayHit query{};
    query.ray.org_x = eye[0], query.ray.org_y = eye[1], query.ray.org_z = eye[2];
    query.ray.dir_x = direction[0], query.ray.dir_y = direction[1], query.ray.dir_z = direction[2];
    query.ray.tfar = std::numeric_limits<float>::infinity();
    query.ray.mask = ~0u;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;

    const auto& triangle = mesh.triangles[query.hit.primID];
    const float u = query.hit.u, v = query.hit.v;
    Vector normal =
        (1.0f - u - v) * mesh.normals[triangle[0]] + u * mesh.normals[triangle[1]] + v * mesh.normals[triangle[2]];
    const Vector geometric = {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
    // Both sides of a triangle are the same surface: its normals are those on the viewer's side.
    const Vector facing = dot(geometric, direction) < 0.0f ? geometric : -1.0f * geometric;
    if (!(dot(normal, normal) > 1e-12f)) normal = facing;
    if (dot(normal, facing) < 0.0f) normal = -1.0f * normal;
    const Vector point = (1.0f / size) * (eye + query.ray.tfar * direction - center);
    const Vector shading = bend_normal(point, normalized(normal));
    hit = {normalized(Frame(shading).to_local(-1.0f * direction)), roughness(point, mesh.parts[query.hit.primID])};
    return true;
  }

  void pass() {
    std::vector<std::vector<Hit>> rows(kHeight);
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, kHeight, 8), [&](const auto& range) {
      for (std::uint32_t y = range.begin(); y < range.end(); ++y) {
        rows[y].reserve(kWidth);
        Hit hit;
        for (std::uint32_t x = 0; x < kWidth; ++x)
          if (shoot(x, y, hit)) rows[y].push_back(hit);
      }
    });
    waiting.clear();
    used = 0;
    for (std::uint32_t k = 0; k < kHeight; ++k) {
      const auto& row = rows[k * kRowStride % kHeight];
      waiting.insert(waiting.end(), row.begin(), row.end());
    }
    ++passes;
    rays += std::uint64_t{kWidth} * kHeight;
    hits += waiting.size();
  }
};

absl::StatusOr<std::unique_ptr<Camera>> Camera::create(Mesh mesh) {
  auto state = std::make_unique<State>();
  state->mesh = std::move(mesh);
  state->frame();
  state->device = rtcNewDevice(nullptr);
  if (!state->device) return absl::InternalError(absl::StrCat("Embree: error ", rtcGetDeviceError(nullptr)));
  RTCGeometry geometry = rtcNewGeometry(state->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads vertices 16 bytes at a time, so it gets its own padded copies.
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vector),
                                           state->mesh.positions.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), state->mesh.triangles.size());
  if (vertices && indices) {
    std::copy(state->mesh.positions.begin(), state->mesh.positions.end(), static_cast<Vector*>(vertices));
    std::copy(state->mesh.triangles.begin(), state->mesh.triangles.end(),
              static_cast<std::array<std::uint32_t, 3>*>(indices));
    rtcCommitGeometry(geometry);
    state->scene = rtcNewScene(state->device);
    rtcAttachGeometry(state->scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  if (state->scene) rtcCommitScene(state->scene);
  if (const RTCError error = rtcGetDeviceError(state->device); error != RTC_ERROR_NONE)
    return absl::InternalError(absl::StrCat("Embree: error ", error, " while building the scene"));
  state->pass();
  if (state->hits == 0) return absl::InvalidArgumentError("no ray of the camera hits the mesh");
  return std::unique_ptr<Camera>(new Camera(std::move(state)));
}

Camera::Camera(std::unique_ptr<State> state) : state_(std::move(state)) {}
Camera::~Camera() = default;

Lanes Camera::trace(std::size_t lanes) {
  Lanes result;
  for (auto* column : {&result.incident_x, &result.incident_y, &result.incident_z, &result.alpha_x, &result.alpha_y})
    column->reserve(lanes);
  while (result.size() < lanes) {
    if (state_->used == state_->waiting.size()) state_->pass();
    const Hit& hit = state_->waiting[state_->used++];
    result.incident_x.push_back(hit.incident[0]);
    result.incident_y.push_back(hit.incident[1]);
    result.incident_z.push_back(hit.incident[2]);
    result.alpha_x.push_back(hit.alpha.x);
    result.alpha_y.push_back(hit.alpha.y);
    result.backfacing += hit.incident[2] <= 0.0f;
  }
  return result;
}

std::size_t Camera::triangles() const { return state_->mesh.triangles.size(); }
std::uint64_t Camera::rays() const { return state_->rays; }
std::uint64_t Camera::hits() const { return state_->hits; }

}  // namespace facetwise::scene
