// SPDX-License-Identifier: Apache-2.0
// ports/facetwise.glsl and .hlsl against the library: compiled to SPIR-V by glslang, run by a Vulkan compute pass (on Mesa's
// lavapipe where there is no GPU).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <vulkan/vulkan_raii.hpp>

#include "compare.h"

namespace facetwise::test {
namespace {

std::vector<std::uint32_t> read_spirv(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  std::vector<std::uint32_t> words(static_cast<std::size_t>(file.tellg()) / 4);
  file.seekg(0).read(reinterpret_cast<char*>(words.data()), static_cast<std::streamsize>(4 * words.size()));
  return words;
}

// A device and what it takes to run one compute shader over one buffer of inputs and one of answers.
class Compute {
 public:
  Compute() { std::printf("on %s\n", physical_.getProperties().deviceName.data()); }

  std::vector<float> run(const std::vector<std::uint32_t>& spirv, const std::vector<float>& in, std::size_t outputs,
                         std::uint32_t groups_x, std::uint32_t groups_y) {
    Buffer input(*this, in.size()), output(*this, outputs);
    std::copy(in.begin(), in.end(), input.values);
    const std::vector<vk::DescriptorSetLayoutBinding> bindings{
        {0, vk::DescriptorType::eStorageBuffer, 1, vk::ShaderStageFlagBits::eCompute},
        {1, vk::DescriptorType::eStorageBuffer, 1, vk::ShaderStageFlagBits::eCompute}};
    const vk::raii::DescriptorSetLayout layout(device_, vk::DescriptorSetLayoutCreateInfo({}, bindings));
    const vk::raii::PipelineLayout pipeline_layout(device_, vk::PipelineLayoutCreateInfo({}, *layout));
    const vk::raii::ShaderModule shader(device_, vk::ShaderModuleCreateInfo({}, spirv));
    const vk::raii::Pipeline pipeline(
        device_, nullptr,
        vk::ComputePipelineCreateInfo({}, {{}, vk::ShaderStageFlagBits::eCompute, *shader, "main"}, *pipeline_layout));
    const vk::DescriptorPoolSize size(vk::DescriptorType::eStorageBuffer, 2);
    const vk::raii::DescriptorPool pool(
        device_, vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, size));
    const vk::raii::DescriptorSet set =
        std::move(vk::raii::DescriptorSets(device_, vk::DescriptorSetAllocateInfo(*pool, *layout)).front());
    const vk::DescriptorBufferInfo from(*input.buffer, 0, VK_WHOLE_SIZE), to(*output.buffer, 0, VK_WHOLE_SIZE);
    device_.updateDescriptorSets({{*set, 0, 0, vk::DescriptorType::eStorageBuffer, {}, from},
                                  {*set, 1, 0, vk::DescriptorType::eStorageBuffer, {}, to}},
                                 {});
    const vk::raii::CommandPool commands(device_, vk::CommandPoolCreateInfo({}, family_));
    const vk::raii::CommandBuffer command = std::move(
        vk::raii::CommandBuffers(device_, vk::CommandBufferAllocateInfo(*commands, vk::CommandBufferLevel::ePrimary, 1))
            .front());
    command.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    command.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
    command.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *pipeline_layout, 0, *set, {});
    command.dispatch(groups_x, groups_y, 1);
    command.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader, vk::PipelineStageFlagBits::eHost, {},
                            vk::MemoryBarrier(vk::AccessFlagBits::eShaderWrite, vk::AccessFlagBits::eHostRead), {}, {});
    command.end();
    const vk::raii::Queue queue = device_.getQueue(family_, 0);
    queue.submit(vk::SubmitInfo({}, {}, *command));
    queue.waitIdle();
    return {output.values, output.values + outputs};
  }

 private:
  // Memory that both sides see.
  struct Buffer {
    Buffer(const Compute& compute, std::size_t count)
        : buffer(compute.device_,
                 vk::BufferCreateInfo({}, sizeof(float) * count, vk::BufferUsageFlagBits::eStorageBuffer)),
          memory(compute.device_, allocation(compute)),
          values(nullptr) {
      buffer.bindMemory(*memory, 0);
      values = static_cast<float*>(memory.mapMemory(0, VK_WHOLE_SIZE));
    }
    vk::MemoryAllocateInfo allocation(const Compute& compute) const {
      constexpr auto kWanted = vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;
      const vk::MemoryRequirements needs = buffer.getMemoryRequirements();
      const vk::PhysicalDeviceMemoryProperties has = compute.physical_.getMemoryProperties();
      std::uint32_t type = 0;
      while (!(needs.memoryTypeBits >> type & 1) || (has.memoryTypes[type].propertyFlags & kWanted) != kWanted) ++type;
      return {needs.size, type};
    }
    vk::raii::Buffer buffer;
    vk::raii::DeviceMemory memory;
    float* values;
  };

  static std::uint32_t family_of(const vk::raii::PhysicalDevice& physical) {
    const auto families = physical.getQueueFamilyProperties();
    const auto computes = [](const auto& family) { return bool(family.queueFlags & vk::QueueFlagBits::eCompute); };
    return static_cast<std::uint32_t>(std::find_if(families.begin(), families.end(), computes) - families.begin());
  }

  vk::raii::Context context_;
  vk::ApplicationInfo application_{"test_ports", 1, nullptr, 0, VK_API_VERSION_1_1};
  vk::raii::Instance instance_{context_, vk::InstanceCreateInfo({}, &application_)};
  vk::raii::PhysicalDevice physical_ = std::move(vk::raii::PhysicalDevices(instance_).front());
  std::uint32_t family_ = family_of(physical_);
  float priority_ = 1;
  vk::DeviceQueueCreateInfo queue_{{}, family_, 1, &priority_};
  vk::raii::Device device_{physical_, vk::DeviceCreateInfo({}, queue_)};
};

class Shader : public testing::TestWithParam<const char*> {};

// Their sines, cosines and quotients are those of the driver.
TEST_P(Shader, IsTheLibrarys) {
  std::vector<float> in;
  for (const auto& column : port_lanes()) in.insert(in.end(), column.begin(), column.end());
  constexpr std::size_t kSamplers = std::size(kPortSamplers);
  const std::vector<float> out =
      Compute().run(read_spirv(std::string(FACETWISE_SHADERS) + "/" + GetParam() + ".spv"), in,
                    kSamplers * port_outputs * kPortLanes, (kPortLanes + 63) / 64, kSamplers);
  for (std::size_t k = 0; k < kSamplers; ++k) {
    PortAnswer answer;
    for (std::size_t column = 0; column < port_outputs; ++column) {
      const float* from = out.data() + (k * port_outputs + column) * kPortLanes;
      answer.emplace_back(from, from + kPortLanes);
    }
    expect_the_librarys(kPortSamplers[k], answer);
  }
}

INSTANTIATE_TEST_SUITE_P(Languages, Shader, testing::Values("glsl", "hlsl"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace facetwise::test
