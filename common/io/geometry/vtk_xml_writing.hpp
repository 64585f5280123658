// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's XML container as it is written: base64 of zlib blocks, in this machine's byte order.
// Private to io.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// Up to and with the opening tag of the data set, e.g. "UnstructuredGrid", and its field data: the
// string array SPACE = "RAS". 3D Slicer takes points for LPS, which mirrors them, unless a file
// says this (Slicer, vtkMRMLModelStorageNode.cxx).
std::string vtk_heading(const std::string& grid);

// Bytes as the content of a DataArray.
std::string vtk_encoded(std::string_view bytes);
std::string vtk_array_of_bytes(const std::string& name, const std::string& type,
                               Eigen::Index components, std::string_view bytes);

// type: VTK's name of T, e.g. "Float64".
template <typename T>
std::string vtk_array(const std::string& name, const std::string& type, Eigen::Index components,
                      const T* data, std::size_t size) {
  return vtk_array_of_bytes(name, type, components,
                            {reinterpret_cast<const char*>(data), size * sizeof(T)});
}

std::string vtk_fields(const std::vector<NodeField>& fields);

// kInvalidArgument names file and field unless every field has `columns` columns, one per `what`.
Status check_vtk_fields(const std::filesystem::path& path, const std::vector<NodeField>& fields,
                        Eigen::Index columns, const std::string& what);

}  // namespace brainshift::io
