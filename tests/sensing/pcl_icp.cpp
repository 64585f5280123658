// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/pcl_icp.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#include <pcl/search/kdtree.h>

#include "common/core/stopwatch.hpp"

namespace brainshift::sensing {
namespace {

using Point = pcl::PointNormal;
using Cloud = pcl::PointCloud<Point>;

Cloud::Ptr cloud_of(const Points& points, const Points& normals) {
  Cloud::Ptr cloud(new Cloud);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Point point;
    point.getVector3fMap() = points.col(i).cast<float>();
    point.getNormalVector3fMap() = normals.cols() > 0
                                       ? Eigen::Vector3f(normals.col(i).cast<float>())
                                       : Eigen::Vector3f::Zero();
    cloud->push_back(point);
  }
  return cloud;
}

}  // namespace

struct PclIcp::Impl {
  Cloud::Ptr target;
  pcl::search::KdTree<Point>::Ptr tree{new pcl::search::KdTree<Point>};
  std::unique_ptr<pcl::IterativeClosestPoint<Point, Point>> icp;
};

PclIcp::PclIcp(const TriangleSurface& surface, const Points& normals, bool plane,
               int max_iterations)
    : impl_(std::make_unique<Impl>()) {
  impl_->target = cloud_of(surface.vertices, normals);
  impl_->tree->setInputCloud(impl_->target);
  if (plane)
    impl_->icp = std::make_unique<pcl::IterativeClosestPointWithNormals<Point, Point>>();
  else
    impl_->icp = std::make_unique<pcl::IterativeClosestPoint<Point, Point>>();
  impl_->icp->setMaximumIterations(max_iterations);
  impl_->icp->setTransformationEpsilon(1e-8);  // mm^2
  impl_->icp->setInputTarget(impl_->target);
  impl_->icp->setSearchMethodTarget(impl_->tree, true);
}

PclIcp::~PclIcp() = default;

RigidTransform PclIcp::align(const Points& points, double& align_ms) {
  impl_->icp->setInputSource(cloud_of(points, Points(3, 0)));
  Cloud aligned;
  const Stopwatch watch;
  impl_->icp->align(aligned);
  align_ms = watch.milliseconds();
  RigidTransform T;
  T.matrix() = impl_->icp->getFinalTransformation().cast<double>();
  return T;
}

}  // namespace brainshift::sensing
