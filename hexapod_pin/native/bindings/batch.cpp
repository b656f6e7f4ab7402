// Batches: rollouts over threads, each kept alive until it is done and no longer.
#include "run/batch.hpp"

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include "bindings/bindings.hpp"
#include "bindings/signal_watch.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

class OwningBatch {
 public:
  explicit OwningBatch(int threads) : batch_(std::make_unique<Batch>(threads)) {}
  ~OwningBatch() { close(); }

  // Ends what is under way and waits for it, without the interpreter.
  void close() {
    {
      nb::gil_scoped_release released;
      batch_.reset();
    }
    for (const auto& [number, run] : held_) release(run);
    held_.clear();
  }

  long add(nb::object rollout, long samples, long slice) {
    require_open();
    auto* run = nb::cast<Rollout*>(rollout);
    watch_.put_on(run->monitor());
    const long number = batch_->add(run, samples, slice);
    held_.emplace(number, Held{run, std::move(rollout)});
    return number;
  }

  std::tuple<long, bool, std::string> next_done(double patience) {
    require_open();
    Batch::Done done;
    {
      nb::gil_scoped_release released;
      done = batch_->next_done(patience);
    }
    const auto returned = held_.find(done.number);
    if (returned != held_.end()) {
      release(returned->second);
      held_.erase(returned);
    }
    watch_.raise();
    return {done.number, done.good, done.failure};
  }

 private:
  struct Held {
    Rollout* run;
    nb::object owner;
  };

  void require_open() const {
    if (!batch_) throw std::runtime_error("this batch is closed");
  }

  static void release(const Held& held) { SignalWatch::take_off(held.run->monitor()); }

  SignalWatch watch_;
  std::map<long, Held> held_;  // by number; outlives the threads
  std::unique_ptr<Batch> batch_;
};

}  // namespace

void bind_batch(nb::module_& m) {
  nb::class_<OwningBatch>(m, "Batch",
                          "Independent rollouts over threads; they begin when they are added.")
      .def(nb::init<int>(), "threads"_a)
      .def("add", &OwningBatch::add, "rollout"_a, "samples"_a, "slice"_a,
           nb::sig("def add(self, rollout: Rollout, samples: int, slice: int) -> int"),
           "Its number; it advances by `slice` samples at a time.")
      .def("next_done", &OwningBatch::next_done, "patience"_a,
           "Work until another one is done: its number, whether it did not diverge, what it failed "
           "of. Number -1: none left; -2: not within `patience` [s], so that signals can be seen.")
      .def("close", &OwningBatch::close, "Ends what is under way; nothing can be added after it.");
}

}  // namespace hexapod
