// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/invert.hpp"

#include <memory>

#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/inverter.hpp"

namespace brainshift::inversion {

Result<Estimate> invert(const PreparedModel& model, const SparseData& data, Method method,
                        const InversionOptions& options) {
  if (auto status = check_data(data); !status) return tl::unexpected(status.error());
  // Shares nothing: the caller's model outlives the inverter, which ends with this function.
  const std::shared_ptr<const PreparedModel> borrowed(std::shared_ptr<void>(), &model);
  const auto inverter = make_inverter(borrowed, method, options.stop);
  if (!inverter) return tl::unexpected(inverter.error());
  Estimate estimate;
  if (auto status = (*inverter)->update(data, options, estimate); !status) {
    return tl::unexpected(status.error());
  }
  return estimate;
}

}  // namespace brainshift::inversion
