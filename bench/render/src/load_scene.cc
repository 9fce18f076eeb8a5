// SPDX-License-Identifier: Apache-2.0
// Scenes from files.
#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <map>

#include "absl/strings/str_cat.h"
#include "facetwise/render.h"

namespace facetwise::render {
namespace {

// Reads each texture of a file once, from beside it or from within.
class Textures {
 public:
  Textures(const std::string& path, const aiScene& file) : path_(path), file_(file) {}

  absl::StatusOr<std::shared_ptr<const Image>> get(const aiMaterial& material, aiTextureType type, bool srgb = false) {
    aiString name;
    if (material.GetTexture(type, 0, &name) != AI_SUCCESS || name.length == 0) return nullptr;
    auto& image = known_[{name.C_Str(), srgb}];
    if (image) return image;
    auto loaded = read(name.C_Str());
    if (!loaded.ok())
      return absl::InvalidArgumentError(absl::StrCat(path_, ": ", std::string(loaded.status().message())));
    if (srgb) make_linear(*loaded);
    return image = std::make_shared<Image>(*std::move(loaded));
  }

 private:
  absl::StatusOr<Image> read(const char* name) const {
    const aiTexture* within = file_.GetEmbeddedTexture(name);
    if (within == nullptr) return load_image((std::filesystem::path(path_).parent_path() / name).string());
    // Height 0: the bytes of a file of mWidth bytes.
    if (within->mHeight == 0)
      return decode_image({reinterpret_cast<const char*>(within->pcData), within->mWidth}, name);
    Image image;
    image.width = static_cast<int>(within->mWidth);
    image.height = static_cast<int>(within->mHeight);
    for (unsigned k = 0; k < within->mWidth * within->mHeight; ++k)
      for (const unsigned char value : {within->pcData[k].r, within->pcData[k].g, within->pcData[k].b})
        image.values.push_back(static_cast<float>(value) / 255.0f);
    return image;
  }

  const std::string& path_;
  const aiScene& file_;
  std::map<std::pair<std::string, bool>, std::shared_ptr<const Image>> known_;
};

}  // namespace

absl::StatusOr<Scene> load_scene(const std::string& path) {
  auto mesh = scene::load_mesh(path, true);
  if (!mesh.ok()) return mesh.status();
  Assimp::Importer importer;
  // Of the file's materials; the mesh has been read.
  const aiScene* file = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType);
  if (file == nullptr) return absl::InvalidArgumentError(absl::StrCat(path, ": ", importer.GetErrorString()));
  Scene scene;
  scene.name = path;
  scene.mesh = *std::move(mesh);
  Textures textures(path, *file);
  for (unsigned k = 0; k < file->mNumMeshes; ++k) {
    const aiMaterial& source = *file->mMaterials[file->mMeshes[k]->mMaterialIndex];
    Material material;
    auto& metallic = *(material.metallic = Material::Metallic{});
    // A file without metallic roughness is matte and dull.
    metallic.metalness = 0;
    metallic.roughness = 0.7f;
    source.Get(AI_MATKEY_ROUGHNESS_FACTOR, metallic.roughness);
    source.Get(AI_MATKEY_METALLIC_FACTOR, metallic.metalness);
    aiColor4D base(0.8f, 0.8f, 0.8f, 1);
    if (source.Get(AI_MATKEY_BASE_COLOR, base) != AI_SUCCESS) source.Get(AI_MATKEY_COLOR_DIFFUSE, base);
    for (unsigned c = 0; c < 3; ++c) metallic.color[c] = std::clamp(base[c], 0.0f, 1.0f);
    const auto read = [&](std::shared_ptr<const Image>& map, aiTextureType type, bool srgb = false) {
      auto image = textures.get(source, type, srgb);
      if (image.ok() && *image) map = *image;
      return image.status();
    };
    // assimp has glTF's base colour under both names, and its metallic roughness under UNKNOWN.
    for (const auto& status :
         {read(metallic.color_map, aiTextureType_DIFFUSE, true),
          read(metallic.color_map, aiTextureType_BASE_COLOR, true), read(metallic.roughness_map, aiTextureType_UNKNOWN),
          read(material.normal_map, aiTextureType_NORMALS)})
      if (!status.ok()) return status;
    source.Get(AI_MATKEY_GLTF_TEXTURE_SCALE(aiTextureType_NORMALS, 0), material.normal_scale);
    scene.materials.push_back(std::move(material));
  }
  // From above and the front, the whole of it in view.
  Vector low = scene.mesh.positions[0], high = low;
  for (const Vector& p : scene.mesh.positions)
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  const Vector center = 0.5f * (low + high), size = high - low;
  const float diagonal = std::sqrt(dot(size, size));
  scene.view.target = center;
  scene.view.eye = center + 2.2f * diagonal * normalized(Vector{0.62f, 0.38f, 0.69f});
  scene.view.field = 1 / 2.2f;
  return scene;
}

}  // namespace facetwise::render
