// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <cstdio>
#include <fstream>
#include "client/twin/ultrasound.hpp"
#include "common/geometry/mask.hpp"
#include "common/io/config_file.hpp"
#include "common/io/image_file.hpp"
#include "common/registration/image_registration.hpp"
#include "common/registration/image_similarity.hpp"
#include "common/registration/rigid_increment.hpp"
#include "common/scene/tumour_surface.hpp"
#include "common/ultrasound/frame_samples.hpp"
using namespace brainshift;
static double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
int main(int argc, char** argv) {
  auto config = io::read_case_config(BRAINSHIFT_DEFAULT_CASE);
  auto inputs = io::load_case_inputs(*config);
  auto mri = io::read_nifti(config->mri);
  auto tumour = scene::make_tumour_surface(*inputs);
  double t0 = now();
  auto tissue = twin::tissue_echo(*mri, *inputs->brain, *tumour);
  if (!tissue) {
    puts(tissue.error().message.c_str());
    return 1;
  }
  auto window = twin::probe_window(*inputs->brain, config->craniotomy);
  if (!window) {
    puts(window.error().message.c_str());
    return 1;
  }
  auto seen = twin::mri_with_tumour(*mri, *inputs->brain, *tumour);
  printf("tissue %.2f s; window %g %g %g out %g %g %g\n", now() - t0, window->centre[0],
         window->centre[1], window->centre[2], window->outward[0], window->outward[1],
         window->outward[2]);
  twin::UltrasoundSweep sweep;
  sweep.target = tumour->vertices.rowwise().mean();
  Random random(3);
  t0 = now();
  auto rec = twin::simulate_ultrasound(*tissue, *window, {}, sweep, random);
  printf("simulated %.2f s %d x %d\n", now() - t0, rec.width, rec.height);
  if (argc > 1)
    for (int f : {10, 31, 3}) {
      std::ofstream o(std::string(argv[1]) + "/f" + std::to_string(f) + ".pgm", std::ios::binary);
      o << "P5\n" << rec.width << " " << rec.height << "\n255\n";
      auto b = rec.frame_bytes(f);
      o.write(b.data(), (long)b.size());
      std::ofstream m(std::string(argv[1]) + "/m" + std::to_string(f) + ".pgm", std::ios::binary);
      m << "P5\n" << rec.width << " " << rec.height << "\n255\n";
      const geometry::Interpolator in(*seen);
      for (int v = 0; v < rec.height; ++v)
        for (int u = 0; u < rec.width; ++u) {
          double x = in(rec.links[0].samples[(size_t)f].T_to_from * Vec3(u, v, 0));
          m.put((char)(unsigned char)std::min(255.0, std::max(0.0, 1.4 * x)));
        }
    }
  ultrasound::ImagePoses poses;
  for (auto& s : rec.links[0].samples) poses.push_back(s.T_to_from);
  auto samples = ultrasound::frame_samples(rec, poses, {0, 0, rec.width, rec.height},
                                           argc > 3 ? atoi(argv[3]) : 2);
  printf("%ld samples\n", (long)samples->positions.cols());
  registration::ImageRegistrationOptions options;
  if (getenv("LEVELS")) {
    options.levels.clear();
    double a[3];
    sscanf(getenv("LEVELS"), "%lf,%lf,%lf", a, a + 1, a + 2);
    options.levels = {{a[0], 4000}, {a[1], 12000}, {a[2], 40000}};
  }
  if (getenv("OFFSET")) options.start_offset_mm = atof(getenv("OFFSET"));
  VoxelImage mask = *inputs->brain;
  for (float& v : mask.values) v = v > 0 ? 1.f : 0.f;
  if (argc > 4) {  // profile
    auto scale = [&](const VecX& v) { return registration::quantile_scale(v, 0.005, 0.995, 32); };
    for (double sm : {4.0, 2.0, 1.0}) {
      VoxelImage im = geometry::gaussian_smooth(*seen, sm);
      VecX v(samples->positions.cols());
      geometry::Interpolator in(im);
      for (int i = 0; i < v.size(); ++i) v[i] = in(samples->positions.col(i));
      registration::ImageSimilarity sim(im, &mask, scale(v), *samples, scale(samples->intensities),
                                        4);
      for (int a = 0; a < 6; ++a) {
        printf("sm %.0f axis %d:", sm, a);
        for (double d = -10; d <= 10; d += 2) {
          registration::Vec6 xi = registration::Vec6::Zero();
          xi[a] = a < 3 ? d * 0.0175 : d;
          auto r = sim.at(registration::rigid_increment(xi, sweep.target), sweep.target);
          printf(" %.4f", r.nmi);
        }
        puts("");
      }
    }
    return 0;
  }
  for (int with = 1; with >= 0; --with) {
    t0 = now();
    auto reg = registration::ImageRegistrar::create(with ? *seen : *mri, &mask, options);
    printf("prepared %.2f s\n", now() - t0);
    Vec3 c = sweep.target;
    for (double radius : {0.0, 2.5, 5.0, 7.5, 10.0, 12.5}) {
      Random r2(5);
      double sum = 0, good = 0, time = 0, evals = 0, tre_max = 0, agree = 0;
      int n = argc > 2 ? atoi(argv[2]) : 10, failed = 0;
      for (int k = 0; k < n; ++k) {
        registration::Vec6 xi;
        xi << 0.1 * radius / 10 * 8 / 5.7 * r2.direction() * r2.uniform(), radius * r2.direction();
        RigidTransform E = registration::rigid_increment(xi, c);
        IntensitySamples s = *samples;
        s.positions = (E.linear() * s.positions).colwise() + Vec3(E.translation());
        t0 = now();
        auto res = reg->align(s);
        time += now() - t0;
        if (!res) {
          ++failed;
          if (k < 2) puts(res.error().message.c_str());
          continue;
        }
        RigidTransform left = res->T_ras_ras * E;
        double tre = 0;
        for (int i = 0; i < tumour->vertices.cols(); ++i)
          tre += (left * tumour->vertices.col(i) - tumour->vertices.col(i)).norm();
        tre /= (double)tumour->vertices.cols();
        sum += tre;
        good += tre < 1.0;
        evals += res->evaluations;
        tre_max = std::max(tre_max, tre);
        agree += res->agreement;
        if (k < 2)
          printf("   tre %.2f shift %.2f rot %.2f nmi %.4f -> %.4f it %d agree %.2f\n", tre,
                 res->shift_mm, res->rotation_deg, res->nmi_before, res->nmi_after, res->iterations,
                 res->agreement);
      }
      printf(
          "with %d radius %.1f: mean %.2f max %.2f success %.0f/%d failed %d time %.2f evals %.0f "
          "agree %.2f\n",
          with, radius, sum / n, tre_max, good, n, failed, time / n, evals / n, agree / n);
    }
  }
}
