// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/simulation/ultrasound.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/mask.hpp"

namespace brainshift::client {
namespace {

constexpr double kWhiteMatterQuantile = 0.9;  // of the intensities in the brain
constexpr double kFluid = 0.5, kCortex = 0.73;
constexpr double kWhiteScatter = 0.12, kCortexScatter = 0.08, kSulcus = 0.8, kVentricle = 0.006;
constexpr double kTumourScatter = 0.5;
constexpr float kOutsideScatter = 0.01f;

double ramp(double x, double low, double high) {
  return std::clamp((x - low) / (high - low), 0.0, 1.0);
}
double mix(double a, double b, double t) { return a + (b - a) * t; }

Status check_grids(const VoxelImage& mri, const VoxelImage& brain) {
  if (mri.dims == brain.dims && mri.T_ras_voxel.isApprox(brain.T_ras_voxel, 1e-4)) return {};
  return invalid(fmt::format(
      "simulated ultrasound: MRI of {} x {} x {} and brain mask of {} x {} x {} "
      "voxels: must be the same ones",
      mri.dims[0], mri.dims[1], mri.dims[2], brain.dims[0], brain.dims[1], brain.dims[2]));
}

// What all maps are made from.
struct Anatomy {
  float white = 0.0f;  // intensity of white matter
  geometry::DistanceVolume tumour;
};

Result<Anatomy> anatomy(const VoxelImage& mri, const VoxelImage& brain,
                        const TriangleSurface& tumour) {
  if (Status ok = check_grids(mri, brain); !ok) return tl::unexpected(ok.error());
  std::vector<float> inside;
  for (std::size_t i = 0; i < mri.values.size(); ++i)
    if (brain.values[i] > 0.0f) inside.push_back(mri.values[i]);
  if (inside.empty())
    return fail(ErrorCode::kEmptySet, "simulated ultrasound: no brain in the mask");
  const auto rank =
      static_cast<std::ptrdiff_t>(kWhiteMatterQuantile * static_cast<double>(inside.size() - 1));
  std::nth_element(inside.begin(), inside.begin() + rank, inside.end());
  const auto index = geometry::ClosestPointIndex::build(tumour);
  if (!index) return tl::unexpected(index.error());
  geometry::DistanceGridOptions options;
  options.spacing_mm = 1.0;
  auto grid = geometry::signed_distance_grid(*index, options);
  if (!grid) return tl::unexpected(grid.error());
  auto volume = geometry::DistanceVolume::create(std::move(*grid));
  if (!volume) return tl::unexpected(volume.error());
  return Anatomy{inside[static_cast<std::size_t>(rank)], std::move(*volume)};
}

VoxelImage like(const VoxelImage& image) {
  return {image.dims, image.T_ras_voxel, std::vector<float>(image.values.size(), 0.0f)};
}

// Calls visit(voxel, its place).
template <typename Visit>
void for_each_voxel(const VoxelImage& image, const Visit& visit) {
  std::size_t voxel = 0;
  for (int k = 0; k < image.dims[2]; ++k)
    for (int j = 0; j < image.dims[1]; ++j)
      for (int i = 0; i < image.dims[0]; ++i, ++voxel)
        visit(voxel, Vec3(image.T_ras_voxel * Vec3(i, j, k)));
}

// Noise of unit variance with a grain of about `grain_mm`.
VoxelImage uneven(const VoxelImage& image, double grain_mm, std::uint64_t seed) {
  Random random(seed);
  VoxelImage noise = like(image);
  for (float& value : noise.values) value = static_cast<float>(random.normal());
  noise = geometry::gaussian_smooth(noise, grain_mm);
  Eigen::Map<Eigen::ArrayXf> all(noise.values.data(),
                                 static_cast<Eigen::Index>(noise.values.size()));
  const float sd = std::sqrt(all.square().mean());
  if (sd > 0.0f) all /= sd;
  return noise;
}

struct Echo {
  double scatter, impedance;
};

// f: intensity relative to white matter; ventricle: 0 to 1, how much of the surroundings is fluid.
Echo healthy_echo(double f, double ventricle) {
  const double fluid = 1.0 - ramp(f, kFluid - 0.1, kFluid + 0.15);
  const double white = ramp(f, kCortex + 0.05, 0.98);
  const double of_fluid = mix(kSulcus, kVentricle, ramp(ventricle, 0.55, 0.8));
  return {mix(mix(kCortexScatter, kWhiteScatter, white), of_fluid, fluid),
          mix(mix(0.5, 0.4, white), 0.0, fluid)};
}

constexpr double kBeamRadiansPerDegree = std::numbers::pi / 180.0;
constexpr double kWindowReach =
    30.0;  // mm, as far as the brain's surface may be from the given centre
constexpr double kBoundaryEcho = 0.6;  // q, mm: of a unit of impedance per mm
constexpr double kTransmissionLoss = 0.12;
constexpr double kDuraEcho = 1.5, kBoneEcho = 3.0;

using ComplexMatrix = Eigen::MatrixXcf;

// Gaussian of standard deviation sd_samples along the rows' index (down each column).
ComplexMatrix smoothed_down(const ComplexMatrix& in, double sd_samples) {
  const int reach = static_cast<int>(std::ceil(3.0 * sd_samples));
  ComplexMatrix out = ComplexMatrix::Zero(in.rows(), in.cols());
  for (int r = -reach; r <= reach; ++r) {
    const auto weight = static_cast<float>(std::exp(-0.5 * r * r / (sd_samples * sd_samples)));
    const Eigen::Index count = in.rows() - std::abs(r);
    if (count <= 0) continue;
    out.middleRows(std::max(0, r), count) += weight * in.middleRows(std::max(0, -r), count);
  }
  return out;
}

// Circular Gaussian noise of unit variance: samples x beams.
ComplexMatrix speckle(Eigen::Index samples, Eigen::Index beams, double sd_samples, double sd_beams,
                      Random& random) {
  ComplexMatrix field(samples, beams);
  for (Eigen::Index i = 0; i < field.size(); ++i) {
    const auto real = static_cast<float>(random.normal());
    field.data()[i] = {real, static_cast<float>(random.normal())};
  }
  field = smoothed_down(field, sd_samples);
  field = smoothed_down(field.transpose().eval(), sd_beams).transpose().eval();
  const float power = field.cwiseAbs2().mean();
  return field / std::sqrt(power);
}

// An image plane: the array's centre of curvature, the direction into the head and the one across.
struct Plane {
  Vec3 apex, axis, across, normal;
};

// Seen from the array: places, tissue there.
class Insonation {
 public:
  Insonation(const TissueEcho& tissue, const ProbeWindow& window, const UltrasoundProbe& probe)
      : window_(window),
        probe_(probe),
        scatter_(tissue.scatter),
        impedance_(tissue.impedance),
        brain_(tissue.brain) {}

  Eigen::Index samples() const {
    return static_cast<Eigen::Index>(std::floor(probe_.depth_mm / probe_.sample_mm)) + 1;
  }
  double beam_angle(Eigen::Index beam) const {
    const double step = 2.0 * probe_.half_angle_deg / std::max(1, probe_.beams - 1);
    return (-probe_.half_angle_deg + step * static_cast<double>(beam)) * kBeamRadiansPerDegree;
  }

  // Envelope, samples x beams.
  Eigen::MatrixXf envelope(const Plane& plane, Random& random) const {
    const double beam_deg = 2.0 * probe_.half_angle_deg / std::max(1, probe_.beams - 1);
    const ComplexMatrix grains =
        speckle(samples(), probe_.beams, probe_.range_sd_mm / probe_.sample_mm,
                probe_.lateral_sd_deg / beam_deg, random);
    const ComplexMatrix floor = speckle(samples(), probe_.beams, 0.5, 0.5, random);
    Eigen::MatrixXf out(samples(), probe_.beams);
    for (Eigen::Index beam = 0; beam < probe_.beams; ++beam) {
      const double angle = beam_angle(beam);
      const Vec3 direction = std::cos(angle) * plane.axis + std::sin(angle) * plane.across;
      const Vec3 start = plane.apex + probe_.array_radius_mm * direction;
      trace(start, direction, plane.normal, grains.col(beam), floor.col(beam), out.col(beam));
    }
    return out;
  }

 private:
  // Mean over the thickness of the slice: three taps of equal variance.
  double over_slice(const geometry::Interpolator& image, const Vec3& x, const Vec3& normal) const {
    const Vec3 off = std::numbers::sqrt3 * probe_.slice_sd_mm * normal;
    return (image(x - off) + 4.0 * image(x) + image(x + off)) / 6.0;
  }
  bool through_window(const Vec3& x) const {
    const Vec3 offset = x - window_.centre;
    const double u = offset.dot(window_.along) / window_.half_long_mm;
    const double v = offset.dot(window_.outward.cross(window_.along)) / window_.half_short_mm;
    return u * u + v * v <= 1.0;
  }

  void trace(const Vec3& start, const Vec3& direction, const Vec3& normal,
             const Eigen::Ref<const Eigen::VectorXcf>& grains,
             const Eigen::Ref<const Eigen::VectorXcf>& floor,
             Eigen::Ref<Eigen::VectorXf> out) const {
    const double h = probe_.sample_mm;
    double transmitted = 1.0;
    bool entered = false;
    double last_inside = brain_(start), last_impedance = impedance_(start);
    for (Eigen::Index k = 0; k < out.size(); ++k) {
      const double r = h * static_cast<double>(k);
      const Vec3 x = start + r * direction;
      const double inside = brain_(x);
      const double impedance = over_slice(impedance_, x, normal);
      const double jump = std::abs(impedance - last_impedance) / h;
      double boundary = inside > 0.5 && last_inside > 0.5 ? kBoundaryEcho * jump : 0.0;
      bool bone = false;
      if (inside > 0.5 && !entered) {
        entered = true;
        bone = !through_window(x);
        boundary = bone ? kBoneEcho : kDuraEcho;
      } else if (inside < 0.5 && last_inside >= 0.5 && entered) {
        bone = true;
        boundary = kBoneEcho;
      }
      const double gain = transmitted * std::pow(10.0, -probe_.attenuation_db_mm * r / 20.0);
      const std::complex<float> echo =
          static_cast<float>(gain) *
              (static_cast<float>(over_slice(scatter_, x, normal)) * grains[k] +
               static_cast<float>(boundary)) +
          static_cast<float>(probe_.noise) * floor[k];
      out[k] = std::abs(echo);
      transmitted *= bone ? 0.0 : std::max(0.0, 1.0 - kTransmissionLoss * jump * h);
      last_inside = inside;
      last_impedance = impedance;
    }
  }

  const ProbeWindow& window_;
  const UltrasoundProbe& probe_;
  geometry::Interpolator scatter_, impedance_, brain_;
};

// The grid of pixels: u across from the sector's left end, v from the middle of the array down.
struct PixelGrid {
  int width = 0, height = 0;
  double left_mm = 0.0;  // of u = 0; v = 0 lies where the sector begins
  double top_mm = 0.0;   // distance of v = 0 from the apex along the axis
};
PixelGrid pixel_grid(const UltrasoundProbe& probe) {
  const double reach = probe.array_radius_mm + probe.depth_mm;
  PixelGrid grid;
  grid.top_mm = probe.array_radius_mm * std::cos(probe.half_angle_deg * kBeamRadiansPerDegree);
  grid.left_mm = -reach * std::sin(probe.half_angle_deg * kBeamRadiansPerDegree);
  grid.width = static_cast<int>(std::ceil(-2.0 * grid.left_mm / probe.pixel_mm)) + 1;
  grid.height = static_cast<int>(std::ceil((reach - grid.top_mm) / probe.pixel_mm)) + 1;
  return grid;
}

// From beams to pixels, bilinear, and from amplitude to grey.
std::string scan_converted(const Eigen::MatrixXf& envelope, const UltrasoundProbe& probe,
                           const PixelGrid& grid) {
  std::string pixels(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height),
                     '\0');
  const double beams_per_rad =
      (probe.beams - 1) / (2.0 * probe.half_angle_deg * kBeamRadiansPerDegree);
  for (int v = 0; v < grid.height; ++v)
    for (int u = 0; u < grid.width; ++u) {
      const double across = grid.left_mm + u * probe.pixel_mm;
      const double down = grid.top_mm + v * probe.pixel_mm;
      const double k = (std::hypot(across, down) - probe.array_radius_mm) / probe.sample_mm;
      const double b =
          (std::atan2(across, down) + probe.half_angle_deg * kBeamRadiansPerDegree) * beams_per_rad;
      if (!(k >= 0.0 && k < static_cast<double>(envelope.rows() - 1) && b >= 0.0 &&
            b < static_cast<double>(envelope.cols() - 1)))
        continue;
      const auto row = static_cast<Eigen::Index>(k), column = static_cast<Eigen::Index>(b);
      const auto s = static_cast<float>(k - static_cast<double>(row));
      const auto t = static_cast<float>(b - static_cast<double>(column));
      const auto cell = envelope.block<2, 2>(row, column);
      const float echo = (1 - s) * ((1 - t) * cell(0, 0) + t * cell(0, 1)) +
                         s * ((1 - t) * cell(1, 0) + t * cell(1, 1));
      const double db = 20.0 * std::log10(std::max(1e-12, echo / probe.brightest));
      const double grey = 1.0 + 254.0 * (1.0 + db / probe.dynamic_range_db);
      pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) +
             static_cast<std::size_t>(u)] =
          static_cast<char>(static_cast<unsigned char>(std::clamp(grey, 1.0, 255.0)));
    }
  return pixels;
}

AffineTransform pixels_to_ras(const Plane& plane, const UltrasoundProbe& probe,
                              const PixelGrid& grid) {
  AffineTransform T;
  T.linear() << probe.pixel_mm * plane.across, probe.pixel_mm * plane.axis,
      probe.pixel_mm * plane.normal;
  T.translation() = plane.apex + grid.left_mm * plane.across + grid.top_mm * plane.axis;
  T.makeAffine();
  return T;
}

// Planes of one sweep: `across` of the middle plane, tilted about it through the window's centre.
std::vector<Plane> fan(const ProbeWindow& window, const UltrasoundProbe& probe,
                       const UltrasoundSweep& sweep, const Vec3& axis, const Vec3& across) {
  std::vector<Plane> planes;
  for (int i = 0; i < sweep.frames_per_sweep; ++i) {
    const double at = sweep.frames_per_sweep > 1 ? 2.0 * i / (sweep.frames_per_sweep - 1) - 1.0 : 0;
    const Mat3 tilt =
        Eigen::AngleAxisd(at * sweep.tilt_deg * kBeamRadiansPerDegree, across).toRotationMatrix();
    Plane plane;
    plane.axis = tilt * axis;
    plane.across = across;
    plane.normal = plane.across.cross(plane.axis);
    plane.apex = window.centre - (probe.array_radius_mm + probe.standoff_mm) * plane.axis;
    planes.push_back(plane);
  }
  return planes;
}

}  // namespace

Result<TissueEcho> tissue_echo(const VoxelImage& mri, const VoxelImage& brain,
                               const TriangleSurface& tumour) {
  const auto head = anatomy(mri, brain, tumour);
  if (!head) return tl::unexpected(head.error());
  TissueEcho tissue{like(mri), like(mri), like(mri)};
  VoxelImage fluid = like(mri);
  for (std::size_t i = 0; i < mri.values.size(); ++i) {
    const bool inside = brain.values[i] > 0.0f;
    tissue.brain.values[i] = inside ? 1.0f : 0.0f;
    fluid.values[i] = inside && mri.values[i] < kFluid * head->white ? 1.0f : 0.0f;
  }
  fluid = geometry::gaussian_smooth(fluid, 2.5);
  const VoxelImage grain = uneven(mri, 2.0, 11);
  for_each_voxel(mri, [&](std::size_t i, const Vec3& x) {
    if (tissue.brain.values[i] == 0.0f) {
      tissue.scatter.values[i] = kOutsideScatter;
      return;
    }
    Echo echo = healthy_echo(mri.values[i] / head->white, fluid.values[i]);
    const double in_tumour = ramp(-head->tumour.at(x).distance_mm, -0.5, 0.5);
    echo.scatter = mix(echo.scatter, kTumourScatter * std::exp(0.25 * grain.values[i]), in_tumour);
    echo.impedance = mix(echo.impedance, 0.9, in_tumour);
    tissue.scatter.values[i] = static_cast<float>(echo.scatter);
    tissue.impedance.values[i] = static_cast<float>(echo.impedance);
  });
  tissue.brain = geometry::gaussian_smooth(tissue.brain, 0.7);
  tissue.impedance = geometry::gaussian_smooth(tissue.impedance, 0.5);
  return tissue;
}

Result<VoxelImage> mri_with_tumour(const VoxelImage& mri, const VoxelImage& brain,
                                   const TriangleSurface& tumour,
                                   const TumourAppearance& appearance) {
  const auto head = anatomy(mri, brain, tumour);
  if (!head) return tl::unexpected(head.error());
  VoxelImage image = mri;
  Random random(appearance.seed);
  for_each_voxel(mri, [&](std::size_t i, const Vec3& x) {
    const double depth = -head->tumour.at(x).distance_mm;
    const double inner = ramp(depth, appearance.rim_mm - 0.5, appearance.rim_mm + 0.5);
    const double lesion = mix(appearance.rim, appearance.core, inner) * head->white;
    const double value = mix(mri.values[i], lesion, ramp(depth, -0.5, 0.5));
    image.values[i] = static_cast<float>(value + appearance.noise * head->white * random.normal());
  });
  return image;
}

Result<ProbeWindow> probe_window(const VoxelImage& brain, const Craniotomy& craniotomy) {
  VoxelImage mask = brain;
  for (float& value : mask.values) value = value > 0.0f ? 1.0f : 0.0f;
  mask = geometry::gaussian_smooth(mask, 4.0);
  const geometry::Interpolator inside(mask);
  const auto gradient = [&inside](const Vec3& x) {
    Vec3 g;
    for (int a = 0; a < 3; ++a)
      g[a] = inside(x + 2.0 * Vec3::Unit(a)) - inside(x - 2.0 * Vec3::Unit(a));
    return g;
  };
  // To the half level along the mask's gradient, in steps that shrink.
  ProbeWindow window;
  window.centre = craniotomy.centre_mm;
  for (double step = 4.0; step > 0.01;) {
    const Vec3 g = gradient(window.centre);
    if (!(g.norm() > 1e-6) || (window.centre - craniotomy.centre_mm).norm() > kWindowReach)
      return fail(ErrorCode::kEmptySet,
                  fmt::format("craniotomy.centre_mm = [{:g}, {:g}, {:g}]: no surface of the brain "
                              "within {:g} mm",
                              craniotomy.centre_mm[0], craniotomy.centre_mm[1],
                              craniotomy.centre_mm[2], kWindowReach));
    const double before = inside(window.centre) - 0.5;
    window.centre -= (before > 0.0 ? step : -step) * g.normalized();
    if (before * (inside(window.centre) - 0.5) < 0.0) step *= 0.5;
  }
  window.outward = -gradient(window.centre).normalized();
  const Vec3 wanted = craniotomy.long_axis_direction;
  window.along = (wanted - window.outward * window.outward.dot(wanted)).normalized();
  window.half_long_mm = 0.5 * craniotomy.long_axis_mm;
  window.half_short_mm = 0.5 * craniotomy.short_axis_mm;
  return window;
}

tracking::Recording simulate_ultrasound(const TissueEcho& tissue, const ProbeWindow& window,
                                        const UltrasoundProbe& probe, const UltrasoundSweep& sweep,
                                        Random& random) {
  const PixelGrid grid = pixel_grid(probe);
  tracking::Recording recording;
  recording.width = grid.width;
  recording.height = grid.height;
  tracking::LinkSeries link{{"Image", "Ras"}, {}};
  const Insonation insonation(tissue, window, probe);
  const Vec3 axis = (sweep.target - window.centre).normalized();
  const Vec3 first = (window.along - axis * axis.dot(window.along)).normalized();
  for (const Vec3& across : {first, Vec3(axis.cross(first))}) {
    for (const Plane& plane : fan(window, probe, sweep, axis, across)) {
      recording.pixels += scan_converted(insonation.envelope(plane, random), probe, grid);
      recording.time_s.push_back(sweep.period_s * recording.num_frames());
      recording.image_ok.push_back(1);
      link.samples.push_back({pixels_to_ras(plane, probe, grid), tracking::LinkStatus::kOk});
    }
  }
  recording.links.push_back(std::move(link));
  return recording;
}

}  // namespace brainshift::client
