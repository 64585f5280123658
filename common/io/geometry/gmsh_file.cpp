// SPDX-License-Identifier: GPL-3.0-or-later
// Both encodings hold the same numbers in the same order, so one reader walks both and only the
// cursor differs.
#include <map>
#include <unordered_map>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/number_cursor.hpp"
#include "common/io/geometry/element_table.hpp"
#include "common/io/geometry/mesh_formats.hpp"

namespace brainshift::io {
namespace {

// Numbers, lines and sections.
class Cursor : public NumberCursor {
 public:
  explicit Cursor(std::string_view content) : NumberCursor(content) { enter("$MeshFormat"); }

  void set_binary(bool swap) {
    binary_ = true;
    swap_ = swap;
  }
  bool binary() const { return binary_; }

  std::string_view line() {
    const std::size_t end = rest().find('\n');
    std::string_view text = rest().substr(0, end);
    skip(end == std::string_view::npos ? end : end + 1);
    while (!text.empty() && (text.back() == '\r' || text.back() == ' ')) text.remove_suffix(1);
    return text;
  }
  // Counts of version 2.2 are text in binary files too.
  template <typename T>
  T number() {
    return binary_ ? binary_number<T>(swap_) : text_number<T>();
  }
  int integer() { return number<std::int32_t>(); }
  std::int64_t size() { return number<std::int64_t>(); }  // size_t in the file
  double real() { return number<double>(); }
  // A count of things that take at least one byte each: a larger one is a lie and would exhaust
  // memory.
  std::int64_t checked(std::int64_t count) {
    if (count < 0 || static_cast<std::uint64_t>(count) > rest().size()) {
      refuse_format("section '" + section_ + "' promises " + std::to_string(count) + " entries");
    }
    return count;
  }
  void enter(std::string_view name) {
    section_ = name;
    NumberCursor::enter("section '" + section_ + "' ");
  }
  void skip_section() {
    const std::string end = "$End" + section_.substr(1);
    const std::size_t at = rest().find(end);
    if (at == std::string_view::npos) refuse_format("section '" + section_ + "' has no end");
    skip(at + end.size());
    line();
  }

 private:
  std::string section_;
  bool binary_ = false;
  bool swap_ = false;
};

class Reader {
 public:
  explicit Reader(std::string_view content) : cursor_(content) {}
  GroupedMesh read() {
    read_format();
    bool has_elements = false;
    while (!cursor_.rest().empty()) {
      const std::string_view name = cursor_.line();
      if (name.empty()) continue;
      if (name.front() != '$') refuse_format("has text outside of its sections");
      cursor_.enter(name);
      if (name == "$Nodes") {
        version_4_ ? read_nodes_4() : read_nodes_2();
        has_nodes_ = true;
      } else if (name == "$Elements") {
        version_4_ ? read_elements_4() : read_elements_2();
        has_elements = true;
      } else if (name == "$Entities") {
        read_entities(false);
      } else if (name == "$PartitionedEntities") {
        cursor_.size();  // number of partitions
        for (std::int64_t ghosts = cursor_.checked(cursor_.size()); ghosts > 0; --ghosts) {
          cursor_.integer(), cursor_.integer();
        }
        read_entities(true);
      } else if (name == "$PhysicalNames") {
        read_physical_names();
      }
      cursor_.skip_section();
    }
    if (!has_nodes_) refuse_format("has no $Nodes section");
    if (!has_elements) refuse_format("has no $Elements section");
    return mesh();
  }

 private:
  void read_format() {
    if (cursor_.line() != "$MeshFormat")
      refuse_format("is not a Gmsh file: it must begin with $MeshFormat");
    const auto version = cursor_.text_number<double>();
    const auto binary = cursor_.text_number<int>();
    const auto size = cursor_.text_number<int>();
    if (version != 2.2 && version != 4.1) {
      std::string text = std::to_string(version);
      refuse_format("Gmsh format version " + text.substr(0, text.find('.') + 2) +
                    " is not supported: must be 2.2 or 4.1");
    }
    version_4_ = version == 4.1;
    if (size != 8)
      refuse_format("Gmsh data size " + std::to_string(size) + " is not supported: must be 8");
    cursor_.line();
    if (binary == 1) {
      if (cursor_.rest().size() < 4) refuse_format("ends inside $MeshFormat");
      cursor_.set_binary(load_number<std::int32_t>(cursor_.rest().data(), false) != 1);
      if (cursor_.integer() != 1) refuse_format("byte order mark is damaged");
      cursor_.line();
    }
    cursor_.skip_section();
  }

  // "dimension tag "name"" per line, as text in binary files too.
  void read_physical_names() {
    const std::int64_t count = cursor_.checked(cursor_.text_number<std::int64_t>());
    cursor_.line();
    for (std::int64_t i = 0; i < count; ++i) {
      const auto dimension = cursor_.text_number<int>();
      const auto tag = cursor_.text_number<int>();
      const std::string_view rest = cursor_.line();
      const std::size_t open = rest.find('"');
      const std::size_t close = rest.rfind('"');
      if (open == close)
        refuse_format("section '$PhysicalNames' holds a name without quotation marks");
      const std::string name(rest.substr(open + 1, close - open - 1));
      if (dimension == 3) volume_names_.emplace(name, tag);
      if (dimension == 2) surface_names_.emplace(name, tag);
    }
  }

  // Parts of entities, as partitioned meshes have them, name their parent and their partitions too.
  void read_entities(bool parts) {
    std::int64_t counts[4];
    for (std::int64_t& count : counts) count = cursor_.checked(cursor_.size());
    for (int dimension = 0; dimension < 4; ++dimension) {
      for (std::int64_t i = 0; i < counts[dimension]; ++i) {
        const int tag = cursor_.integer();
        bool own = true;  // the groups of a face between two parts are those of their volume
        if (parts) {
          own = cursor_.integer() == dimension;
          cursor_.integer();  // tag of the parent
          for (std::int64_t n = cursor_.checked(cursor_.size()); n > 0; --n) cursor_.integer();
        }
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) cursor_.real();  // point or bounding box
        const std::int64_t physical_tags = cursor_.checked(cursor_.size());
        for (std::int64_t k = 0; k < physical_tags; ++k) {
          const int physical = cursor_.integer();
          if (!own) continue;
          if (dimension == 3 && k == 0) physical_of_volume_[tag] = physical;
          if (dimension == 2) physicals_of_surface_[tag].push_back(physical);
        }
        if (dimension == 0) continue;
        const std::int64_t bounding = cursor_.checked(cursor_.size());
        for (std::int64_t k = 0; k < bounding; ++k) cursor_.integer();
      }
    }
  }

  void read_nodes_2() {
    const std::int64_t count = cursor_.checked(cursor_.text_number<std::int64_t>());
    if (cursor_.binary()) cursor_.line();
    for (std::int64_t i = 0; i < count; ++i) {
      const int tag = cursor_.integer();
      const double x = cursor_.real();
      const double y = cursor_.real();
      add_node(tag, x, y, cursor_.real());
    }
  }

  void read_nodes_4() {
    const std::int64_t blocks = cursor_.size();
    for (int k = 0; k < 3; ++k) cursor_.size();  // number of nodes, smallest and largest tag
    for (std::int64_t block = 0; block < blocks; ++block) {
      const int dimension = cursor_.integer();
      cursor_.integer();  // entity tag
      const bool parametric = cursor_.integer() != 0;
      std::vector<std::int64_t> tags(static_cast<std::size_t>(cursor_.checked(cursor_.size())));
      for (std::int64_t& tag : tags) tag = cursor_.size();
      for (const std::int64_t tag : tags) {
        const double x = cursor_.real();
        const double y = cursor_.real();
        add_node(tag, x, y, cursor_.real());
        for (int k = 0; parametric && k < dimension; ++k) cursor_.real();
      }
    }
  }

  void read_elements_2() {
    const std::int64_t count = cursor_.checked(cursor_.text_number<std::int64_t>());
    if (cursor_.binary()) cursor_.line();
    std::vector<std::int64_t> vertices;
    for (std::int64_t read = 0; read < count;) {
      // A binary file states type and number of tags once for a run of elements.
      int in_run = 1;
      int type = 0;
      int tags = 0;
      if (cursor_.binary()) {
        type = cursor_.integer();
        in_run = cursor_.integer();
        tags = cursor_.integer();
        if (in_run < 1) refuse_format("a run of elements is empty");
      }
      for (int i = 0; i < in_run; ++i, ++read) {
        cursor_.integer();  // element number
        if (!cursor_.binary()) {
          type = cursor_.integer();
          tags = cursor_.integer();
        }
        int physical = 0;
        for (int k = 0; k < tags; ++k) {
          const int tag = cursor_.integer();
          if (k == 0) physical = tag;
        }
        vertices.resize(static_cast<std::size_t>(gmsh_element(type).nodes));
        for (std::int64_t& vertex : vertices) vertex = cursor_.integer();
        add_element(type, vertices, physical);
      }
    }
  }

  void read_elements_4() {
    const std::int64_t blocks = cursor_.size();
    for (int k = 0; k < 3; ++k) cursor_.size();  // number of elements, smallest and largest tag
    std::vector<std::int64_t> vertices;
    for (std::int64_t block = 0; block < blocks; ++block) {
      const int dimension = cursor_.integer();
      const int entity = cursor_.integer();
      const int type = cursor_.integer();
      const std::int64_t count = cursor_.checked(cursor_.size());
      const auto physical = physical_of_volume_.find(entity);
      vertices.resize(static_cast<std::size_t>(gmsh_element(type).nodes));
      for (std::int64_t i = 0; i < count; ++i) {
        cursor_.size();  // element tag
        for (std::int64_t& vertex : vertices) vertex = cursor_.size();
        if (dimension == 2) {
          for (const int group : physicals_of_surface_[entity]) add_element(type, vertices, group);
          continue;
        }
        const bool has_label = dimension == 3 && physical != physical_of_volume_.end();
        add_element(type, vertices, has_label ? physical->second : 0);
      }
    }
  }

  void add_node(std::int64_t tag, double x, double y, double z) {
    const auto index = static_cast<int>(index_of_tag_.size());
    if (!index_of_tag_.emplace(tag, index).second) {
      refuse_format("node " + std::to_string(tag) + " is given twice");
    }
    coordinates_.insert(coordinates_.end(), {x, y, z});
  }

  // Takes over the vertices of a tetrahedron, and of a triangle that belongs to a group.
  void add_element(std::int64_t type, const std::vector<std::int64_t>& tags, int physical) {
    if (type == kGmshTetrahedron) {
      tets_.insert(tets_.end(), tags.begin(), tags.end());
      labels_.push_back(physical);
    } else if (type == kGmshTriangle) {
      if (physical == 0) return;
      triangles_.insert(triangles_.end(), tags.begin(), tags.end());
      triangle_labels_.push_back(physical);
    } else if (const ElementKind& kind = gmsh_element(type);
               kind.dimension == 3 || (kind.dimension == 2 && physical != 0)) {
      others_.add(kind, type);
    }
  }

  // Indices of nodes given by tags, of cells with so many vertices.
  std::vector<int> indices(const std::vector<std::int64_t>& tags, std::size_t vertices,
                           const std::string& cell) const {
    std::vector<int> found_indices;
    for (std::size_t i = 0; i < tags.size(); ++i) {
      const auto found = index_of_tag_.find(tags[i]);
      if (found == index_of_tag_.end()) {
        refuse_format(cell + " " + std::to_string(i / vertices) + " has node " +
                      std::to_string(tags[i]) + ", which does not exist");
      }
      found_indices.push_back(found->second);
    }
    return found_indices;
  }

  GroupedMesh mesh() const {
    others_.check(static_cast<std::int64_t>(tets_.size() / 4));
    GroupedMesh result;
    TetMesh& mesh = result.mesh;
    mesh.nodes = as_columns<3>(coordinates_);
    mesh.tets = as_columns<4>(indices(tets_, 4, "tetrahedron"));
    // A file without physical groups has no labels.
    const bool labelled =
        std::any_of(labels_.begin(), labels_.end(), [](int label) { return label != 0; });
    if (labelled) mesh.labels = labels_;
    result.triangles = as_columns<3>(indices(triangles_, 3, "triangle"));
    result.triangle_labels = triangle_labels_;
    result.volume_names = volume_names_;
    result.surface_names = surface_names_;
    return result;
  }

  Cursor cursor_;
  bool version_4_ = false;
  bool has_nodes_ = false;
  std::map<int, int> physical_of_volume_;
  std::map<int, std::vector<int>> physicals_of_surface_;
  std::map<std::string, int> volume_names_, surface_names_;
  std::unordered_map<std::int64_t, int> index_of_tag_;
  OtherElements others_;
  std::vector<double> coordinates_;
  std::vector<std::int64_t> tets_;  // tags
  std::vector<int> labels_;
  std::vector<std::int64_t> triangles_;  // tags
  std::vector<int> triangle_labels_;
};

}  // namespace

Result<GroupedMesh> parse_gmsh(const std::string& content) {
  return format_problems_as_errors([&] { return Reader(content).read(); });
}

}  // namespace brainshift::io
