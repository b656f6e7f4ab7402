// Lets Python's signal handlers, and whoever wants to end a run, have their turn while runs advance.
#pragma once

#include <nanobind/nanobind.h>

#include <optional>
#include <thread>

#include "run/work_monitor.hpp"

namespace hexapod {

// Belongs to the thread that made it: others that advance its runs do not ask.
class SignalWatch {
 public:
  // `also`: a Python callable or None, called then too; an exception of it ends the run.
  explicit SignalWatch(nanobind::handle also = {}) : also_(also) {}

  // The monitor asks from now on, until the watch is taken off.
  void put_on(WorkMonitor& monitor) {
    monitor.ask([this] { return std::this_thread::get_id() != owner_ || goes_on(); });
  }
  static void take_off(WorkMonitor& monitor) { monitor.ask({}); }

  // Raises what ended a run; with the interpreter held.
  void raise() {
    if (!error_) return;
    nanobind::python_error error = std::move(*error_);
    error_.reset();
    throw error;
  }

 private:
  bool goes_on() {
    const nanobind::gil_scoped_acquire held;
    try {
      if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
      if (also_.is_valid() && !also_.is_none()) also_();
    } catch (nanobind::python_error& error) {
      error_.emplace(std::move(error));
    }
    return !error_;
  }

  nanobind::handle also_;
  std::thread::id owner_ = std::this_thread::get_id();
  std::optional<nanobind::python_error> error_;
};

}  // namespace hexapod
