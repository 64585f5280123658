// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/field_series_file.hpp"

#include <fmt/format.h>

#include <functional>
#include <string>
#include <utility>

#include "common/io/files/file_access.hpp"
#include "common/io/model/hdf5_access.hpp"

namespace brainshift::io {

namespace fs = std::filesystem;

struct FieldSeriesFile::Impl {
  Impl(const fs::path& named, PendingFile pending_file)
      : path(named),
        pending(std::move(pending_file)),
        h5(H5Fcreate(pending.temporary_path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
           H5Fclose, "file") {}

  // What HDF5 could not do, as an error.
  Status attempt(const std::function<void(Hdf5Writer&)>& write) {
    try {
      Hdf5Writer out(h5.get());
      write(out);
      return {};
    } catch (const Hdf5Problem& problem) {
      return write_failed(path, "cannot write " + problem.message);
    }
  }

  QuietHdf5 quiet;
  fs::path path;
  PendingFile pending;
  Hdf5Handle h5;
};

FieldSeriesFile::FieldSeriesFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FieldSeriesFile::FieldSeriesFile(FieldSeriesFile&&) noexcept = default;
FieldSeriesFile::~FieldSeriesFile() = default;

Result<FieldSeriesFile> FieldSeriesFile::create(const fs::path& path, const BrainModel& model) {
  auto pending = PendingFile::create(path);
  if (!pending) return tl::unexpected(pending.error());
  std::unique_ptr<Impl> impl;
  try {
    impl = std::make_unique<Impl>(path, std::move(*pending));
  } catch (const Hdf5Problem& problem) {
    return write_failed(path, "cannot write " + problem.message);
  }
  const Status written = impl->attempt([&](Hdf5Writer& out) {
    out.attribute("/", "frame", std::string("RAS"));
    out.attribute("/", "length_unit", std::string("mm"));
    out.attribute("/", "case_id", model.case_id);
    out.attribute("/", "model_id", model.model_id);
    out.group("mesh");
    out.write("mesh/nodes_mm", model.mesh.nodes);
    out.write("mesh/tets", model.mesh.tets);
    out.group("updates");
  });
  if (!written) return tl::unexpected(written.error());
  return FieldSeriesFile(std::move(impl));
}

Status FieldSeriesFile::add(const Update& update, double time_s) {
  return impl_->attempt([&](Hdf5Writer& out) {
    const Estimate& estimate = update.estimate;
    const std::string group = fmt::format("updates/{:06}", update.sequence);
    out.group(group);
    out.write(group + "/displacement_mm", Eigen::Matrix3Xf(estimate.displacement.cast<float>()));
    const auto write_scalars = [&](const char* name, const VecX& values) {
      if (values.size() > 0) out.write(group + name, Eigen::VectorXf(values.cast<float>()));
    };
    write_scalars("/sd_mm", estimate.sd_mm);
    write_scalars("/known", estimate.known);
    out.number(group, "time_s", time_s);
    out.number(group, "sequence", update.sequence);
    out.number(group, "observation_sequence", update.observation_sequence);
    out.attribute(group, "status", std::string(to_string(estimate.status)));
    out.attribute(group, "quality", std::string(to_string(estimate.quality.quality)));
  });
}

Status FieldSeriesFile::commit() {
  Status flushed = impl_->attempt([&](Hdf5Writer&) {
    check_hdf5(H5Fflush(impl_->h5.get(), H5F_SCOPE_GLOBAL), "buffers");
    if (!impl_->h5.close()) throw Hdf5Problem{"buffers"};
  });
  if (!flushed) return flushed;
  return impl_->pending.commit();
}

}  // namespace brainshift::io
