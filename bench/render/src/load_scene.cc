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

absl::StatusOr<std::shared_ptr<const Image>> texture(const std::string& scene_path, const aiMaterial& material,
                                                     aiTextureType type,
                                                     std::map<std::string, std::shared_ptr<const Image>>& known) {
  aiString name;
  if (material.GetTexture(type, 0, &name) != AI_SUCCESS || name.length == 0) return nullptr;
  if (name.C_Str()[0] == '*')
    return absl::UnimplementedError(
        absl::StrCat(scene_path, ": textures inside the file are not read; keep them beside it"));
  const std::string path = (std::filesystem::path(scene_path).parent_path() / name.C_Str()).string();
  auto& image = known[path];
  if (!image) {
    auto loaded = load_image(path);
    if (!loaded.ok())
      return absl::InvalidArgumentError(absl::StrCat(scene_path, ": ", std::string(loaded.status().message())));
    image = std::make_shared<Image>(*std::move(loaded));
  }
  return image;
}

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
  std::map<std::string, std::shared_ptr<const Image>> images;
  for (unsigned k = 0; k < file->mNumMeshes; ++k) {
    const aiMaterial& source = *file->mMaterials[file->mMeshes[k]->mMaterialIndex];
    Material material;
    float roughness = 0.5f, metallic = 0;
    source.Get(AI_MATKEY_ROUGHNESS_FACTOR, roughness);
    source.Get(AI_MATKEY_METALLIC_FACTOR, metallic);
    aiColor4D base(0.8f, 0.8f, 0.8f, 1);
    if (source.Get(AI_MATKEY_BASE_COLOR, base) != AI_SUCCESS) source.Get(AI_MATKEY_COLOR_DIFFUSE, base);
    material.alpha_x = material.alpha_y = std::clamp(alpha_from_perceptual(roughness), 0.0f, 1.0f);
    // glTF 2.0, appendix B: a metal's colour is its reflectance.
    for (unsigned c = 0; c < 3; ++c) material.f0[c] = std::clamp(0.04f + metallic * (base[c] - 0.04f), 0.0f, 1.0f);
    auto normals = texture(path, source, aiTextureType_NORMALS, images);
    if (!normals.ok()) return normals.status();
    material.normal_map = *normals;
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
