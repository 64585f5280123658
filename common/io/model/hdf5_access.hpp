// SPDX-License-Identifier: GPL-3.0-or-later
// The few HDF5 calls that a model file needs. For the .cpp files of io only.
//
// Every number has a fixed size and byte order in the file, so that it means the same on every
// machine. Data sets are contiguous and not compressed: they are read straight into their final
// place. A matrix is column-major in memory; its columns are the rows of the data set (3 x n
// points: n x 3).
#pragma once

#include <hdf5.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace brainshift::io {

// Thrown inside the model file's sources only, by the first HDF5 call that fails; write_model and
// read_model catch it.
struct Hdf5Problem {
  std::string message;
};

// To be made before any other HDF5 call. HDF5 prints every failed call to stderr unless told
// otherwise. At the exit of the process it would close a file again that could not be closed,
// because the disk was full, and crash; everything is closed here explicitly, so it is told to do
// nothing then.
class QuietHdf5 {
 public:
  QuietHdf5() {
    H5dont_atexit();  // has an effect once, before the library starts
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

// Closes an HDF5 identifier; throws when it was not given one.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*closer)(hid_t), const std::string& what) : id_(id), close_(closer) {
    if (id < 0) throw Hdf5Problem{what};
  }
  ~Hdf5Handle() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  hid_t get() const { return id_; }
  // For files: closing writes what is still buffered.
  bool close() {
    const hid_t id = id_;
    id_ = -1;
    return close_(id) >= 0;
  }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

inline void check_hdf5(herr_t status, const std::string& what) {
  if (status < 0) throw Hdf5Problem{what};
}

// The types of a number in memory and in the file.
struct Hdf5Types {
  hid_t memory, file;
};
inline Hdf5Types hdf5_types(double) { return {H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE}; }
inline Hdf5Types hdf5_types(float) { return {H5T_NATIVE_FLOAT, H5T_IEEE_F32LE}; }
inline Hdf5Types hdf5_types(int) { return {H5T_NATIVE_INT, H5T_STD_I32LE}; }
inline Hdf5Types hdf5_types(std::int16_t) { return {H5T_NATIVE_INT16, H5T_STD_I16LE}; }
inline Hdf5Types hdf5_types(std::int8_t) { return {H5T_NATIVE_INT8, H5T_STD_I8LE}; }
inline Hdf5Types hdf5_types(char) { return {H5T_NATIVE_UCHAR, H5T_STD_U8LE}; }
inline Hdf5Types hdf5_types(std::uint64_t) { return {H5T_NATIVE_UINT64, H5T_STD_U64LE}; }
inline Hdf5Types hdf5_types(std::uint32_t) { return {H5T_NATIVE_UINT32, H5T_STD_U32LE}; }

// Two dimensions in the file; all else has one: std::vector, std::string, Eigen vectors.
template <typename T>
concept Hdf5Matrix = requires {
  requires T::ColsAtCompileTime != 1;
};

// Names are paths from the root ("mesh/nodes"); an attribute's `object` is a group, "/" for the
// root.
class Hdf5Writer {
 public:
  explicit Hdf5Writer(hid_t file) : file_(file) {}

  void group(const std::string& name) {
    const Hdf5Handle group(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                           H5Gclose, name);
  }
  // Of everything with data() and size(): std::vector, std::string, Eigen's.
  template <typename Values>
  void write(const std::string& name, const Values& values) {
    if constexpr (Hdf5Matrix<Values>) {
      const hsize_t dims[2] = {static_cast<hsize_t>(values.cols()),
                               static_cast<hsize_t>(values.rows())};
      array(name, values.data(), 2, dims);
    } else {
      const hsize_t dims[1] = {static_cast<hsize_t>(values.size())};
      array(name, values.data(), 1, dims);
    }
  }
  template <typename List>
  void attribute(const std::string& object, const std::string& name, const List& values) {
    using T = std::remove_cv_t<std::remove_reference_t<decltype(*values.data())>>;
    const hsize_t dims[1] = {static_cast<hsize_t>(values.size())};
    const Hdf5Handle space(H5Screate_simple(1, dims, nullptr), H5Sclose, name);
    const Hdf5Handle set(
        H5Acreate_by_name(file_, object.c_str(), name.c_str(), hdf5_types(T{}).file, space.get(),
                          H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose, name);
    if (values.size() == 0) return;
    check_hdf5(H5Awrite(set.get(), hdf5_types(T{}).memory, values.data()), name);
  }
  template <typename T>
  void number(const std::string& object, const std::string& name, T value) {
    attribute(object, name, std::vector<T>{value});
  }

 private:
  template <typename T>
  void array(const std::string& name, const T* data, int rank, const hsize_t* dims) {
    const Hdf5Handle space(H5Screate_simple(rank, dims, nullptr), H5Sclose, name);
    const Hdf5Handle set(H5Dcreate2(file_, name.c_str(), hdf5_types(T{}).file, space.get(),
                                    H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Dclose, name);
    if (dims[0] == 0 || dims[rank - 1] == 0) return;
    check_hdf5(H5Dwrite(set.get(), hdf5_types(T{}).memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data),
               name);
  }
  hid_t file_;
};

class Hdf5Reader {
 public:
  // No data set is compressed, so none can hold more bytes than the file has.
  Hdf5Reader(hid_t file, std::uint64_t file_size) : file_(file), file_size_(file_size) {}

  bool has(const std::string& name) const {
    return H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0;
  }
  // Names of what a group holds, in alphabetical order.
  std::vector<std::string> names(const std::string& group) const;

  template <typename T>
  std::vector<T> list(const std::string& name) const {
    const DataSet set(*this, name);
    std::vector<T> values(static_cast<std::size_t>(set.extent(1, sizeof(T))[0]));
    set.read(values.data(), values.size());
    return values;
  }
  std::string text(const std::string& name) const {
    const std::vector<char> values = list<char>(name);
    return {values.begin(), values.end()};
  }
  template <typename T>
  void read(const std::string& name, std::vector<T>& out) const {
    out = list<T>(name);
  }
  // One allocation, not filled beforehand, read into at once.
  template <typename Matrix>
  void read(const std::string& name, Eigen::PlainObjectBase<Matrix>& out) const {
    using Scalar = typename Matrix::Scalar;
    constexpr int kRows = Matrix::RowsAtCompileTime;
    const DataSet set(*this, name);
    if constexpr (!Hdf5Matrix<Matrix>) {
      out.resize(static_cast<Eigen::Index>(set.extent(1, sizeof(Scalar))[0]));
    } else {
      const Extent dims = set.extent(2, sizeof(Scalar));
      const auto rows = static_cast<Eigen::Index>(dims[1]);
      if (kRows != Eigen::Dynamic && rows != kRows) {
        throw Hdf5Problem{name + " has the wrong shape"};
      }
      out.resize(rows, static_cast<Eigen::Index>(dims[0]));
    }
    set.read(out.data(), static_cast<std::size_t>(out.size()));
  }
  // Exactly `size` numbers, to a place that exists.
  template <typename T>
  void list_into(const std::string& name, T* place, std::size_t size) const {
    const DataSet set(*this, name);
    if (set.extent(1, sizeof(T))[0] != size) throw Hdf5Problem{name + " has the wrong shape"};
    set.read(place, size);
  }
  template <typename T>
  std::vector<T> attribute(const std::string& object, const std::string& name) const {
    const std::string what = "attribute " + (object == "/" ? name : object + ":" + name);
    const Hdf5Handle set(
        H5Aopen_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
        what + " is missing");
    const Hdf5Handle space(H5Aget_space(set.get()), H5Sclose, what + " is damaged");
    std::vector<T> values(
        static_cast<std::size_t>(checked_extent(space.get(), what, 1, sizeof(T))[0]));
    if (values.empty()) return values;
    check_hdf5(H5Aread(set.get(), hdf5_types(T{}).memory, values.data()), what + " is damaged");
    return values;
  }
  std::string attribute_text(const std::string& object, const std::string& name) const {
    const std::vector<char> values = attribute<char>(object, name);
    return {values.begin(), values.end()};
  }
  template <typename T>
  T number(const std::string& object, const std::string& name) const {
    const std::vector<T> values = attribute<T>(object, name);
    if (values.size() != 1) throw Hdf5Problem{"attribute " + name + " is not one number"};
    return values[0];
  }

 private:
  struct Extent {
    hsize_t dims[2] = {0, 0};
    hsize_t operator[](int i) const { return dims[i]; }
  };
  class DataSet {
   public:
    DataSet(const Hdf5Reader& reader, const std::string& name);
    Extent extent(int rank, std::size_t bytes_per_number) const {
      return reader_.checked_extent(space_.get(), name_, rank, bytes_per_number);
    }
    template <typename T>
    void read(T* place, std::size_t size) const {
      if (size == 0) return;
      check_hdf5(H5Dread(set_.get(), hdf5_types(T{}).memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, place),
                 name_ + " is truncated or damaged");
    }

   private:
    const Hdf5Reader& reader_;
    std::string name_;
    Hdf5Handle set_;
    Hdf5Handle space_;
  };
  Extent checked_extent(hid_t space, const std::string& name, int rank,
                        std::size_t bytes_per_number) const;
  hid_t file_;
  std::uint64_t file_size_;
};

}  // namespace brainshift::io
