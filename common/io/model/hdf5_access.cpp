// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/hdf5_access.hpp"

#include <algorithm>

namespace brainshift::io {

std::vector<std::string> Hdf5Reader::names(const std::string& group) const {
  const Hdf5Handle handle(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose,
                          group + " is missing");
  H5G_info_t info{};
  check_hdf5(H5Gget_info(handle.get(), &info), group + " is damaged");
  std::vector<std::string> found;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    char name[256] = "";
    const ssize_t length = H5Lget_name_by_idx(handle.get(), ".", H5_INDEX_NAME, H5_ITER_INC, i,
                                              name, sizeof name, H5P_DEFAULT);
    if (length <= 0 || length >= static_cast<ssize_t>(sizeof name)) {
      throw Hdf5Problem{group + " is damaged"};
    }
    found.emplace_back(name);
  }
  return found;
}

Hdf5Reader::DataSet::DataSet(const Hdf5Reader& reader, const std::string& name)
    : reader_(reader),
      name_(name),
      set_(H5Dopen2(reader.file_, name.c_str(), H5P_DEFAULT), H5Dclose, name + " is missing"),
      space_(H5Dget_space(set_.get()), H5Sclose, name + " is damaged") {}

Hdf5Reader::Extent Hdf5Reader::checked_extent(hid_t space, const std::string& name, int rank,
                                              std::size_t bytes_per_number) const {
  hsize_t dims[H5S_MAX_RANK] = {};
  if (H5Sget_simple_extent_dims(space, dims, nullptr) != rank) {
    throw Hdf5Problem{name + " has the wrong shape"};
  }
  // Each extent first, else their product could wrap around.
  const hsize_t row = rank == 2 ? dims[1] : 1;
  const hsize_t most = file_size_ / bytes_per_number;
  if (dims[0] > most || row > most || dims[0] > most / std::max<hsize_t>(row, 1)) {
    throw Hdf5Problem{name + " is larger than the file"};
  }
  Extent extent;
  extent.dims[0] = dims[0];
  extent.dims[1] = rank == 2 ? dims[1] : 0;
  return extent;
}

}  // namespace brainshift::io
