// SPDX-License-Identifier: GPL-3.0-or-later
// FieldStream: makes pictures from the updates of one model. Set up once per model (some tenths of
// a second); a picture then is a gather.
//
//   grid     the region's nodes, margin_mm around them; over the margin the field fades to zero, so
//            that every node of the region is shown as the mesh has it, within grid_error_mm
//   tumour   the model's tumour surface, moved by u of the mesh
//   cortex   the boundary of the mesh, moved by u
//   ventricles, septa   of a model that has them: the wall moved by u; the sheets, which stay
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "client/tools/bridge/picture.hpp"
#include "client/tools/volume/grid_sampler.hpp"
#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

struct StreamOptions {
  Region region = TumourRegion{40.0};
  double margin_mm = 10.0;
  double spacing_mm = 2.0;
  bool with_sd = true;  // and what is known
  bool with_surfaces = true;
};

class FieldStream {
 public:
  // kEmptySet, kInvalidArgument: of the region and the grid.
  static Result<FieldStream> build(const BrainModel& model, const StreamOptions& options);

  // What to ask of the daemon: the smallest choice that holds every node that a picture needs.
  const FieldChoice& choice() const { return choice_; }
  const FieldGrid& grid() const { return sampler_.grid(); }
  const std::shared_ptr<const Rest>& rest() const { return rest_; }
  double fade_mm() const { return fade_mm_; }

  // The picture of an update: field and state; of the state, session, sequence, quality and the
  // figures of grid and field are filled in. kInvalidArgument: the update is of another model or
  // mesh, or leaves out a node that is needed.
  Result<std::shared_ptr<Picture>> picture(const UpdateMessage& message);

 private:
  // A point of a surface as a mean of four nodes.
  struct Anchors {
    Eigen::Matrix<int, 4, Eigen::Dynamic> nodes;
    Eigen::Matrix<double, 4, Eigen::Dynamic> weights;
  };
  explicit FieldStream(GridSampler sampler) : sampler_(std::move(sampler)) {}
  static Anchors anchors(const geometry::TetLocator& mesh, const Points& points);
  Anchors& anchors_of(Shape shape) { return anchors_[static_cast<std::size_t>(shape)]; }
  Status take(const UpdateMessage& message);
  igtl::PolyData deformed(const igtl::PolyData& rest, const Anchors& anchors) const;
  FieldChoice smallest_choice(const BrainModel& model) const;

  GridSampler sampler_;
  double fade_mm_ = 0.0;
  std::string model_id_;
  std::shared_ptr<const Rest> rest_;
  std::array<Anchors, kShapes.size()> anchors_;  // of the shapes that move
  std::vector<NodeIndex> needed_;                // ascending
  FieldChoice choice_;
  // Of the newest update, at every node; zero where the choice has none.
  Points u_;
  struct Scalar {
    VecX values;
    bool has = false;  // the newest update has it
  };
  Scalar sd_, known_;
};

}  // namespace brainshift::client
