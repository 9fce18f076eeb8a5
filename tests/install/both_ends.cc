// SPDX-License-Identifier: Apache-2.0
// A program outside with a server and a client in it: the installed components, and one batch between them.
#include <cstdio>
#include <string>
#include <vector>

#include "facetwise/client.h"
#include "facetwise/server.h"

int main(int, char** argv) {
  facetwise::ServerOptions options;
  options.listen = {std::string("unix:") + argv[1]};
  const auto server = facetwise::Server::start(options);
  const auto engine = server.ok() ? facetwise::connect(options.listen) : server.status();
  if (!engine.ok()) {
    std::puts(std::string(engine.status().message()).c_str());
    return 1;
  }
  std::vector<float> here(1000), there(1000);
  facetwise::Batch batch;
  batch.lanes = here.size();
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.3f;
  batch.generator = {.seed = 1};
  batch.out.pdf = here;
  const bool good = facetwise::sample_reflection(batch).ok();
  batch.out.pdf = there;
  return good && (*engine)->sample_reflection(batch).ok() && here == there ? 0 : 1;
}
