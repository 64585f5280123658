// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/itk_registration.hpp"

#include <itkEuler3DTransform.h>
#include <itkImage.h>
#include <itkImageMaskSpatialObject.h>
#include <itkImageRegistrationMethodv4.h>
#include <itkMattesMutualInformationImageToImageMetricv4.h>
#include <itkMultiThreaderBase.h>
#include <itkRegistrationParameterScalesFromPhysicalShift.h>
#include <itkRegularStepGradientDescentOptimizerv4.h>

#include <algorithm>
#include <cmath>

namespace brainshift::sensing {
namespace {

using Image = itk::Image<float, 3>;
using MaskImage = itk::Image<unsigned char, 3>;
using Mask = itk::ImageMaskSpatialObject<3>;
using Transform = itk::Euler3DTransform<double>;

// Physical coordinates are RAS throughout, on which nothing here depends.
template <typename ItkImage, typename Value>
typename ItkImage::Pointer to_itk(const ItkVolume& volume, const std::vector<float>& values,
                                  const Value& value) {
  auto image = ItkImage::New();
  typename ItkImage::SizeType size;
  typename ItkImage::SpacingType spacing;
  typename ItkImage::PointType origin;
  typename ItkImage::DirectionType direction;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto& column = volume.columns[axis];
    size[axis] = static_cast<itk::SizeValueType>(volume.dims[axis]);
    spacing[axis] = std::hypot(column[0], column[1], column[2]);
    origin[axis] = volume.origin_mm[axis];
    for (unsigned row = 0; row < 3; ++row) direction[row][axis] = column[row] / spacing[axis];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  image->Allocate();
  std::transform(values.begin(), values.end(), image->GetBufferPointer(), value);
  return image;
}

Image::Pointer to_image(const ItkVolume& volume) {
  return to_itk<Image>(volume, *volume.values, [](float v) { return v; });
}

Mask::Pointer to_mask(const ItkVolume& volume) {
  auto mask = Mask::New();
  mask->SetImage(to_itk<MaskImage>(volume, *volume.mask,
                                   [](float v) -> unsigned char { return v > 0.0f ? 1 : 0; }));
  mask->Update();
  return mask;
}

}  // namespace

struct ItkRegistration::Images {
  Image::Pointer fixed, moving;
  Mask::Pointer fixed_mask, moving_mask;
};

ItkRegistration::ItkRegistration(const ItkVolume& fixed, const ItkVolume& moving)
    : images_(std::make_unique<Images>()) {
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  *images_ = {to_image(fixed), to_image(moving), to_mask(fixed), to_mask(moving)};
}
ItkRegistration::~ItkRegistration() = default;

namespace {

using Metric = itk::MattesMutualInformationImageToImageMetricv4<Image, Image>;
using Optimizer = itk::RegularStepGradientDescentOptimizerv4<double>;
using Registration = itk::ImageRegistrationMethodv4<Image, Image, Transform>;

// Turns about the middle of the fixed volume.
Transform::Pointer to_transform(const ItkPose& pose, const Image& fixed) {
  auto transform = Transform::New();
  itk::ContinuousIndex<double, 3> middle;
  const auto size = fixed.GetLargestPossibleRegion().GetSize();
  for (unsigned i = 0; i < 3; ++i) middle[i] = 0.5 * static_cast<double>(size[i] - 1);
  Transform::CenterType centre;
  fixed.TransformContinuousIndexToPhysicalPoint(middle, centre);
  Transform::MatrixType matrix;
  Transform::OffsetType offset;
  for (unsigned i = 0; i < 3; ++i) {
    offset[i] = pose.t[i];
    for (unsigned j = 0; j < 3; ++j) matrix[i][j] = pose.A[i][j];
  }
  transform->SetCenter(centre);
  transform->SetMatrix(matrix);
  transform->SetOffset(offset);
  return transform;
}

Optimizer::Pointer make_optimizer(const Metric::Pointer& metric) {
  auto scales = itk::RegistrationParameterScalesFromPhysicalShift<Metric>::New();
  scales->SetMetric(metric);
  auto optimizer = Optimizer::New();
  optimizer->SetScalesEstimator(scales);
  optimizer->SetDoEstimateLearningRateOnce(true);
  optimizer->SetMinimumStepLength(0.01);
  optimizer->SetRelaxationFactor(0.6);
  optimizer->SetNumberOfIterations(100);
  return optimizer;
}

// The levels of ImageRegistrationOptions, by and large.
void set_levels(Registration& registration) {
  constexpr double kSmoothing_mm[] = {3.0, 2.0, 1.0}, kSampled[] = {0.02, 0.06, 0.2};
  Registration::ShrinkFactorsArrayType shrink(3);
  Registration::SmoothingSigmasArrayType smoothing(3);
  Registration::MetricSamplingPercentageArrayType sampled(3);
  for (unsigned level = 0; level < 3; ++level) {
    shrink[level] = 1;
    smoothing[level] = kSmoothing_mm[level];
    sampled[level] = kSampled[level];
  }
  registration.SetNumberOfLevels(3);
  registration.SetShrinkFactorsPerLevel(shrink);
  registration.SetSmoothingSigmasPerLevel(smoothing);
  registration.SmoothingSigmasAreSpecifiedInPhysicalUnitsOn();
  registration.SetMetricSamplingStrategy(Registration::MetricSamplingStrategyEnum::REGULAR);
  registration.SetMetricSamplingPercentagePerLevel(sampled);
}

}  // namespace

ItkPose ItkRegistration::align(const ItkPose& initial) const {
  auto metric = Metric::New();
  metric->SetNumberOfHistogramBins(32);
  metric->SetFixedImageMask(images_->fixed_mask);
  metric->SetMovingImageMask(images_->moving_mask);
  metric->SetUseMovingImageGradientFilter(false);
  metric->SetUseFixedImageGradientFilter(false);

  const auto transform = to_transform(initial, *images_->fixed);
  auto registration = Registration::New();
  registration->SetMetric(metric);
  registration->SetOptimizer(make_optimizer(metric));
  registration->SetFixedImage(images_->fixed);
  registration->SetMovingImage(images_->moving);
  registration->SetInitialTransform(transform);
  registration->InPlaceOn();
  set_levels(*registration);
  ItkPose pose;
  try {
    registration->Update();
  } catch (const itk::ExceptionObject&) {
    return pose;
  }
  pose.ok = true;
  for (unsigned i = 0; i < 3; ++i) {
    pose.t[i] = transform->GetOffset()[i];
    for (unsigned j = 0; j < 3; ++j) pose.A[i][j] = transform->GetMatrix()[i][j];
  }
  return pose;
}

}  // namespace brainshift::sensing
