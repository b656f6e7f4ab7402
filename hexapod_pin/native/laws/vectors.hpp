// Short names of the vectors and matrices used throughout the core.
#pragma once

#include <Eigen/Core>

namespace hexapod {

using Eigen::VectorXd;
using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using BaseJacobian = Eigen::Matrix<double, 3, 6>;  // of a point's velocity in the twist of the base
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace hexapod
