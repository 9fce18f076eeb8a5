// SPDX-License-Identifier: Apache-2.0
// Reading a mesh with assimp.
#include <assimp/matrix3x3.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "facetwise/scene.h"

namespace facetwise::scene {
namespace {

constexpr const char* kDefaultMesh = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";

// Appends the meshes of a node and of those below it: a mesh that several nodes name is an instance in each.
void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, Mesh& mesh) {
  const aiMatrix4x4 transform = parent * node.mTransformation;
  const aiMatrix3x3 normal_transform = aiMatrix3x3(transform).Inverse().Transpose();
  for (unsigned k = 0; k < node.mNumMeshes; ++k) {
    const aiMesh& source = *scene.mMeshes[node.mMeshes[k]];
    if (!(source.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) || !source.HasNormals()) continue;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (unsigned v = 0; v < source.mNumVertices; ++v) {
      const aiVector3D position = transform * source.mVertices[v];
      aiVector3D normal = normal_transform * source.mNormals[v];
      normal.NormalizeSafe();
      mesh.positions.push_back({position.x, position.y, position.z});
      mesh.normals.push_back({normal.x, normal.y, normal.z});
      const aiVector3D tangent =
          source.HasTangentsAndBitangents() ? aiMatrix3x3(transform) * source.mTangents[v] : aiVector3D(0, 0, 0);
      mesh.tangents.push_back({tangent.x, tangent.y, tangent.z});
      // assimp has v grow upwards.
      const aiVector3D at = source.HasTextureCoords(0) ? source.mTextureCoords[0][v] : aiVector3D(0, 1, 0);
      mesh.texcoords.push_back({at.x, 1 - at.y});
    }
    for (unsigned f = 0; f < source.mNumFaces; ++f) {
      const aiFace& face = source.mFaces[f];
      if (face.mNumIndices != 3) continue;
      mesh.triangles.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
      mesh.parts.push_back(node.mMeshes[k]);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) append(scene, *node.mChildren[c], transform, mesh);
}

}  // namespace

absl::StatusOr<Mesh> load_mesh(const std::string& path, bool tangents) {
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(path, aiProcess_Triangulate | aiProcess_GenSmoothNormals | aiProcess_JoinIdenticalVertices |
                                  aiProcess_SortByPType | (tangents ? aiProcess_CalcTangentSpace : 0u));
  if (scene == nullptr || scene->mRootNode == nullptr)
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", importer.GetErrorString()));
  Mesh mesh;
  append(*scene, *scene->mRootNode, aiMatrix4x4(), mesh);
  if (mesh.triangles.empty()) return absl::InvalidArgumentError(absl::StrCat(path, ": no triangles in it"));
  return mesh;
}

absl::StatusOr<std::string> default_mesh() {
  if (std::filesystem::exists(kDefaultMesh)) return kDefaultMesh;
  return absl::NotFoundError(absl::StrCat(kDefaultMesh, ": not found; it comes with Debian's assimp-testmodels"));
}

}  // namespace facetwise::scene
