// SPDX-License-Identifier: GPL-3.0-or-later
// sensing_estimates [THOUSAND_NODES [STUDY...]]: the studies of estimate_studies.hpp, by default
// all of them on 18 thousand nodes, with the default case and its prior.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/linalg/openblas.hpp"
#include "tests/sensing/estimate_studies.hpp"
#include "tests/sensing/sensing_head.hpp"

namespace brainshift::sensing {
namespace {

struct Study {
  const char* name;
  Status (*run)(const bench::Head&);
};

Status run(double thousand_nodes, const std::vector<std::string>& wanted) {
  const Study studies[] = {{"joint", joint_study},
                           {"landmarks", landmark_study},
                           {"outliers", outlier_study},
                           {"boundary", boundary_study}};
  const auto head = make_default_head(thousand_nodes);
  if (!head) return tl::unexpected(head.error());
  for (const Study& study : studies) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), study.name) == wanted.end()) {
      continue;
    }
    if (const Status ok = study.run(*head); !ok) {
      return fail(ok.error().code, std::string(study.name) + ": " + ok.error().message);
    }
  }
  return {};
}

}  // namespace
}  // namespace brainshift::sensing

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  const std::vector<std::string> wanted(argv + std::min(argc, 2), argv + argc);
  const auto ok = brainshift::sensing::run(argc > 1 ? std::atof(argv[1]) : 18.0, wanted);
  if (ok) return 0;
  std::fprintf(stderr, "sensing_estimates: %s\n", ok.error().message.c_str());
  return 1;
}
