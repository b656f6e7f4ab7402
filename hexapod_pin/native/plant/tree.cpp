#include "plant/tree.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace hexapod {

std::vector<std::size_t> Tree::chain_to(std::size_t joint) const {
  std::vector<std::size_t> chain;
  for (std::size_t j = joint; j > 1; j = parent[j]) chain.insert(chain.begin(), j);
  return chain;
}

bool Tree::has_three_joint_legs() const {
  if (joints == 2 || (joints - 2) % 3 != 0) return false;
  for (std::size_t j = 2; j < std::size_t(joints); j += 3)
    if (parent[j] != 1 || parent[j + 1] != j || parent[j + 2] != j + 1) return false;
  return true;
}

TreeModel::TreeModel(const std::vector<std::size_t>& parent, std::vector<TreeBody> of_joint,
                     const VectorXd& of_coordinate)
    : bodies(std::move(of_joint)), armature(of_coordinate) {
  const std::size_t count = bodies.size();
  if (count < 2 || parent.size() != count || armature.size() != Eigen::Index(count) + 4)
    throw std::invalid_argument("one parent, body and armature per joint needed, the base first");
  for (std::size_t j = 1; j < count; ++j) {
    if (parent[j] >= j || (j > 1 && parent[j] == 0))
      throw std::invalid_argument("joint " + std::to_string(j) + " must come after its parent");
    const Vec6& motion = bodies[j].motion;
    if (j > 1 && !motion.head<3>().isZero(0.0) && !motion.tail<3>().isZero(0.0))
      throw std::invalid_argument("joint " + std::to_string(j) + " must be revolute or prismatic");
  }
  tree = {int(count) + 5, int(count) + 4, int(count), parent};
}

double TreeModel::total_mass() const {
  double sum = 0.0;
  for (const TreeBody& body : bodies) sum += body.mass;
  return sum;
}

}  // namespace hexapod
