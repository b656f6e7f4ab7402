// What runs of fixed and of adaptive step share: plant, set-points, state, samples, checkpoints.
#pragma once

#include <utility>
#include <vector>

#include "run/rollout.hpp"

namespace hexapod {

template <class PlantT>
class SampledRollout : public Rollout {
 public:
  SampleTables& samples() override { return recorder_.tables(); }
  const DriveCounters& drive_counters() const override { return plant_.drive_counters; }

 protected:
  SampledRollout(PlantT plant, const RunSetup& setup, bool differentiates_separated)
      : plant_(std::move(plant)), reference_(setup.reference), q_(setup.start.q),
        v_(setup.start.v), ledger_(plant_.feet.size()), recorder_(plant_),
        torque_(plant_.joints()), q_ref_(plant_.joints()), v_ref_(plant_.joints()) {
    plant_.differentiates_separated = differentiates_separated;
    restore_memories(setup.start.contacts);
  }

  // Records the state at time t, the plant evaluated there, at the end of a sampling interval [s].
  void sample(double t, double interval) {
    reference_.begin_step(t);
    reference_.at(t, q_ref_, v_ref_);
    plant_.servo_torque(q_, v_, q_ref_, v_ref_, torque_);
    recorder_.sample(plant_, t, q_, v_, torque_, q_ref_, v_ref_, ledger_, interval);
    for (Vec3& impulse : ledger_.impulse) impulse.setZero();
  }

  Checkpoint checkpoint_at(long samples, std::vector<double> controller) const {
    return {samples, q_, v_, contact_memories(), std::move(controller)};
  }

  PlantT plant_;
  Reference reference_;
  VectorXd q_, v_;
  EnergyLedger ledger_;

 private:
  RowMatrix contact_memories() const {
    RowMatrix rows(plant_.feet.size(), 6);
    for (std::size_t i = 0; i < plant_.feet.size(); ++i) {
      const ContactMemory& m = plant_.feet[i].memory;
      rows.row(i) << m.touch_speed, m.stretch.x(), m.stretch.y(), m.stretch.z(),
          double(m.touching), double(m.sliding);
    }
    return rows;
  }

  void restore_memories(const RowMatrix& rows) {
    for (std::size_t i = 0; i < std::size_t(rows.rows()); ++i)
      plant_.feet[i].memory = {rows(i, 0), rows.row(i).segment<3>(1).transpose(),
                               rows(i, 4) != 0.0, rows(i, 5) != 0.0};
  }

  Recorder recorder_;
  VectorXd torque_, q_ref_, v_ref_;
};

}  // namespace hexapod
