// Switches of the contacts within a step: a foot that stops pressing before it has left the ground, because
// its damper would pull, or presses again, a bristle that breaks away or sticks again, a foot that crosses
// the edge of a patch of ground, a face of the ground that begins or ends to hold a foot which is deep in it.
// Each contact keeps its piece of the law within a step, which makes the
// right-hand side smooth; the step ends shortly after the first switch, where Plant::update_memories says
// which piece holds next.
#pragma once

#include <utility>
#include <vector>

#include "methods/chart_flow.hpp"
#include "methods/error_control.hpp"
#include "methods/release_scan.hpp"

namespace hexapod {

template <class PlantT>
class ContactEvents {
 public:
  ContactEvents(ChartFlow<PlantT>& flow, const ErrorNorm& norm);

  bool idle() const { return idle_; }        // nothing can switch
  bool changed() const { return changed_; }  // whether a piece has ended in the step of the last `share`

  // Whether a bristle that is frozen slides: nothing damps errors along its slip.
  bool any_sliding() const;

  // A step begins at the state where the plant is evaluated.
  void start();

  // A step, or another try of it, begins at t.
  void begin(double t);

  // Notices switches there and back again within a step; where the plant is not evaluated, nothing.
  void passed(double t, const VectorXd& y);

  // Share of the step h, which ended at y, at which it should end for the first switch to be just behind
  // it; 1 where the step may end here. The plant is evaluated at y, or, where nothing is near a switch,
  // close to it: at a Newton iterate.
  double share(double t, const VectorXd& y, double h);

  // The next step begins where this one ended, in the same pieces.
  void move_on();

 private:
  static constexpr double kNeverReached = 1e300;
  // Shares of the velocity tolerance that the wrong piece behind a switch may cost.
  static constexpr double kOvershootShare = 1e-3;
  static constexpr double kReleaseShare = 1e-2;  // where a force passes through zero
  // A foot's way per largest change of a coordinate, m/m and m/rad: six coordinates of the trunk and those of
  // a leg, of levers below 1.7 m.
  static constexpr double kReach = 10.0;
  // A face is taken for another where its normal has turned by more, and by more than a sphere turns it that
  // rolls over a corner.
  static constexpr double kSharpTurn = 0.05, kTimesRolling = 3.0;  // rad, -
  static constexpr double kFaceAim = 0.25;  // of the step: where in it the face has changed is not known
  static constexpr double kLeastAim = 1e-3, kMostAim = 0.5;  // of what is left of the step behind a switch

  struct Look {  // at one contact
    bool active = false, sliding = false;
    double margin = 0.0;        // of the bristle's piece, N
    double normal_force = 0.0;  // N
    int patch = -1;             // where it is
    double x = 0.0, y = 0.0;    // m
    GapState foot;              // along the normal
    double pressing = 0.0;      // normal force that may pull, N
    bool near = false;          // there is a face, touched or not
    double force = 0.0;         // N
    Vec3 normal = Vec3::Zero();
  };
  struct Crossing {
    double share = 1.0, value = 0.0, step = 0.0;
    int contact = -1, kind = -1;
  };
  enum Kind { kBristle, kPatch, kRelease, kFace };

  // Whether some contact may be in another piece at y than where the plant is evaluated.
  bool near_switch(const VectorXd& y) const;

  bool near_release(const Look& at, const typename PlantT::Contact& foot, double place, double speed) const;

  bool is_evaluated(const VectorXd& y) const;

  void look(std::vector<Look>& at) const;

  // The first switch between the start of the step and a state h later; whether there is any.
  bool find_first(const std::vector<Look>& end, double h, Crossing& first) const;

  // Force [N] that is wrong behind a switch of the bristle, by the end of the step.
  double jump_at_end(std::size_t i, const Look& end) const;

  double patch_jump(int from, const Look& end) const;

  // A crossing of contact i, of a switch with these values at both ends of h.
  void offer(std::size_t i, Kind kind, double before, double after, double jump, double h, double most,
             Crossing& first) const;

  void offer_root(std::size_t i, Kind kind, double root, double after, double jump, double h, double most,
                  Crossing& first) const;

  // Whether contact i stops pressing, or presses again, within h; where it stays out of its piece.
  bool offer_release(std::size_t i, const Look& end, double h, double most, Crossing& first) const;

  // Whether contact i stands on another face than at the start, or on none, deep as it is.
  bool offer_face(std::size_t i, const Look& end, double h, double most, Crossing& first) const;

  // By how much the normal has turned, rad; 0 where that is what rolling over a corner does.
  double sharp_turn(std::size_t i, const Look& start, const Look& end, double h) const;

  // Velocity of a foot per impulse on it, no joint being coupled to another, 1/kg.
  double mobility(std::size_t i) const;

  ChartFlow<PlantT>& flow_;
  ErrorNorm norm_;
  std::vector<Look> start_, end_, inside_;
  double begin_ = 0.0, seen_inside_ = kNeverReached;
  Crossing last_;
  bool bristles_ = false, patches_ = false, releases_ = false, faces_ = false;  // that can switch in this scene
  bool idle_ = false, changed_ = false;
};

}  // namespace hexapod
