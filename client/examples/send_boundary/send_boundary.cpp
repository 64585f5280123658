// SPDX-License-Identifier: Apache-2.0
// Sends the boundary of a tumour to a running brainshiftd and tells how the brain has moved.
//   send_boundary ENDPOINT POINTS     POINTS: a text file, x y z of a point per line, RAS, mm
#include <brainshift/client.hpp>
#include <cstdio>
#include <fstream>
#include <vector>

using namespace brainshift;

namespace {

int complain(const Error& error) {
  std::fprintf(stderr, "send_boundary: %s\n", error.message.c_str());
  return 1;
}

Points read_points(const char* file) {
  std::ifstream stream(file);
  std::vector<double> numbers;
  for (double number; stream >> number;) numbers.push_back(number);
  return Eigen::Map<const Points>(numbers.data(), 3, static_cast<Eigen::Index>(numbers.size() / 3));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return complain({ErrorCode::kInvalidArgument, "usage: ENDPOINT POINTS"});
  auto client = client::Client::connect(argv[1]);
  if (!client) return complain(client.error());
  const auto status = client->status();
  if (!status) return complain(status.error());
  if (auto ok = client->start_session({.case_id = status->case_id}); !ok) {
    return complain(ok.error());
  }
  const auto model = client->model();  // the mesh that displacements belong to
  if (!model) return complain(model.error());
  if (auto ok = client->subscribe(); !ok) return complain(ok.error());

  Observation seen;
  seen.case_id = status->case_id;
  seen.source = "ius";
  seen.sequence = 1;
  seen.body = TumourBoundary{read_points(argv[2]), 0.5};
  if (auto taken = client->submit(seen); !taken) return complain(taken.error());

  const auto message = client->next_update(std::chrono::seconds(60));
  if (!message) return complain(message.error());
  if (message->error) return complain(*message->error);
  const auto& shown = client->latest_usable();
  if (!shown) return complain({ErrorCode::kUnavailable, "the field is not usable"});
  const Points& u = shown->update.estimate.displacement;  // 3 x nodes, mm
  std::printf("%d nodes, largest displacement %.6f mm, %s\n", static_cast<int>(u.cols()),
              u.colwise().norm().maxCoeff(), to_string(client->field_status().currency).data());
  return 0;
}
