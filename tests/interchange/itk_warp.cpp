// SPDX-License-Identifier: GPL-3.0-or-later
// interchange_itk IMAGE (T.h5 | FIELD.nii.gz | FIELD.nrrd) OUT: resamples the image on its own grid
// through a transform file or a displacement field, as the Insight Toolkit understands it. Linear.
#include <itkDisplacementFieldTransform.h>
#include <itkHDF5TransformIOFactory.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkNiftiImageIOFactory.h>
#include <itkNrrdImageIOFactory.h>
#include <itkResampleImageFilter.h>
#include <itkTransformFileReader.h>

#include <iostream>
#include <string>

namespace {

using Image = itk::Image<float, 3>;
using Field = itk::Image<itk::Vector<double, 3>, 3>;
using FieldTransform = itk::DisplacementFieldTransform<double, 3>;
using Transform = itk::Transform<double, 3, 3>;

template <typename Type>
typename Type::Pointer read(const std::string& path) {
  auto reader = itk::ImageFileReader<Type>::New();
  reader->SetFileName(path);
  reader->Update();
  return reader->GetOutput();
}

Transform::Pointer transform_of(const std::string& path) {
  if (path.substr(path.size() - 3) != ".h5") {
    auto transform = FieldTransform::New();
    transform->SetDisplacementField(read<Field>(path));
    return transform.GetPointer();
  }
  auto reader = itk::TransformFileReaderTemplate<double>::New();
  reader->SetFileName(path);
  reader->Update();
  auto* transform = dynamic_cast<FieldTransform*>(reader->GetTransformList()->front().GetPointer());
  if (transform == nullptr) throw std::runtime_error(path + ": holds no displacement field");
  return transform;
}

void warp(const std::string& image_file, const std::string& field, const std::string& out) {
  const auto image = read<Image>(image_file);
  auto filter = itk::ResampleImageFilter<Image, Image>::New();
  filter->SetInput(image);
  filter->SetReferenceImage(image);
  filter->UseReferenceImageOn();
  filter->SetTransform(transform_of(field));
  filter->SetInterpolator(itk::LinearInterpolateImageFunction<Image, double>::New());
  filter->SetDefaultPixelValue(0.0F);
  auto writer = itk::ImageFileWriter<Image>::New();
  writer->SetFileName(out);
  writer->SetInput(filter->GetOutput());
  writer->Update();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: interchange_itk IMAGE TRANSFORM OUT\n";
    return 2;
  }
  itk::HDF5TransformIOFactory::RegisterOneFactory();
  itk::NiftiImageIOFactory::RegisterOneFactory();
  itk::NrrdImageIOFactory::RegisterOneFactory();
  try {
    warp(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::cerr << "interchange_itk: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
